# SPDX-License-Identifier: Apache-2.0
"""D-NeRF: Blender's synthetic layout with a time per picture (Pumarola et al. 2021).

`transforms_{train,val,test}.json` hold one `camera_angle_x` for all pictures, camera-to-world
matrices with OpenGL axes, `time` from 0 to 1, and file names without their `.png`.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from dataset_factory.convert.pictures import copy_picture, pictures, relative_time
from rfgs_core.dataset import Sequence
from rfgs_core.errors import RfgsError
from rfgs_core.files import write_json


def write(sequence: Sequence, out: Path) -> None:
    """Writes the three splits; held-out pictures serve as validation and test alike.

    Cameras of different lenses become scenes of their own, each in a folder named after its
    first camera.
    """
    lenses: dict[tuple[float, ...], list[str]] = {}
    for row in sequence.cameras:
        lenses.setdefault(_lens(sequence, row), []).append(row["name"])
    for lens, names in lenses.items():
        folder = out if len(lenses) == 1 else out / names[0]
        folder.mkdir(exist_ok=True)
        width, _, focal = lens
        _write_scene(sequence, names, 2.0 * math.atan(width / (2.0 * focal)), folder)


def _write_scene(sequence: Sequence, cameras: list[str], angle: float, out: Path) -> None:
    frames: dict[str, list[dict[str, Any]]] = {"train": [], "test": []}
    for row, frame, held_out in pictures(sequence, cameras):
        split = "test" if held_out else "train"
        name = f"{row['name']}_{frame:06d}"
        copy_picture(sequence, row["name"], frame, out / split / f"{name}.png")
        frames[split].append(
            {
                "file_path": f"./{split}/{name}",
                "time": relative_time(sequence, frame),
                "transform_matrix": row["world_from_camera"],
            }
        )
    for name, split in (("train", "train"), ("val", "test"), ("test", "test")):
        value = {"camera_angle_x": angle, "frames": frames[split]}
        write_json(out / f"transforms_{name}.json", value)


def _lens(sequence: Sequence, row: dict[str, Any]) -> tuple[float, ...]:
    """Width, height and focal length [px]; the format has square pixels and centred lenses."""
    centre = (row["width"] / 2, row["height"] / 2)
    if not (
        math.isclose(row["fl_x"], row["fl_y"], rel_tol=1e-6)
        and math.dist(centre, (row["cx"], row["cy"])) < 1e-3
    ):
        raise RfgsError(
            f"{sequence.files.info}: camera {row['name']} is off-centre or has oblong pixels, "
            "which D-NeRF's format cannot say; use --to nerfstudio"
        )
    return row["width"], row["height"], round(row["fl_x"], 6)
