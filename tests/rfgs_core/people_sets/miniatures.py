# SPDX-License-Identifier: Apache-2.0
"""Public sets in miniature, laid out as they are published, of a body that walks on the spot."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from scipy.io import savemat

from rfgs_core.articulated import people
from rfgs_core.people_sets import hupr, m4human_frame, mmbody, rtpose
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
        for name, row in mmbody.SMPLX.items():
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


def write_rtpose(
    folder: Path, frames: int = 3, processed: bool = False
) -> list[tuple[np.ndarray, np.ndarray]]:
    """RT-Pose: a wall that stands still, louder than the points that move; joints by frame."""
    home = folder / ("sequences/7/radar/npy_DZYX_complex" if processed else "walk/DZYX_npy_f16")
    home.mkdir(parents=True)
    moments = walker(frames)
    labels = {}
    for number, (joints, points) in enumerate(moments):
        cube = np.zeros((6, *rtpose._CELLS), np.complex64 if processed else np.float16)
        cube[0, 16, 20:100, 160] = 50.0
        cube[1, 16, 20:100, 160] = 20.0
        right, ahead, up = points.T
        zyx = np.stack([up, -right, ahead], axis=-1)
        z, y, x = np.rint((zyx - rtpose._START_M) / rtpose._STEP_M).astype(int).T
        cube[3, z, y, x] = 2.0j if processed else 2.0
        np.save(home / f"{number + 30:06d}.npy", cube)
        pose = [[0.0] * 3] * 15
        for name, row in rtpose._ORDER.items():
            right, ahead, up = (float(value) for value in joints[JOINTS.index(name)])
            pose[row] = [ahead, -right, up]
        person = {"Radar_frameID": number + 30 if processed else f"{number + 30:06d}", "pose": pose}
        labels[f"{number:06d}"] = [person]
    # Two people, nobody, and a frame whose cube is missing are left out.
    labels |= {"8": [person, person], "9": [{**person, "pose": []}]}
    labels["10"] = [{**person, "Radar_frameID": "000999"}]
    (folder / "Test.json").write_text(json.dumps({"7": labels}))
    if not processed:
        (folder / "file_meta.txt").write_text("6,other\n7,walk\n")
    return moments


def write_m4human(
    folder: Path, frames: int = 3, person: int = 1, action: int = 36
) -> list[tuple[np.ndarray, np.ndarray]]:
    """M4Human: points in MATLAB files, joints in the axes of another room, two calibrations."""
    part = folder / f"p{person}" / "actions" / str(action)
    for path in (part / "mmwave", part / "rgb", folder / f"p{person}/parameters"):
        path.mkdir(parents=True)
    calibration = folder / f"p{person}" / "ins_ext"
    if person == 14:
        calibration = calibration / "action30-37"
    calibration.mkdir(parents=True)
    rng = np.random.default_rng(person)
    vicon, camera = (np.linalg.qr(rng.standard_normal((3, 3)))[0] for _ in range(2))
    vicon *= np.linalg.det(vicon)
    camera *= np.linalg.det(camera)
    shifts = rng.standard_normal((2, 3))
    rows = np.hstack([vicon, 1000.0 * shifts[0][:, None]])
    np.savetxt(calibration / "vicon_to_cam.txt", np.vstack([rows, [0, 0, 0, 1]]))
    np.savetxt(calibration / "radar2rgb_rotmatrix.txt", camera)
    np.savetxt(calibration / "radar2rgb_tvec.txt", shifts[1])
    moments, fits = walker(frames), []
    # A picture of its own takes a row of the joints, too.
    (part / "rgb" / "4.png").write_bytes(b"")
    for number, (joints, points) in enumerate(moments, start=5):
        high = [0.0, 0.0, m4human_frame.RADAR_M]
        values = np.hstack([points + high, np.full((len(points), 1), 3.0)])
        savemat(part / "mmwave" / f"{number}.mat", {"RawPoints": values})
        (part / "rgb" / f"{number}.png").write_bytes(b"")
        there = (joints + high) @ camera.T + shifts[1]
        smplx = np.zeros((55, 3))
        for name, row in mmbody.SMPLX.items():
            smplx[row] = (there[JOINTS.index(name)] - shifts[0]) @ vicon
        fits.append(smplx.tolist())
    fit = {"joints": [fits[0], *fits], "betas": [[0.0] * 16] * (frames + 1), "gender": "male"}
    (folder / f"p{person}/parameters/{action}.json").write_text(json.dumps(fit))
    return moments
