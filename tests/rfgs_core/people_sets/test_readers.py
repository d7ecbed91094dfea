# SPDX-License-Identifier: Apache-2.0
"""Readers of public sets on miniatures, and on files that are damaged or would be unpickled."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from miniatures import write_hupr, write_m4human, write_mmbody, write_mmfi, write_rtpose
from scipy.io import savemat

from rfgs_core.arrays import load_array
from rfgs_core.errors import RfgsError
from rfgs_core.people_sets.judge import open_people_set
from rfgs_core.skeleton import JOINTS


@pytest.mark.parametrize("up", [1.0, -1.0])
def test_mmfi_is_turned_into_the_radars_axes(tmp_path: Path, up: float) -> None:
    moments = write_mmfi(tmp_path, frames=8, up=up)
    public = open_people_set(tmp_path)
    assert (public.name, public.count) == ("MM-Fi", 8)
    frames = list(public.frames(3))
    assert len(frames) == 3
    for number, frame in zip((0, 3, 6), frames, strict=True):
        assert frame.joints is not None
        np.testing.assert_allclose(frame.joints, moments[number][0], atol=1e-12)
        # Two frames before and after count as well, as far as there are any.
        near = moments[max(number - 2, 0) : number + 3]
        np.testing.assert_allclose(frame.points, np.concatenate([row[1] for row in near]))


def test_mmfi_joints_with_y_up_are_no_mirror_image(tmp_path: Path) -> None:
    moments = write_mmfi(tmp_path)
    truth = tmp_path / "E01/S01/A13/ground_truth.npy"
    values = np.load(truth)
    # A turn by half a circle around the line of sight.
    np.save(truth, values * [-1, -1, 1])
    (first, *_) = open_people_set(tmp_path).frames(1)
    assert first.joints is not None
    np.testing.assert_allclose(first.joints, moments[0][0], atol=1e-12)


def test_mmbody_runs_no_calibration(tmp_path: Path) -> None:
    moments = write_mmbody(tmp_path)
    public = open_people_set(tmp_path)
    assert (public.name, public.count) == ("mmBody", 4)
    for (joints, points), frame in zip(moments, public.frames(1), strict=True):
        np.testing.assert_array_equal(frame.points, points)
        assert frame.joints is not None
        known = np.isfinite(frame.joints).all(axis=1)
        # The middle of the skull is no joint of SMPL-X.
        assert [JOINTS[k] for k in np.flatnonzero(~known)] == ["head"]
        np.testing.assert_array_equal(frame.joints[known], joints[known])


@pytest.mark.parametrize("together", [False, True])
def test_hupr_cells_are_where_a_reflector_is(tmp_path: Path, together: bool) -> None:
    place = write_hupr(tmp_path, together=together)
    public = open_people_set(tmp_path)
    assert (public.name, public.count) == ("HuPR", 3)
    (first, *_) = public.frames(1)
    np.testing.assert_allclose(first.points[0], place)
    # |2 + j|² against 1, and one range bin nearer.
    np.testing.assert_allclose(first.amplitude, [np.sqrt(5.0), 1.0])
    assert len(first.points) == 2 and first.joints is None and first.pixels is not None
    assert np.linalg.norm(first.points[1]) == pytest.approx(np.linalg.norm(place) - 0.043)
    assert sorted(np.array(JOINTS)[np.isnan(first.pixels).any(axis=1)]) == [
        "neck",
        "pelvis",
        "spine",
    ]


@pytest.mark.parametrize("processed", [False, True])
def test_rtpose_cells_are_where_somebody_moves(tmp_path: Path, processed: bool) -> None:
    moments = write_rtpose(tmp_path, processed=processed)
    public = open_people_set(tmp_path)
    assert (public.name, public.count) == ("RT-Pose", 3)
    half_a_cell = np.array([20.1 / 128, 11.6 / 256, 11.6 / 32]) / 2 + 1e-9
    for (joints, points), frame in zip(moments, public.frames(1), strict=True):
        assert frame.joints is not None
        known = np.isfinite(frame.joints).all(axis=1)
        assert [JOINTS[k] for k in np.flatnonzero(~known)] == ["spine", "neck"]
        np.testing.assert_allclose(frame.joints[known], joints[known], atol=1e-12)
        # Every cell holds a point, every point lies in a cell, and nothing is left of the wall.
        away = np.abs(frame.points[:, None] - points)
        near = (away <= half_a_cell).all(axis=-1)
        assert near.any(axis=0).all() and near.any(axis=1).all()
        np.testing.assert_allclose(frame.amplitude, 2.0)


@pytest.mark.parametrize("person", [1, 14])
def test_m4human_joints_are_seen_from_the_radar(tmp_path: Path, person: int) -> None:
    moments = write_m4human(tmp_path, person=person)
    public = open_people_set(tmp_path)
    assert (public.name, public.count) == ("M4Human", 3)
    for (joints, points), frame in zip(moments, public.frames(1), strict=True):
        np.testing.assert_allclose(frame.points, points, atol=1e-9)
        assert frame.joints is not None
        known = np.isfinite(frame.joints).all(axis=1)
        assert [JOINTS[k] for k in np.flatnonzero(~known)] == ["head"]
        np.testing.assert_allclose(frame.joints[known], joints[known], atol=1e-9)


def test_m4human_counts_without_pictures(tmp_path: Path) -> None:
    moments = write_m4human(tmp_path)
    for picture in tmp_path.rglob("*.png"):
        picture.unlink()
    (first, *_) = open_people_set(tmp_path).frames(1)
    assert first.joints is not None
    # The row of the picture that is gone comes first.
    known = np.isfinite(first.joints).all(axis=1)
    np.testing.assert_allclose(first.joints[known], moments[0][0][known], atol=1e-9)


def test_m4human_calibrations_are_held_against_what_they_are(tmp_path: Path) -> None:
    write_m4human(tmp_path)
    turn = tmp_path / "p1/ins_ext/radar2rgb_rotmatrix.txt"
    for said in ("0 0 0\n0 0 0\n0 0 0\n", "1 2 x", "", "1 0 0 0 nan 0 0 0 1"):
        turn.write_text(said)
        with pytest.raises(RfgsError, match="expected"):
            list(open_people_set(tmp_path).frames(1))
    turn.unlink()
    with pytest.raises(RfgsError, match="no such file"):
        list(open_people_set(tmp_path).frames(1))


def test_rtpose_labels_lead_nowhere_else(tmp_path: Path) -> None:
    write_rtpose(tmp_path / "set", frames=1)
    (tmp_path / "set/walk").rename(tmp_path / "walk")
    (tmp_path / "set/file_meta.txt").write_text("7,../walk\n")
    with pytest.raises(RfgsError, match="expected MM-Fi"):
        open_people_set(tmp_path / "set")
    (tmp_path / "set/file_meta.txt").write_text("7;walk\n")
    with pytest.raises(RfgsError, match="expected lines of a sequence and its folder"):
        open_people_set(tmp_path / "set")
    (tmp_path / "walk").rename(tmp_path / "set/walk")
    (tmp_path / "set/file_meta.txt").write_text("7,walk\n")
    labels = tmp_path / "set/Test.json"
    rows = json.loads(labels.read_text())
    rows["7"]["000000"][0]["pose"] = [[0.0, 0.0, 0.0]] * 14
    labels.write_text(json.dumps(rows))
    with pytest.raises(RfgsError, match="expected 15 joints"):
        open_people_set(tmp_path / "set")
    labels.write_text("[]")
    with pytest.raises(RfgsError, match="expected an object"):
        open_people_set(tmp_path / "set")


class Pickled:
    """Ends the process if it is unpickled."""

    def __reduce__(self) -> Any:
        import os

        return os.abort, ()


def damaged(folder: Path, set_name: str) -> dict[str, Callable[[], object]]:
    """Ways to damage the first frame of a miniature."""
    truth = {
        "mmfi": folder / "E01/S01/A13/ground_truth.npy",
        "mmbody": folder / "train/sequence_3/radar/frame_0.npy",
        "hupr": folder / "single_5/vert/000000000.npy",
        "rtpose": folder / "walk/DZYX_npy_f16/000030.npy",
    }[set_name]
    axes = {"mmfi": 3, "mmbody": 2, "hupr": 4, "rtpose": 4}[set_name]
    pickled = np.array([Pickled()], dtype=object).reshape((1,) * axes)
    return {
        "pickled": lambda: np.save(truth, pickled, allow_pickle=True),
        "cut": lambda: truth.write_bytes(truth.read_bytes()[:200]),
        "empty": lambda: truth.write_bytes(b""),
        "garbage": lambda: truth.write_bytes(bytes(range(256)) * 8),
        "axes": lambda: np.save(truth, np.zeros(3)),
        "text": lambda: np.save(truth, np.full((2,) * axes, "x")),
        "shape": lambda: np.save(truth, np.zeros((2,) * axes)),
    }


@pytest.mark.parametrize("how", ["pickled", "cut", "empty", "garbage", "axes", "text", "shape"])
@pytest.mark.parametrize("name", ["mmfi", "mmbody", "hupr", "rtpose"])
def test_damage_is_one_line(tmp_path: Path, name: str, how: str) -> None:
    write = {"mmfi": write_mmfi, "mmbody": write_mmbody, "hupr": write_hupr, "rtpose": write_rtpose}
    write[name](tmp_path)
    damaged(tmp_path, name)[how]()
    with pytest.raises(RfgsError) as caught:
        list(open_people_set(tmp_path).frames(1))
    assert "\n" not in str(caught.value) and "expected" in str(caught.value)
    assert ("pickled" in str(caught.value)) == (how == "pickled")


@pytest.mark.parametrize("how", ["cut", "empty", "garbage", "shape", "name"])
def test_damaged_matlab_files_are_one_line(tmp_path: Path, how: str) -> None:
    write_m4human(tmp_path, frames=1)
    points = tmp_path / "p1/actions/36/mmwave/5.mat"
    good = points.read_bytes()
    {
        "cut": lambda: points.write_bytes(good[:300]),
        "empty": lambda: points.write_bytes(b""),
        "garbage": lambda: points.write_bytes(bytes(range(256)) * 8),
        "shape": lambda: savemat(points, {"RawPoints": np.zeros((4, 2))}),
        "name": lambda: savemat(points, {"points": np.zeros((4, 4))}),
    }[how]()
    with pytest.raises(RfgsError) as caught:
        list(open_people_set(tmp_path).frames(1))
    assert "\n" not in str(caught.value) and "expected" in str(caught.value)


def test_other_mistakes_are_one_line(tmp_path: Path) -> None:
    with pytest.raises(RfgsError, match="no such folder"):
        open_people_set(tmp_path / "nowhere")
    with pytest.raises(RfgsError, match=r"expected MM-Fi .*, mmBody .*, HuPR .* or M4Human"):
        open_people_set(tmp_path)
    write_mmfi(tmp_path)
    points = tmp_path / "E01/S01/A13/mmwave/frame003.bin"
    points.write_bytes(points.read_bytes()[:-3])
    with pytest.raises(RfgsError, match="are no points of 40 bytes each"):
        list(open_people_set(tmp_path).frames(1))


def test_hupr_joints_are_held_against_their_type(tmp_path: Path) -> None:
    write_hupr(tmp_path)
    annotations = tmp_path / "single_5/annot/hrnet_annot.json"
    rows = json.loads(annotations.read_text())
    rows[0]["joints"] = rows[0]["joints"][:9]
    annotations.write_text(json.dumps(rows))
    with pytest.raises(RfgsError, match="expected 14 joints"):
        open_people_set(tmp_path)
    annotations.write_text('{"image": 1}')
    with pytest.raises(RfgsError, match="expected a list"):
        open_people_set(tmp_path)


def test_a_header_that_promises_more_than_the_file_holds(tmp_path: Path) -> None:
    file = tmp_path / "a.npy"
    np.save(file, np.zeros((3, 4)))
    np.testing.assert_array_equal(load_array(file, "", 2), np.zeros((3, 4)))
    file.write_bytes(file.read_bytes().replace(b"(3, 4)", b"(300000, 4000000)"))
    with pytest.raises(RfgsError, match="damaged"):
        load_array(file, "make it again", 2)
    with pytest.raises(RfgsError, match="no such file; make it again"):
        load_array(tmp_path / "b.npy", "make it again", 2)


def test_mutated_files_are_read_or_refused(tmp_path: Path) -> None:
    """Never anything but frames or one clear error."""
    write_mmbody(tmp_path, frames=1)
    files = sorted(tmp_path.rglob("frame_0.np?"))
    rng, refused = np.random.default_rng(2), 0
    for file in files:
        good = file.read_bytes()
        for _ in range(150):
            data = bytearray(good)
            for place in rng.integers(min(len(data), 400), size=3):
                data[place] = rng.integers(256)
            file.write_bytes(bytes(data[: rng.integers(1, len(data) + 1)]))
            try:
                list(open_people_set(tmp_path).frames(1))
            except RfgsError as error:
                assert "\n" not in str(error)
                refused += 1
        file.write_bytes(good)
    assert refused > 150
