# SPDX-License-Identifier: Apache-2.0
"""Writes datasets: the parts in any order, the manifest and `dataset.json` last."""

from __future__ import annotations

import hashlib
import io
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float32, UInt8, UInt16

from rfgs_core.dataset.names import SequenceFiles
from rfgs_core.dataset.pictures import write_exr, write_png
from rfgs_core.dataset.schema import DatasetInfo, SequenceInfo, info_json
from rfgs_core.files import json_text, sha256, write_bytes, write_json, write_text

#: Folders of a dataset that hold wall times and half-made work, no data.
UNLISTED = ("log", ".work")

MANIFEST = "MANIFEST.sha256"


def write_arrays(path: Path, **arrays: np.ndarray) -> None:
    """Writes a compressed `.npz` in one step; equal arrays give equal bytes."""
    stream = io.BytesIO()
    np.savez_compressed(stream, **arrays)
    write_bytes(path, stream.getvalue())


def write_sequence_info(files: SequenceFiles, info: SequenceInfo) -> None:
    """Writes `sequence.json`."""
    write_json(files.info, info_json(info))


def write_picture(
    files: SequenceFiles,
    camera: str,
    frame: int,
    *,
    image: UInt8[np.ndarray, "h w 4"],
    depth: Float32[np.ndarray, "h w"],
    normal: Float32[np.ndarray, "h w 3"],
    mask: UInt16[np.ndarray, "h w"],
) -> None:
    """Writes what one camera saw at one frame.

    Normals are stored as half floats (3e-4 of their length), everything else exactly.
    """
    write_png(files.image(camera, frame), image)
    write_exr(files.depth(camera, frame), {"Z": depth})
    half = normal.astype(np.float16)
    write_exr(files.normal(camera, frame), {axis: half[..., k] for k, axis in enumerate("XYZ")})
    write_png(files.mask(camera, frame), mask)


def write_transforms(files: SequenceFiles, info: SequenceInfo) -> None:
    """Writes cameras and pictures in the nerfstudio convention, split into train and test.

    A picture belongs to the test split if its camera or its frame is held out.
    """
    last = max(info.frames[-1] - info.frames[0], 1)
    for split in ("train", "test"):
        rows = []
        for camera in info.cameras:
            for frame in info.frames:
                held_out = (
                    camera["split"] == "test" or frame in info.splits["images"]["test_frames"]
                )
                if held_out == (split == "test"):
                    time = (frame - info.frames[0]) / last
                    rows.append(_transform(files, camera, frame, time))
        write_json(files.transforms(split), {"camera_model": "OPENCV", "frames": rows})


def finish_dataset(path: Path, info: DatasetInfo) -> None:
    """Writes the manifest over all files, then `dataset.json`, which makes the dataset whole."""
    lines = [f"{sha256(path / name)}  {name}\n" for name in listed_files(path)]
    text = "".join(lines)
    write_text(path / MANIFEST, text)
    manifest = hashlib.sha256(text.encode("utf-8")).hexdigest()
    write_dataset_info(path, replace(info, manifest_sha256=manifest))


def write_dataset_info(path: Path, info: DatasetInfo) -> None:
    """Writes `dataset.json`."""
    write_text(path / "dataset.json", info_text(info))


def info_text(info: DatasetInfo) -> str:
    """What `dataset.json` holds, with the digest of its own content."""
    value = info_json(info)
    return json_text({**value, "sha256": own_digest(value)})


def own_digest(value: dict[str, Any]) -> str:
    """Digest of a JSON object without its own field `sha256`."""
    content = {key: item for key, item in value.items() if key != "sha256"}
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode("utf-8")).hexdigest()


def listed_files(path: Path) -> list[str]:
    """Every file the manifest covers, relative to the dataset, sorted."""
    names = (
        file.relative_to(path) for file in path.rglob("*") if file.is_file() or file.is_symlink()
    )
    return sorted(
        name.as_posix()
        for name in names
        if name.parts[0] not in UNLISTED and name.as_posix() not in (MANIFEST, "dataset.json")
    )


def _transform(
    files: SequenceFiles, camera: dict[str, Any], frame: int, time: float
) -> dict[str, Any]:
    def relative(path: Path) -> str:
        return path.relative_to(files.root).as_posix()

    return {
        "file_path": relative(files.image(camera["name"], frame)),
        "depth_file_path": relative(files.depth(camera["name"], frame)),
        "mask_path": relative(files.mask(camera["name"], frame)),
        "transform_matrix": camera["world_from_camera"],
        "time": time,
        "w": camera["width"],
        "h": camera["height"],
        **{key: camera[key] for key in ("fl_x", "fl_y", "cx", "cy")},
    }
