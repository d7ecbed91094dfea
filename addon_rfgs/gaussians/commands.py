# SPDX-License-Identifier: GPL-3.0-or-later
"""What the command `import` does beside the button: a picture, a box of numbers, a comparison."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ..errors import AddonError
from ..scene.frames import unit_scale
from .import_run import Picture, import_run
from .view_operators import crop_to


def add_import(parser: Any) -> None:
    """Options of `import` beside the settings of the panels."""
    parser.add_argument("--out", type=Path, help=".blend to save")
    parser.add_argument("--picture", type=Path, help="PNG to render")
    parser.add_argument(
        "--frame",
        type=int,
        help="frame of the picture, at which the .blend opens too (default: in the middle)",
    )
    parser.add_argument("--camera", help="camera object for the picture (default: a chosen view)")
    parser.add_argument(
        "--resolution", type=int, default=480, help="longer side of each half (480)"
    )
    parser.add_argument("--samples", type=int, default=16, help="samples per pixel (16)")
    parser.add_argument(
        "--crop",
        type=float,
        nargs=6,
        metavar=("X0", "Y0", "Z0", "X1", "Y1", "Z1"),
        help="hide what is outside this box [m]",
    )
    parser.add_argument(
        "--compare",
        action="store_true",
        help="colour by distance to what moves, all frames; tells mean and median",
    )


def import_(options: argparse.Namespace) -> str:
    """Imports with the settings, which the file keeps: its panel says what is shown."""
    scene = bpy.context.scene
    settings = scene.rfgs.gaussians
    if options.crop_box and settings.crop_box.type != "EMPTY":
        raise AddonError(f"--crop-box: expected an Empty, got {options.crop_box!r}")
    if options.crop:
        low, high = np.array(options.crop).reshape(2, 3) / unit_scale(scene)
        if not (np.isfinite([low, high]).all() and (low < high).all()):
            raise AddonError("--crop: expected numbers with X0 < X1, Y0 < Y1 and Z0 < Z1")
        crop_to(scene, low, high)
    picture = Picture(options.picture, options.camera, options.resolution, options.samples)
    return import_run(
        scene,
        Path(options.path),
        settings.inspection(),
        blend=options.out,
        picture=picture if options.picture else None,
        frame=options.frame,
        compare=options.compare,
    )
