# SPDX-License-Identifier: GPL-3.0-or-later
"""The command `import`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, TextIO

import bpy

from ..errors import AddonError
from .clouds import Inspection
from .coloring import Coloring
from .display import Display
from .import_run import Picture, import_run
from .nodes import NO_POWER_DB
from .settings import COLOR_MODES, INTERPOLATIONS


def add_import(commands: Any) -> None:
    """Adds `import` to the commands."""
    load = commands.add_parser(
        "import",
        help="bring Gaussians back beside the scene",
        description="Brings the Gaussians of a run, a folder of 000001.ply and so on, or one 3DGS "
        "PLY (text or binary) into the file, keyed on its timeline; writes a .blend that needs no "
        "add-on to play, a picture beside the true scene, or both.",
    )
    load.add_argument("path", type=Path, help="a run, its gaussians folder or one PLY")
    load.add_argument("--out", type=Path, help=".blend to save")
    load.add_argument("--picture", type=Path, help="PNG to render")
    load.add_argument("--camera", help="camera object for the picture (default: a chosen view)")
    load.add_argument("--resolution", type=int, default=480, help="longer side of each half (480)")
    load.add_argument("--samples", type=int, default=16, help="samples per pixel (16)")
    load.add_argument("--mode", choices=("points", "ellipsoids"), default="points")
    load.add_argument("--size", type=float, default=1.0, help="factor on the size drawn (1)")
    load.add_argument("--opacity-threshold", type=float, default=0.005, help="hide below (0.005)")
    load.add_argument(
        "--power-threshold", type=float, default=NO_POWER_DB, metavar="DB", help="hide weaker ones"
    )
    load.add_argument("--crop-box", metavar="EMPTY", help="hide what is outside this Empty's cube")
    load.add_argument(
        "--solid-view", action="store_true", help="real meshes, coloured in the Solid view too"
    )
    load.add_argument(
        "--color-by", choices=_names(COLOR_MODES), default="auto", help="what colours say (auto)"
    )
    load.add_argument("--attribute", default="", metavar="NAME", help="for --color-by attribute")
    load.add_argument(
        "--range", type=float, nargs=2, metavar=("LOW", "HIGH"), help="ends of the colour ramp"
    )
    load.add_argument("--frame-offset", type=int, default=0, help="cloud f is at frame f + this")
    load.add_argument(
        "--interpolation",
        choices=_names(INTERPOLATIONS),
        default="hold",
        help="what is seen between recorded frames (hold)",
    )
    load.set_defaults(run=_import)


def _names(items: list[tuple[str, str, str, int]]) -> list[str]:
    return [item[0].lower() for item in items]


def _import(options: argparse.Namespace, out: TextIO) -> str:
    display = Display(
        options.mode,
        options.opacity_threshold,
        options.power_threshold,
        options.size,
        options.solid_view,
        _empty(options.crop_box),
    )
    limits = tuple(options.range) if options.range else None
    coloring = Coloring(options.color_by.upper(), limits, options.attribute)
    timing = options.frame_offset, options.interpolation.upper()
    return import_run(
        bpy.context.scene,
        options.path,
        Inspection(display, coloring, *timing),
        blend=options.out,
        picture=Picture(options.picture, options.camera, options.resolution, options.samples)
        if options.picture
        else None,
    )


def _empty(name: str | None) -> bpy.types.Object | None:
    if name is None:
        return None
    item = bpy.context.scene.objects.get(name)
    if item is None or item.type != "EMPTY":
        raise AddonError(f"--crop-box: expected the name of an Empty of the scene, got {name!r}")
    return item
