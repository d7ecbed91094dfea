# SPDX-License-Identifier: Apache-2.0
"""Public sets in miniature, laid out as they are published, of a body that walks on the spot."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from rfgs_core.articulated import people
from rfgs_core.people_sets import hupr, mmbody
from rfgs_core.skeleton import JOINTS
from rfgs_core.worlds.motion import random_motion

#: Where the person stands: x to the right of the radar, y ahead; the radar is 1 m above the floor.
PLACE_M = np.array([0.4, 2.6])
FLOOR_M = -1.0


def walker(frames: int, seed: int = 0) -> list[tuple[np.ndarray, np.ndarray]]:
    """Joints and points of the side that a radar at the origin sees, of some moments [m]."""
    rng = np.random.default_rng(seed)
    body = people().body(np.zeros(0))
    motion = random_motion(rng, body, "walk")
    found = []
    for at in np.linspace(0.0, motion.duration_s, frames):
        pose = motion.at(float(at))
        joints, skin = body.joints17(pose), body.skin(pose)
        shift = np.array([*(PLACE_M - joints[0, :2]), FLOOR_M])
        centres = (skin[body.faces].mean(axis=1)) + shift
        corners = skin[body.faces]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        seen = np.flatnonzero(np.sum(normals * centres, axis=1) < 0.0)
        area = np.linalg.norm(normals[seen], axis=1)
        points = centres[rng.choice(seen, 250, p=area / area.sum())]
        found.append((joints + shift, points))
    return found


def write_mmfi(
    folder: Path, frames: int = 8, up: float = 1.0
) -> list[tuple[np.ndarray, np.ndarray]]:
    """MM-Fi: points as (ahead, across, up), joints in a camera's axes with y down."""
    part = folder / "E01" / "S01" / "A13"
    (part / "mmwave").mkdir(parents=True)
    moments = walker(frames)
    truth = np.stack([joints for joints, _ in moments])
    np.save(part / "ground_truth.npy", np.stack([truth[..., 0], -truth[..., 2], truth[..., 1]], -1))
    for number, (_, points) in enumerate(moments, start=1):
        x, y, z = points.T
        rows = np.stack([y, -up * x, up * z, np.ones_like(x), np.zeros_like(x)], axis=-1)
        (part / "mmwave" / f"frame{number:03d}.bin").write_bytes(rows.astype("<f8").tobytes())
    return moments


def write_mmbody(folder: Path, frames: int = 4) -> list[tuple[np.ndarray, np.ndarray]]:
    """mmBody: points of six numbers, SMPL-X joints in an archive, a calibration that is code."""
    part = folder / "train" / "sequence_3"
    (part / "radar").mkdir(parents=True)
    (part / "mesh").mkdir()
    (part / "calib.txt").write_text("__import__('os').abort()\n")
    moments = walker(frames)
    for number, (joints, points) in enumerate(moments):
        rows = np.concatenate([points, np.full((len(points), 3), 7.0)], axis=1)
        np.save(part / "radar" / f"frame_{number}.npy", rows)
        smplx = np.zeros((127, 3))
        for name, row in mmbody._SMPLX.items():
            smplx[row] = joints[JOINTS.index(name)]
        arrays = {"joints": smplx, "pose": np.zeros(69), "vertices": np.zeros((10475, 3))}
        np.savez(part / "mesh" / f"frame_{number}.npz", **arrays)
    return moments


def write_hupr(folder: Path, frames: int = 3, together: bool = False) -> np.ndarray:
    """HuPR: one reflector in both cubes, a body in the pictures; returns where the reflector is."""
    number = hupr.TEST[1] if together else 5
    part = folder / f"single_{number}"
    for view in ("hori", "vert"):
        (part / view).mkdir(parents=True)
    r, a, e = 40, 26, 34
    blocks = []
    for frame, (joints, _) in enumerate(walker(frames)):
        for view, angle in (("hori", a), ("vert", e)):
            cube = np.zeros((16, 64, 64, 8), np.complex128)
            cube[5, r, angle, 3] = 2.0 + 1.0j
            cube[5, r + 1, angle, 3] = 1.0
            np.save(part / view / f"{frame:09d}.npy", cube)
        rows = [[0.0, 0.0]] * 14
        for name, row in hupr._ORDER.items():
            x, _, z = joints[JOINTS.index(name)]
            rows[row] = [128 + 100 * float(x), 128 - 100 * float(z)]
        blocks.append({"image": f"{frame:09d}.jpg", "joints": rows, "bbox": [0, 0, 1, 1]})
    if together:
        (folder / "hrnet_annot_test.json").write_text(json.dumps([[], blocks]))
    else:
        (part / "annot").mkdir()
        (part / "annot" / "hrnet_annot.json").write_text(json.dumps(blocks))
    distance_m = (94 - r) * hupr.RANGE_BIN_M
    sines = np.array([(31 - a) / 32, (31 - e) / 32])
    ahead = np.sqrt(1.0 - (sines**2).sum())
    return distance_m * np.array([sines[0], ahead, sines[1]])
