# SPDX-License-Identifier: Apache-2.0
"""`rfgs-factory check`."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass, field, replace
from pathlib import Path

import tyro

from dataset_factory.scene.overrides import SceneOptions


@dataclass(frozen=True)
class CheckArgs:
    """Says what a scene holds and what would be guessed; exit code 1 if it would be refused.

    Works on any Blender file. What is guessed wrongly can be said by options or in a YAML file:

        frames: 1:60:2                  # of these frames
        frame_range: 1:60               # in place of the file's own range
        fps: 30
        unit_scale: 0.01                # metres per Blender unit
        bounds_m: [[-3, -3, 0], [3, 3, 2.6]]
        drop: [Sky, "Tree*"]
        people: [Anna]
        vehicles: ["Car*"]
        moving: [Chair]                 # counts as moving although it keeps still
        materials: {"Paint*": plasterboard}            # by Blender material
        object_materials:                              # by object, goes first
          Wall: {radio_material: concrete, thickness_m: 0.2, scattering_coefficient: 0.1}
        cameras: {ring: 8, radius_m: 3, height_m: 1.6, fov_deg: 60}
        devices:                                       # in place of the file's own
          - {name: ap1, radio: wifi, position_m: [-2, 0, 1.2], look_at_m: [0, 0, 1]}
        room: {size_m: [6, 6, 2.6], material: concrete}   # or box, or none
    """

    scene: tyro.conf.Positional[str]
    """Name from `rfgs-factory scenes`, or path of a .blend file."""
    radio: tyro.conf.UseAppendAction[tuple[str, ...]] = ()
    """Radio to check materials and devices for; repeat the option for several. Default: `scene`
    where the file has Empties of that radio, else none."""
    packets_per_frame: int = 1
    """Channels per frame, as for `generate`: whether so many fit between two frames. The last
    frame, which `generate` leaves out then, is listed all the same."""
    frames: str = ""
    """Blender frames A:B[:STEP] (inclusive), or one number; default: all."""
    options: tyro.conf.OmitArgPrefixes[SceneOptions] = field(default_factory=SceneOptions)
    """What to make of the scene."""
    json: Path | None = None
    """Also write the report to this JSON file; - writes it to standard output instead."""
    blender: Path | None = None
    """A real Blender with the add-on enabled; default: $BLENDER, else pip's bpy."""


def run(args: CheckArgs) -> int:
    """Prints the table, or the report as JSON."""
    from dataset_factory.plan.contents import refuse_packets, whole_frames
    from dataset_factory.scene.blender import Blender
    from dataset_factory.scene.catalogue import find_scene
    from dataset_factory.scene.overrides import label, read_options
    from dataset_factory.scene.radios import chosen_radios
    from dataset_factory.scene.report import check_file, has_errors, table
    from rfgs_core.files import write_json

    refuse_packets(args.packets_per_frame)
    scene = find_scene(args.scene)
    said = read_options(args.options)
    frames = whole_frames(args.frames or str(said.pop("frames", "")))
    radios = list(chosen_radios(args.radio).values())
    if args.packets_per_frame != 1:
        radios = [replace(radio, samples_per_frame=args.packets_per_frame) for radio in radios]
    blender = Blender(scene.blend, args.blender)
    report = check_file(blender, frames, said, label(args.options), radios)
    if args.json is not None and str(args.json) == "-":
        sys.stdout.write(json.dumps(report, indent=1) + "\n")
    else:
        sys.stdout.write(table(report) + "\n")
        if args.json is not None:
            write_json(args.json, report)
    return int(has_errors(report))
