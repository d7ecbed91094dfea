# SPDX-License-Identifier: GPL-3.0-or-later
"""`python -m blender_scenes` builds our scenes, plain shapes, and the shape space of people."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable
from pathlib import Path

from blender_scenes.catalogue import Scene, scenes

#: Larger descriptions are refused [bytes].
_LARGEST_JSON = 4_000_000


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m blender_scenes", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("list", help="print the scenes there are")
    build = commands.add_parser("build", help="build a scene's .blend from code")
    build.add_argument("name", nargs="?", default="living_room_walk", help="which scene")
    build.add_argument("--out", type=Path, help="where to; default: beside the catalogue")
    sheet = commands.add_parser("sheet", help="render one picture of every scene side by side")
    sheet.add_argument("--out", type=Path, required=True, help="the picture, .jpg or .png")
    sheet.add_argument("--size", type=int, default=300, help="width of each picture [pixel]")
    sheet.add_argument("--samples", type=int, default=32, help="samples per pixel")
    shapes = commands.add_parser("shapes", help="build a small scene of plain shapes")
    shapes.add_argument("description", type=Path, help="JSON file, see `verification.py`")
    shapes.add_argument("--out", type=Path, required=True, help="the .blend to write")
    bodies = commands.add_parser("bodies", help="build the shape space of rfgs_core.articulated")
    bodies.add_argument("--out", type=Path, help="where to; default: into the package")
    record = commands.add_parser(
        "recording", help="build a room in which one of our people plays motion capture"
    )
    record.add_argument(
        "recording",
        type=Path,
        help="a .bvh of any rig of a person, any unit; or a clip of DeepMimic's format (.txt)",
    )
    record.add_argument("--out", type=Path, required=True, help="the .blend to write")
    record.add_argument("--person", default="emma", help="who plays it (emma)")
    record.add_argument("--fps", type=int, default=10, help="frames per second (10)")
    record.add_argument("--up", choices=("y", "z"), default="y", help="axis that is up (y)")
    record.add_argument(
        "--repeat", type=int, default=1, help="how many times, for a cycle of steps (1)"
    )
    world = commands.add_parser(
        "world", help="build a random world of `rfgs-factory worlds` as a scene to look at"
    )
    world.add_argument("settings", type=Path, help="the worlds.json of the worlds' folder")
    world.add_argument("--index", type=int, default=0, help="which world (0)")
    world.add_argument("--out", type=Path, required=True, help="the .blend to write")
    args = parser.parse_args(arguments)
    known = scenes()
    if args.command == "list":
        for scene in known.values():
            frames = f"{scene.frame_start}:{scene.frame_end} at {scene.fps} fps"
            sys.stdout.write(f"{scene.name}  {frames}  {scene.description}\n")
        return 0
    if args.command == "shapes":
        return _shapes(args.description, args.out)
    if args.command == "bodies":
        return _bodies(args.out)
    if args.command == "recording":
        return _recording(args)
    if args.command == "world":
        return _world(args.settings, args.index, args.out)
    if args.command == "sheet":
        return _sheet(args.out, args.size, args.samples)
    if args.name not in known:
        sys.stderr.write(f"error: no scene {args.name!r}; there are: {', '.join(known)}\n")
        return 2
    return _build(known[args.name], args.out)


def _shapes(description: Path, out: Path) -> int:
    from addon_rfgs.errors import AddonError
    from addon_rfgs.json_file import read_json

    try:
        parts = read_json(description, {str: object}, "see verification.py", _LARGEST_JSON)
    except AddonError as error:
        sys.stderr.write(f"error: {error}\n")
        return 2
    from blender_scenes.verification import build

    try:
        build(parts, out)
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        sys.stderr.write(f"error: {description}: expected parts as in verification.py: {error!r}\n")
        return 2
    sys.stdout.write(f"wrote {out}\n")
    return 0


def _sheet(out: Path, size_px: int, samples: int) -> int:
    if out.suffix not in (".jpg", ".png") or not out.resolve().parent.is_dir():
        sys.stderr.write(f"error: {out}: expected a .jpg or .png file in a folder that exists\n")
        return 2
    from blender_scenes.sheet import contact_sheet

    contact_sheet(list(scenes().values()), out, size_px, samples)
    sys.stdout.write(f"wrote {out}\n")
    return 0


def _recording(args: argparse.Namespace) -> int:
    from rfgs_core.errors import RfgsError

    problem = ""
    if not args.recording.is_file():
        problem = f"{args.recording}: no such file; expected a .bvh file or a clip"
    elif not 1 <= args.fps <= 240:
        problem = f"--fps {args.fps}: expected 1 to 240 frames per second"
    elif not 1 <= args.repeat <= 100:
        problem = f"--repeat {args.repeat}: expected 1 to 100 times"
    if problem:
        sys.stderr.write(f"error: {problem}\n")
        return 2

    def work(out: Path) -> None:
        from blender_scenes.recording import build

        frames = build(args.recording, out, args.person, args.fps, args.up, args.repeat)
        sys.stdout.write(f"{frames} frames of {args.person}; next: rfgs-factory check {out}\n")

    try:
        return _write(work, args.out)
    except (RfgsError, ValueError) as error:
        sys.stderr.write(f"error: {error}\n")
        return 2


def _world(settings: Path, index: int, out: Path) -> int:
    from rfgs_core.errors import RfgsError

    def work(path: Path) -> None:
        from blender_scenes.random_world import build

        build(settings, index, path)

    try:
        if index < 0:
            raise RfgsError(f"--index {index}: expected 0 or more")
        return _write(work, out)
    except RfgsError as error:
        sys.stderr.write(f"error: {error}\n")
        return 2


def _bodies(out: Path | None) -> int:
    from blender_scenes.people.shape_space import write_shape_space
    from rfgs_core.articulated.space import SHAPE_SPACE

    return _write(lambda path: sys.stdout.write(f"{write_shape_space(path)}\n"), out or SHAPE_SPACE)


def _build(scene: Scene, out: Path | None) -> int:
    def work(path: Path) -> None:
        from blender_scenes.assemble import build_scene

        build_scene(scene, path)

    return _write(work, out or scene.path)


def _write(build: Callable[[Path], object], out: Path) -> int:
    """Has a builder write a file; what it needs may be missing."""
    if not out.resolve().parent.is_dir():
        sys.stderr.write(f"error: {out.parent}: no such folder; make it first\n")
        return 2
    try:
        build(out)
    except ModuleNotFoundError as error:
        if error.name not in ("anny", "bpy", "torch"):
            raise
        sys.stderr.write(
            f"error: {error.name} is missing; install it: pip install -e '.[scenes]'\n"
        )
        return 2
    sys.stdout.write(f"wrote {out} ({out.stat().st_size / 1e6:.2f} MB)\n")
    return 0


if __name__ == "__main__":
    code = main()
    sys.stdout.flush()
    sys.stderr.flush()
    # bpy may wait for ever on its own threads when the interpreter takes it down.
    os._exit(code)
