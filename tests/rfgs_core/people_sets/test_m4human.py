# SPDX-License-Identifier: Apache-2.0
"""M4Human's tensors and its LMDB files, which the library that its authors use wrote here."""

from __future__ import annotations

import random
from pathlib import Path

import lmdb
import msgpack
import numpy as np
import pytest
from miniatures import walker, write_m4human
from scipy.io import savemat

from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.people_sets.judge import open_people_set
from rfgs_core.people_sets.lmdb_file import LmdbFile
from rfgs_core.people_sets.m4human_frame import CELLS, RADAR_M
from rfgs_core.people_sets.mmbody import SMPLX
from rfgs_core.skeleton import JOINTS

#: The radar above the floor.
HIGH_M = np.array([0.0, 0.0, RADAR_M])
#: A cell of 5 cm, 5 cm and 10 cm: nothing is further from its middle [m].
_CELL_M = np.array([0.025, 0.025, 0.05])


def cells(points: np.ndarray) -> np.ndarray:
    """Cells of points, each once: 5 cm from -3 and 0.5 m on, 10 cm from the floor on."""
    above = points + np.array([3.0, -0.5, RADAR_M])
    return np.unique(np.rint(above / [0.05, 0.05, 0.1]).astype(int), axis=0)


def test_a_tensor_is_heard_before_points(tmp_path: Path) -> None:
    moments = write_m4human(tmp_path, frames=1)
    (_, points), file = moments[0], tmp_path / "p1/actions/36/mmwave/5.mat"
    cube = np.zeros(CELLS, np.float32)
    where = cells(points)
    cube[tuple(where.T)] = np.arange(1.0, len(where) + 1.0)
    cube[0, 0, 0] = np.nan
    savemat(file, {"rawImage_XYZ": cube, "RawPoints": np.ones((3, 4))})
    (frame,) = open_people_set(tmp_path).frames(1)
    assert len(frame.points) == len(where)
    # The strongest first, power as amplitude squared.
    np.testing.assert_allclose(frame.amplitude**2, np.arange(len(where), 0.0, -1.0))
    assert (np.abs(frame.points[:, None] - points) <= _CELL_M + 1e-9).all(axis=2).any(axis=1).all()
    savemat(file, {"rawImage_XYZ": cube[:, :, 1:]})
    with pytest.raises(RfgsFormatError, match=r"expected a tensor of \(121, 111, 31\)"):
        list(open_people_set(tmp_path).frames(1))


def packed(values: np.ndarray) -> bytes:
    """Rows as float32 behind their number of axes and shape."""
    return np.array([values.ndim, *values.shape], "<u4").tobytes() + values.astype("<f4").tobytes()


def told(**arrays: np.ndarray) -> bytes:
    """Arrays as MessagePack."""
    return msgpack.packb(
        {
            name: {
                "__nd__": True,
                "dtype": str(values.dtype),
                "shape": list(values.shape),
                "data": values.tobytes(),
            }
            for name, values in arrays.items()
        }
    )


def put(path: Path, values: dict[bytes, bytes]) -> None:
    """Writes a database in one file."""
    with (
        lmdb.open(str(path), map_size=1 << 27, subdir=False) as store,
        store.begin(write=True) as work,
    ):
        for key, value in values.items():
            work.put(key, value)


def write_lmdb(folder: Path, frames: int = 12) -> list[tuple[np.ndarray, np.ndarray]]:
    """The smaller form; the frames of one action in its axes and out of order."""
    home = folder / "MR-Mesh" / "rf3dpose_all"
    home.mkdir(parents=True)
    rng = np.random.default_rng(3)
    vicon, camera = (np.linalg.qr(rng.standard_normal((3, 3)))[0] for _ in range(2))
    shifts, moments = rng.standard_normal((2, 3)), walker(frames)
    calibration = told(
        cam_intrinsic=np.eye(3),
        vicon_to_cam_rotmatrix=vicon,
        vicon_to_cam_tvec=1000.0 * shifts[0],
        radar_to_cam_rotmatrix=camera,
        radar_to_cam_tvec=shifts[1],
    )
    stores: dict[str, dict[bytes, bytes]] = {
        name: {} for name in ("radar_comp", "radar_pc", "params", "calib")
    }
    for number, (joints, points) in enumerate(moments):
        key = str([1, 36, number]).encode()
        where = cells(points)
        stores["radar_comp"][key] = packed(np.hstack([where, np.full((len(where), 1), 4.0)]))
        high = points + HIGH_M
        stores["radar_pc"][key] = packed(np.hstack([high, np.ones((len(points), 1))]))
        there = (joints + HIGH_M) @ camera.T + shifts[1]
        smplx = np.zeros((55, 3))
        for name, row in SMPLX.items():
            smplx[row] = (there[JOINTS.index(name)] - shifts[0]) @ vicon
        stores["params"][key] = told(joints=smplx, betas=np.zeros(10))
        stores["calib"][key] = calibration
    # Nobody tells the pose of the first, and motion capture lost the second.
    del stores["params"][b"[1, 36, 0]"]
    stores["params"][b"[1, 36, 1]"] = told(joints=np.full((55, 3), np.nan))
    for name, values in stores.items():
        put(home / f"{name}.lmdb", values)
    return moments


@pytest.mark.parametrize("heard", ["tensors", "points"])
def test_lmdb_frames_are_those_that_were_stored(tmp_path: Path, heard: str) -> None:
    moments = write_lmdb(tmp_path)
    if heard == "points":
        (tmp_path / "MR-Mesh/rf3dpose_all/radar_comp.lmdb").unlink()
    public = open_people_set(tmp_path)
    assert (public.name, public.count) == ("M4Human", 12)
    frames = list(public.frames(1))
    # By number, not by the bytes of keys: 2 before 10.
    assert len(frames) == 10
    for frame, (joints, points) in zip(frames, moments[2:], strict=True):
        assert frame.joints is not None
        known = np.isfinite(frame.joints).all(axis=1)
        np.testing.assert_allclose(frame.joints[known], joints[known], atol=1e-9)
        if heard == "points":
            np.testing.assert_allclose(frame.points, points, atol=1e-6)
        else:
            apart = np.abs(frame.points[:, None] - points)
            assert (apart <= _CELL_M + 1e-9).all(axis=2).any(axis=1).all()
            np.testing.assert_allclose(frame.amplitude, 2.0)


@pytest.mark.parametrize(
    ("name", "value", "says"),
    [
        ("radar_comp", b"short", "expected rows of four float32"),
        ("radar_comp", packed(np.full((3, 4), 121.0)), "expected cells of a tensor"),
        ("radar_comp", packed(np.zeros((3, 5))), "expected rows of four float32"),
        ("params", b"\xc1", "expected an array joints"),
        ("params", told(joints=np.zeros((21, 3))), "expected 22 joints"),
        ("params", told(joints=np.zeros((55, 3), np.int64)), "expected an array joints"),
        ("calib", told(vicon_to_cam_rotmatrix=np.eye(4)), "expected an array vicon_to_cam"),
    ],
    ids=["short", "outside", "columns", "no_pack", "few_joints", "whole_numbers", "turn"],
)
def test_strange_values_are_one_line(tmp_path: Path, name: str, value: bytes, says: str) -> None:
    write_lmdb(tmp_path, frames=3)
    put(tmp_path / f"MR-Mesh/rf3dpose_all/{name}.lmdb", {b"[1, 36, 2]": value})
    with pytest.raises(RfgsFormatError, match=says) as caught:
        list(open_people_set(tmp_path).frames(1))
    assert "\n" not in str(caught.value)


def test_trees_of_any_size_hold_what_the_library_stored(tmp_path: Path) -> None:
    rng = random.Random(1)
    for count in (0, 1, 40, 1500):
        path, stored = tmp_path / f"{count}.lmdb", {}
        for number in range(count):
            stored[f"[{rng.randrange(20)}, 3, {number}]".encode()] = rng.randbytes(
                rng.choice([0, 3, 100, 1900, 2100, 5000, 9000])
            )
        put(path, stored)
        # Pages that were free again, and a second transaction.
        gone = list(stored)[::7]
        with lmdb.open(str(path), map_size=1 << 27, subdir=False) as store:
            for key in gone:
                with store.begin(write=True) as work:
                    work.delete(key)
                del stored[key]
        with LmdbFile(path) as file:
            assert list(file.keys()) == sorted(stored)
            assert all(file.get(key, 1 << 20) == value for key, value in stored.items())
            assert all(file.get(key, 1 << 20) is None for key in (*gone, b"", b"x" * 500))


def test_damaged_databases_are_one_line_or_whole_entries(tmp_path: Path) -> None:
    path, stored = tmp_path / "good.lmdb", {str([k]).encode(): bytes([k]) * 900 for k in range(90)}
    put(path, stored)
    good, rng, refused = path.read_bytes().rstrip(b"\0"), random.Random(2), 0
    for _ in range(600):
        data = bytearray(good)
        for _ in range(rng.choice([1, 3, 30])):
            # Headers of pages, where everything is told, more often than values.
            at = rng.randrange(len(data) // 4096) * 4096 + rng.randrange(160)
            data[at] = rng.randrange(256)
        path.write_bytes(data[: rng.randrange(len(data))] if rng.random() < 0.2 else data)
        try:
            with LmdbFile(path) as file:
                for key in file.keys():
                    value = file.get(key, 10_000)
                    assert value is None or len(value) <= 10_000
        except RfgsError as error:
            refused += 1
            assert "\n" not in str(error)
    assert refused > 100
    path.write_bytes(b"")
    with pytest.raises(RfgsFormatError, match="expected a whole file of LMDB"):
        LmdbFile(path)
    with pytest.raises(RfgsError, match="No such file"):
        LmdbFile(tmp_path / "nowhere")
