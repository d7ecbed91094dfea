# SPDX-License-Identifier: GPL-3.0-or-later
"""The command `import`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, TextIO

import bpy

from .clouds import Display
from .import_run import Picture, import_run


def add_import(commands: Any) -> None:
    """Adds `import` to the commands."""
    load = commands.add_parser("import", help="bring Gaussians back beside the scene")
    load.add_argument("path", type=Path, help="a run, its gaussians folder or one PLY")
    load.add_argument("--out", type=Path, help=".blend to save")
    load.add_argument("--picture", type=Path, help="PNG to render")
    load.add_argument("--camera", help="camera object for the picture (default: a chosen view)")
    load.add_argument("--resolution", type=int, default=480, help="longer side of each half (480)")
    load.add_argument("--samples", type=int, default=16, help="samples per pixel (16)")
    load.add_argument("--mode", choices=("points", "ellipsoids"), default="points")
    load.add_argument("--opacity-threshold", type=float, default=0.005)
    load.set_defaults(run=_import)


def _import(options: argparse.Namespace, out: TextIO) -> str:
    return import_run(
        bpy.context.scene,
        options.path,
        Display(options.mode, options.opacity_threshold),
        blend=options.out,
        picture=Picture(options.picture, options.camera, options.resolution, options.samples)
        if options.picture
        else None,
    )
