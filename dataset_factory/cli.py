# SPDX-License-Identifier: Apache-2.0
"""The `rfgs-factory` command: makes, checks and shows datasets."""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import tyro

from rfgs_core.errors import RfgsError, run_cli

_HELP = """usage: rfgs-factory COMMAND ...

Makes datasets of radio channels with matching pictures from animated Blender files.

commands:
  scenes    Lists the scenes that come with RF-GS.
  generate  Makes a dataset; run it again to continue where it stopped.
  validate  Checks every promise a dataset makes.
  preview   Draws pictures and channels of a dataset into one HTML page.

A first dataset, about two minutes on two cores:
  rfgs-factory generate living_room_walk --radio wifi --frames 10:30:10 --cameras 4 \\
      --resolution 128 --out my_dataset

`rfgs-factory COMMAND --help` explains a command.
"""


@dataclass(frozen=True)
class ScenesArgs:
    """Lists the scenes that come with RF-GS."""


@dataclass(frozen=True)
class GenerateArgs:
    """Makes a dataset from a Blender file with something that moves.

    The Blender file is never changed and none of its scripts runs. Stop at any moment; the same
    command continues and ends in the same bytes.
    """

    scene: tyro.conf.Positional[str]
    """Name from `rfgs-factory scenes`, or path of a .blend file."""
    radio: tyro.conf.UseAppendAction[tuple[str, ...]]
    """Radio to trace: wifi or mmwave; repeat the option for several."""
    out: Path
    """Folder of the dataset."""
    frames: str = ""
    """Blender frames A:B[:STEP] (inclusive), or one number; default: all."""
    cameras: int = 0
    """How many of the scene's cameras, in order of their names; 0 takes all."""
    resolution: int = 256
    """Longer side of the pictures [px]."""
    samples: int = 16
    """Light samples per pixel; more is less noisy and slower."""
    depth: int = 2
    """Interactions of a path that meets a person: 1 the person alone (fast), 2 also one wall."""
    seed: int = 0
    """Root seed; the same seed gives the same bytes."""
    workers: int = 2
    """Tracing processes; each keeps one core busy."""
    shadow: Literal["kirchhoff", "hard"] = "kirchhoff"
    """How bodies shadow paths: diffracted at the silhouette, or cut off sharply."""
    images: bool = True
    """Render pictures with Blender."""
    blender: Path | None = None
    """A real Blender with the add-on enabled; default: $BLENDER, else pip's bpy."""


@dataclass(frozen=True)
class ValidateArgs:
    """Checks a dataset: schema, checksums, counts, numbers and physics; exit code 1 for faults."""

    dataset: tyro.conf.Positional[Path]
    """Folder of the dataset."""


@dataclass(frozen=True)
class PreviewArgs:
    """Draws pictures and channels of a dataset as PNG files and one HTML page."""

    dataset: tyro.conf.Positional[Path]
    """Folder of the dataset."""
    out: Path | None = None
    """Folder of the preview; default: DATASET/log/preview, which checksums leave out."""
    sequence: str | None = None
    """Which sequence; needed only if there are several."""


def _scenes(_args: ScenesArgs) -> int:
    from dataset_factory.scenes import catalogue

    for scene in catalogue():
        sys.stdout.write(
            f"{scene.name:<20} frames {scene.frames} at {scene.fps:g} fps\n"
            f"{'':<20} {scene.description}\n{'':<20} {scene.blend}\n"
        )
    return 0


def _generate(args: GenerateArgs) -> int:
    from dataset_factory.blender import Blender
    from dataset_factory.generate import Job, generate
    from dataset_factory.plan import make_plan
    from dataset_factory.scenes import find_scene
    from rfgs_core.llvm import use_llvm

    if not 1 <= args.workers <= 256:
        raise RfgsError(f"--workers {args.workers}: expected 1 to 256")
    scene = find_scene(args.scene)
    plan = make_plan(
        scene,
        args.radio,
        args.frames,
        cameras=args.cameras,
        resolution=args.resolution,
        samples=args.samples,
        depth=args.depth,
        seed=args.seed,
        shadow=args.shadow,
        images=args.images,
    )
    use_llvm()
    made = generate(Job(args.out, plan, Blender(scene.blend, args.blender), args.workers))
    what = "finished" if made else "already complete"
    sys.stdout.write(f"{args.out}: {what}; look at it with: rfgs-factory preview {args.out}\n")
    return 0


def _validate(args: ValidateArgs) -> int:
    from dataset_factory.validate import validate

    faults = validate(args.dataset)
    for fault in faults:
        sys.stdout.write(f"fault: {fault}\n")
    verdict = f"{len(faults)} faults" if faults else "sound"
    sys.stdout.write(f"{args.dataset}: {verdict}\n")
    return int(bool(faults))


def _preview(args: PreviewArgs) -> int:
    from dataset_factory.preview import preview

    page = preview(args.dataset, args.out, args.sequence)
    sys.stdout.write(f"{page}\n")
    return 0


_COMMANDS: dict[str, tuple[type, Callable[[Any], int]]] = {
    "scenes": (ScenesArgs, _scenes),
    "generate": (GenerateArgs, _generate),
    "validate": (ValidateArgs, _validate),
    "preview": (PreviewArgs, _preview),
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `rfgs-factory`; returns the exit code."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    logging.basicConfig(format="%(message)s", level=logging.INFO, stream=sys.stderr)
    if not given or given[0] in ("-h", "--help"):
        sys.stdout.write(_HELP)
        return 0 if given else 2
    if given[0] not in _COMMANDS:
        sys.stderr.write(
            f"error: unknown command {given[0]!r}; expected one of {', '.join(_COMMANDS)}\n"
        )
        return 2
    kind, command = _COMMANDS[given[0]]
    args = tyro.cli(kind, args=given[1:], prog=f"rfgs-factory {given[0]}")
    return run_cli(lambda: command(args))
