# SPDX-License-Identifier: Apache-2.0
"""COCO: people with masks, boxes and keypoints, one annotation per person and picture.

Format: https://cocodataset.org/#format-data. Keypoints are the 17 joints of the dataset under their
own names, which are not COCO's own 17 (those have eyes and ears): the category names them.
Visibility: 0 outside the picture, 2 where the picture shows that person at the joint, 1 where
something else stands before it. Masks are uncompressed run lengths.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from dataset_factory.convert.pictures import copy_picture, pictures
from rfgs_core.dataset import Sequence
from rfgs_core.files import write_json
from rfgs_core.render.cameras import Camera
from rfgs_core.skeleton import JOINTS, PARENTS


def write(sequence: Sequence, out: Path) -> None:
    """Writes `train.json` and `test.json` beside the pictures."""
    split: dict[str, dict[str, list[Any]]] = {
        name: {"images": [], "annotations": []} for name in ("train", "test")
    }
    for number, (row, frame, held_out) in enumerate(pictures(sequence), start=1):
        file = f"{row['name']}_{frame:06d}.png"
        copy_picture(sequence, row["name"], frame, out / "images" / file)
        part = split["test" if held_out else "train"]
        size = {"width": row["width"], "height": row["height"]}
        part["images"].append({"id": number, "file_name": f"images/{file}", **size})
        for found in _people(sequence, row, frame):
            identity = sum(len(each["annotations"]) for each in split.values()) + 1
            part["annotations"].append({"id": identity, "image_id": number, **found})
    # COCO counts joints from one.
    bones = [[parent + 1, joint + 1] for joint, parent in enumerate(PARENTS) if parent >= 0]
    category = {"id": 1, "name": "person", "keypoints": list(JOINTS), "skeleton": bones}
    for name, part in split.items():
        write_json(out / f"{name}.json", {**part, "categories": [category]})


def _people(sequence: Sequence, row: dict[str, Any], frame: int) -> list[dict[str, Any]]:
    """Annotations of the people that a picture shows some of."""
    camera, mask = Camera.from_dict(row), sequence.mask(row["name"], frame)
    found = []
    for joints, person in zip(sequence.joints(frame), sequence.people(frame), strict=True):
        own = mask == person
        if not own.any():
            continue
        rows, columns = np.nonzero(own)
        low, high = (columns.min(), rows.min()), (columns.max() + 1, rows.max() + 1)
        points = _keypoints(camera, joints, own)
        found.append(
            {
                "category_id": 1,
                "iscrowd": 0,
                "instance": int(person),
                "bbox": [int(low[0]), int(low[1]), int(high[0] - low[0]), int(high[1] - low[1])],
                "area": int(own.sum()),
                "segmentation": {"size": list(own.shape), "counts": run_lengths(own)},
                "keypoints": points,
                "num_keypoints": sum(seen > 0 for seen in points[2::3]),
            }
        )
    return found


def _keypoints(
    camera: Camera, joints: Float[np.ndarray, "17 3"], own: Bool[np.ndarray, "h w"]
) -> list[float]:
    """Column, row and visibility of each joint, one after the other."""
    pixel, ahead_m = camera.project(joints)
    inside = (ahead_m > 0) & (pixel >= 0).all(axis=1)
    inside &= (pixel < [camera.width, camera.height]).all(axis=1)
    values: list[float] = []
    for (column, line), there in zip(pixel, inside, strict=True):
        if not there:
            values += [0.0, 0.0, 0]
            continue
        seen = own[int(line), int(column)]
        values += [round(float(column), 2), round(float(line), 2), 2 if seen else 1]
    return values


def run_lengths(mask: Bool[np.ndarray, "h w"]) -> list[int]:
    """Lengths of runs down the columns, pixels outside first, as COCO writes them."""
    flat = np.concatenate([[False], mask.ravel(order="F"), [False]])
    changes = np.flatnonzero(flat[1:] != flat[:-1])
    ends = [*changes.tolist(), mask.size]
    lengths = np.diff([0, *ends]).tolist()
    # A last run of nothing is left out: the mask ended with its last pixel.
    return lengths[:-1] if lengths[-1] == 0 else lengths
