# SPDX-License-Identifier: Apache-2.0
"""A scene bundle: what Blender hands to the factory."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mutations
import numpy as np
from bundle_files import describe_bundle
from formats import Format

from dataset_factory.scene.bundle import read_bundle
from dataset_factory.scene.report_rows import read_guesses
from rfgs_core.dataset.writer import write_arrays
from rfgs_core.files import write_json


def make_bundle(folder: Path) -> list[Format]:
    """A bundle of one triangle that moves, and nothing else."""
    folder.mkdir()
    eye = np.eye(4).tolist()
    camera = {"name": "cam00", "width": 8, "height": 8, "world_from_camera": eye}
    camera |= dict.fromkeys(("fl_x", "fl_y", "cx", "cy"), 4.0)
    pose = {"position_m": [0.0, 0.0, 1.0], "quat_wxyz": [1.0, 0.0, 0.0, 0.0]}
    about = {
        "schema": "rfgs-bundle/2", "blend_name": "a", "blend_sha256": "0", "blender_version": "5",
        "fps": 10.0, "frame_start": 1, "frame_end": 1, "frames": [1],
        "bounds_m": [[0, 0, 0], [1, 1, 1]], "cameras": [camera],
        "devices": [{"name": "d", "radio": "wifi", "role": "ACCESS_POINT", **pose}],
        "materials": [
            {"name": "m", "radio_material": "wood", "thickness_m": 0.1,
             "scattering_coefficient": 0.0}
        ],
        "objects": [
            {"id": 0, "name": "o", "class": "person", "instance": 1, "moving": True, "files": []}
        ],
        "instances": [{"id": 1, "name": "p", "class": "person", "person": True}],
        "room": {"box_m": [[0, 0, 0], [1, 1, 1]], "stand_m": [0, 0, 0], "seen_m": [[0, 0, 1]]},
    }  # fmt: skip
    one = np.zeros(1, np.int32)
    write_arrays(
        folder / "topology.npz", faces=np.array([[0, 1, 2]], np.int32), material=one,
        instance=one + 1, segment=one, rest_vertices=np.eye(3, dtype=np.float32),
        edges=np.zeros((1, 3), np.int8),
    )  # fmt: skip
    (folder / "frames").mkdir()
    write_arrays(
        folder / "frames/000001.npz", vertices=np.eye(3, dtype=np.float32),
        joints=np.zeros((1, 17, 3), np.float32), action=np.array(["walk"]),
        segment_velocity=np.zeros((1, 17, 3), np.float32), person_instance=one + 1,
    )  # fmt: skip

    guess = {"object": "o", "what": "material", "value": "skin", "why": "armature"}
    write_json(folder / "guesses.json", [guess])
    describe_bundle(folder, about)

    def read() -> Any:
        bundle = read_bundle(folder)
        return [bundle, bundle.frame(bundle.frames[0]), read_guesses(bundle.file("guesses.json"))]

    files = {
        "bundle.json": (folder / "bundle.json", mutations.json_of),
        "bundle topology": (folder / "topology.npz", mutations.arrays_of),
        "bundle frame": (folder / "frames/000001.npz", mutations.arrays_of),
        "guesses": (folder / "guesses.json", mutations.json_of),
    }
    return [Format(name, file, mutate, read) for name, (file, mutate) in files.items()]
