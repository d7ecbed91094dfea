# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line, the same for `blender --command rfgs` and `python -m addon_rfgs`."""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NoReturn, TextIO

import bpy

from . import bundle, groundtruth, imports, scene_check
from .errors import AddonError
from .files import write_json
from .override_file import read_overrides

#: Exit code of every mistake a user can repair.
USER_ERROR = 2


class _Parser(argparse.ArgumentParser):
    """Reports mistakes like every other error: one line."""

    def error(self, message: str) -> NoReturn:
        raise AddonError(f"{message} (see: {self.prog} --help)")


def parser(program: str) -> argparse.ArgumentParser:
    """The parser of all commands."""
    main = _Parser(prog=program, description="RF-GS inside Blender")
    commands = main.add_subparsers(dest="command", required=True, metavar="COMMAND")
    export = commands.add_parser("export", help="write the scene as a bundle")
    export.add_argument("--out", type=Path, required=True, help="folder of the bundle")
    export.add_argument(
        "--span",
        type=float,
        action="append",
        metavar="SECONDS",
        help="also write poses over so long after each frame (0: until the next); repeatable",
    )
    export.add_argument("--velocities", action="store_true", help="also that of every vertex")
    truth = commands.add_parser("groundtruth", help="render pictures and passes with Cycles")
    truth.add_argument("--out", type=Path, required=True, help="folder of the pictures")
    check = commands.add_parser("check", help="say what the scene holds and what is guessed")
    check.add_argument("--out", type=Path, required=True, help="JSON file of the report")
    for command in (export, truth, check):
        command.add_argument("--frames", metavar="A:B[:STEP]", help="default: the scene's range")
        command.add_argument("--overrides", type=Path, metavar="FILE", help="JSON, see the docs")
    for command in (export, truth):
        command.add_argument("--cameras", type=int, metavar="N", help="the first N by name")
        command.add_argument("--resolution", type=int, metavar="PX", help="longer side")
    truth.add_argument("--samples", type=int, default=16, help="samples per pixel (16)")
    truth.add_argument("--empty", action="store_true", help="hide all that moves; once per camera")
    truth.add_argument("--passes", action="store_true", help="depth, normals and ids as EXR")
    load = commands.add_parser("import", help="bring Gaussians back beside the scene")
    load.add_argument("path", type=Path, help="a run, its gaussians folder or one PLY")
    load.add_argument("--out", type=Path, help=".blend to save")
    load.add_argument("--picture", type=Path, help="PNG to render")
    load.add_argument("--camera", help="camera object for the picture (default: a chosen view)")
    load.add_argument("--resolution", type=int, default=480, help="longer side of each half (480)")
    load.add_argument("--samples", type=int, default=16, help="samples per pixel (16)")
    load.add_argument("--mode", choices=("points", "ellipsoids"), default="points")
    load.add_argument("--opacity-threshold", type=float, default=0.005)
    return main


def run(arguments: Sequence[str], program: str = "rfgs", blend: Path | None = None) -> int:
    """Runs one command; returns its exit code.

    Args:
        arguments: What stands after the program's name.
        program: Name for messages.
        blend: File to open first; None takes the one that is open.
    """
    with _quiet() as out:
        try:
            options = parser(program).parse_args(arguments)
            if blend is not None:
                open_blend(blend)
            out.write(_COMMANDS[options.command](options, out) + "\n")
            code = 0
        except AddonError as error:
            message, code = f"error: {error}\n", USER_ERROR
        except SystemExit as request:  # argparse after --help
            return int(request.code or 0)
    if code:
        sys.stderr.write(message)
        sys.stderr.flush()
    return code


def open_blend(path: Path) -> None:
    """Opens a file; scripts inside it never run.

    Raises:
        AddonError: The file does not exist or is not a .blend.
    """
    if not path.is_file():
        raise AddonError(f"{path}: no such .blend file")
    try:
        bpy.ops.wm.open_mainfile(filepath=str(path.resolve()), use_scripts=False, load_ui=False)
    except RuntimeError as error:
        raise AddonError(f"{path}: not a .blend file that Blender can read") from error


def _export(options: argparse.Namespace, out: TextIO) -> str:
    info = bundle.export_bundle(
        bpy.context.scene,
        options.out,
        options.frames,
        options.cameras,
        options.resolution,
        _progress(out),
        options.span,
        read_overrides(options.overrides),
        options.velocities,
    )
    return (
        f"wrote {options.out}: {len(info['frames'])} frames, {len(info['objects'])} objects, "
        f"{len(info['instances'])} instances, {len(info['devices'])} devices, "
        f"{len(info['cameras'])} cameras"
    )


def _groundtruth(options: argparse.Namespace, out: TextIO) -> str:
    count = groundtruth.render_groundtruth(
        bpy.context.scene,
        options.out,
        options.frames,
        options.cameras,
        options.resolution,
        options.samples,
        options.passes,
        options.empty,
        _progress(out),
        read_overrides(options.overrides),
    )
    return f"wrote {options.out}: {count} pictures"


def _check(options: argparse.Namespace, out: TextIO) -> str:
    overrides = read_overrides(options.overrides)
    report = scene_check.check_scene(bpy.context.scene, options.frames, overrides)
    write_json(options.out, report)
    return f"wrote {options.out}: {len(report['findings'])} findings"


def _import(options: argparse.Namespace, out: TextIO) -> str:
    return imports.import_command(
        bpy.context.scene,
        options.path,
        imports.Display(options.mode, options.opacity_threshold),
        blend=options.out,
        picture=imports.Picture(
            options.picture, options.camera, options.resolution, options.samples
        )
        if options.picture
        else None,
    )


_COMMANDS: dict[str, Callable[[argparse.Namespace, TextIO], str]] = {
    "check": _check,
    "export": _export,
    "groundtruth": _groundtruth,
    "import": _import,
}


def _progress(out: TextIO) -> Callable[[int, int], None]:
    def report(done: int, total: int) -> None:
        out.write(f"progress {done} {total}\n")
        out.flush()

    return report


@contextmanager
def _quiet() -> Iterator[TextIO]:
    """Keeps Blender's own chatter off the terminal; yields a stream that still reaches stdout.

    Blender prints from C, so the descriptors themselves are turned away. Should the block fail
    in an unforeseen way, the end of what was said goes to stderr.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    saved = os.dup(1), os.dup(2)
    with tempfile.TemporaryFile() as log, os.fdopen(os.dup(1), "w") as out:
        os.dup2(log.fileno(), 1)
        os.dup2(log.fileno(), 2)
        failed = True
        try:
            yield out
            failed = False
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os.dup2(saved[0], 1)
            os.dup2(saved[1], 2)
            for descriptor in saved:
                os.close(descriptor)
            if failed:
                log.seek(max(0, log.seek(0, os.SEEK_END) - 4000))
                sys.stderr.write(log.read().decode("utf-8", "replace"))
