# SPDX-License-Identifier: GPL-3.0-or-later
"""The commands `export` and `groundtruth`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, TextIO

import bpy

from ..command_options import add_scene_options, progress_lines
from ..scene.override_file import read_overrides
from .bundle import export_bundle
from .groundtruth import render_groundtruth


def add_export(commands: Any) -> None:
    """Adds `export` and `groundtruth` to the commands."""
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
    export.set_defaults(run=_export)
    truth = commands.add_parser("groundtruth", help="render pictures and passes with Cycles")
    truth.add_argument("--out", type=Path, required=True, help="folder of the pictures")
    truth.set_defaults(run=_groundtruth)
    for command in (export, truth):
        add_scene_options(command)
        command.add_argument("--cameras", type=int, metavar="N", help="the first N by name")
        command.add_argument("--resolution", type=int, metavar="PX", help="longer side")
    truth.add_argument("--samples", type=int, default=16, help="samples per pixel (16)")
    truth.add_argument("--empty", action="store_true", help="hide all that moves; once per camera")
    truth.add_argument("--passes", action="store_true", help="depth, normals and ids as EXR")


def _export(options: argparse.Namespace, out: TextIO) -> str:
    info = export_bundle(
        bpy.context.scene,
        options.out,
        options.frames,
        options.cameras,
        options.resolution,
        progress_lines(out),
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
    count = render_groundtruth(
        bpy.context.scene,
        options.out,
        options.frames,
        options.cameras,
        options.resolution,
        options.samples,
        options.passes,
        options.empty,
        progress_lines(out),
        read_overrides(options.overrides),
    )
    return f"wrote {options.out}: {count} pictures"
