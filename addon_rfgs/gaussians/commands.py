# SPDX-License-Identifier: GPL-3.0-or-later
"""The commands `import` and `export-gaussians`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, TextIO

import bpy
import numpy as np

from ..errors import AddonError
from ..naming import closest
from ..scene.frames import unit_scale
from .clouds import clouds_of
from .export_ply import export_gaussians
from .import_run import Picture, import_run
from .nodes import NO_POWER_DB
from .settings import COLOR_MODES, INTERPOLATIONS
from .view_operators import crop_to


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
    load.add_argument("--opacity-threshold", type=_share, default=0.005, help="hide below (0.005)")
    load.add_argument(
        "--power-threshold", type=float, default=NO_POWER_DB, metavar="DB", help="hide weaker ones"
    )
    load.add_argument("--crop-box", metavar="EMPTY", help="hide what is outside this Empty's cube")
    load.add_argument(
        "--crop",
        type=float,
        nargs=6,
        metavar=("X0", "Y0", "Z0", "X1", "Y1", "Z1"),
        help="hide what is outside this box [m]",
    )
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
    load.add_argument(
        "--compare",
        action="store_true",
        help="colour by distance to what moves, all frames; tells mean and median",
    )
    load.set_defaults(run=_import)


def add_export_gaussians(commands: Any) -> None:
    """Adds `export-gaussians` to the commands."""
    save = commands.add_parser(
        "export-gaussians",
        help="write imported Gaussians back as a PLY",
        description="Writes clouds of the file as one binary 3DGS PLY. Points deleted or moved in "
        "edit mode and the object's transform are taken over; every other property of the PLY "
        "that was imported, spherical harmonics and unknown ones too, is written bit for bit.",
    )
    save.add_argument("out", type=Path, help="PLY to write")
    save.add_argument("--frame", type=int, help="clouds seen at this frame (default: the file's)")
    save.add_argument(
        "--object", action="append", metavar="NAME", help="this cloud alone; repeatable"
    )
    save.set_defaults(run=_export_gaussians)


def _share(text: str) -> float:
    value = float(text)
    if not 0 <= value <= 1:
        raise ValueError
    return value


def _names(items: list[tuple[str, str, str, int]]) -> list[str]:
    return [item[0].lower() for item in items]


def _import(options: argparse.Namespace, out: TextIO) -> str:
    # Kept in the file, so that its panel says what is shown.
    settings = bpy.context.scene.rfgs.gaussians
    settings.path = str(options.path.resolve())
    settings.display_mode, settings.size = options.mode, options.size
    settings.opacity_threshold = options.opacity_threshold
    settings.power_threshold_db = options.power_threshold
    settings.solid_view = options.solid_view
    settings.crop_box = _empty(options.crop_box)
    settings.use_crop = options.crop_box is not None
    if options.crop:
        low, high = np.array(options.crop).reshape(2, 3) / unit_scale(bpy.context.scene)
        if not (np.isfinite([low, high]).all() and (low < high).all()):
            raise AddonError("--crop: expected numbers with X0 < X1, Y0 < Y1 and Z0 < Z1")
        crop_to(bpy.context.scene, low, high)
    settings.color_by, settings.color_attribute = options.color_by.upper(), options.attribute
    settings.use_range = options.range is not None
    if options.range:
        settings.range_low, settings.range_high = options.range
    settings.frame_offset = options.frame_offset
    settings.interpolation = options.interpolation.upper()
    return import_run(
        bpy.context.scene,
        options.path,
        settings.inspection(),
        blend=options.out,
        picture=Picture(options.picture, options.camera, options.resolution, options.samples)
        if options.picture
        else None,
        compare=options.compare,
    )


def _export_gaussians(options: argparse.Namespace, out: TextIO) -> str:
    scene = bpy.context.scene
    clouds = clouds_of(scene)
    if options.frame is not None:
        scene.frame_set(options.frame)
    if options.object:
        known = {item.name: item for item in clouds}
        for name in options.object:
            if name not in known:
                raise AddonError(f"--object: no cloud {name!r}{closest(name, known)}")
        chosen = [known[name] for name in options.object]
    else:
        chosen = [item for item in clouds if not item.hide_viewport]
    return f"wrote {options.out}: {export_gaussians(scene, chosen, options.out)} Gaussians"


def _empty(name: str | None) -> bpy.types.Object | None:
    if name is None:
        return None
    item = bpy.context.scene.objects.get(name)
    if item is None or item.type != "EMPTY":
        raise AddonError(f"--crop-box: expected the name of an Empty of the scene, got {name!r}")
    return item
