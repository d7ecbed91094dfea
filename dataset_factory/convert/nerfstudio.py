# SPDX-License-Identifier: Apache-2.0
"""nerfstudio: `transforms.json` with pictures, depth in millimetres, masks and start points.

Format: https://docs.nerf.studio/quickstart/data_conventions.html. Masks are black where something
moves, which is what nerfstudio leaves out; `time` runs from 0 to 1 for methods that use it.
"""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from plyfile import PlyData, PlyElement

from dataset_factory.convert.pictures import copy_picture, pictures, relative_time, static_points
from rfgs_core.dataset import Sequence
from rfgs_core.dataset.pictures import write_png
from rfgs_core.files import write_bytes, write_json

#: A 16-bit depth picture holds millimetres, nerfstudio's default; 0 means unknown.
DEPTH_STEPS_PER_M = 1000.0


def write(sequence: Sequence, out: Path) -> None:
    """Writes the folder that `ns-train … --data OUT` reads."""
    frames, split = [], {"train": [], "test": []}
    for row, frame, held_out in pictures(sequence):
        name = f"{row['name']}_{frame:06d}.png"
        copy_picture(sequence, row["name"], frame, out / "images" / name)
        depth_mm = sequence.depth(row["name"], frame) * DEPTH_STEPS_PER_M
        known = np.isfinite(depth_mm) & (depth_mm < 65535.5)
        write_png(out / "depth" / name, np.where(known, np.rint(depth_mm), 0).astype(np.uint16))
        still = np.where(sequence.mask(row["name"], frame) == 0, 255, 0).astype(np.uint8)
        write_png(out / "masks" / name, still)
        split["test" if held_out else "train"].append(f"images/{name}")
        frames.append(
            {
                "file_path": f"images/{name}",
                "depth_file_path": f"depth/{name}",
                "mask_path": f"masks/{name}",
                "transform_matrix": row["world_from_camera"],
                "time": relative_time(sequence, frame),
                "w": row["width"],
                "h": row["height"],
                **{key: row[key] for key in ("fl_x", "fl_y", "cx", "cy")},
            }
        )
    _write_points(sequence, out / "points.ply")
    write_json(
        out / "transforms.json",
        {
            "camera_model": "OPENCV",
            "ply_file_path": "points.ply",
            "train_filenames": split["train"],
            "val_filenames": split["test"],
            "test_filenames": split["test"],
            "frames": frames,
        },
    )


def _write_points(sequence: Sequence, file: Path) -> None:
    points, colours = static_points(sequence)
    types = [(axis, "<f4") for axis in "xyz"] + [(c, "u1") for c in ("red", "green", "blue")]
    rows = np.zeros(len(points), types)
    for index, axis in enumerate("xyz"):
        rows[axis] = points[:, index]
    for index, colour in enumerate(("red", "green", "blue")):
        rows[colour] = colours[:, index]
    stream = io.BytesIO()
    PlyData([PlyElement.describe(rows, "vertex")], byte_order="<").write(stream)
    write_bytes(file, stream.getvalue())
