# SPDX-License-Identifier: Apache-2.0
"""Poses between frames: what Blender evaluates, and the spline through it."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from bundle_files import describe_bundle

from dataset_factory.scene.blender import Blender
from dataset_factory.scene.bundle import Bundle, read_bundle
from dataset_factory.scene.catalogue import find_scene
from dataset_factory.scene.motion import read_motion
from rfgs_core.errors import RfgsError, RfgsFormatError

WHOLE_FRAME, CHIRPS_S = 0.0, 63 * 0.25e-3


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Bundle:
    """Two frames of the walking person, with poses over a frame and over 64 chirps."""
    out = tmp_path_factory.mktemp("walk") / "bundle"
    spans = ["--span", repr(WHOLE_FRAME), "--span", repr(CHIRPS_S)]
    Blender(find_scene("living_room_walk").blend).run(
        "export", "--out", str(out), "--frames", "20:21", *spans
    )
    return read_bundle(out)


def test_spline_follows_the_animation_between_its_poses(walk: Bundle, tmp_path: Path) -> None:
    checks_s = [0.003, 0.01, 0.027, 0.05, 0.091]
    spans = [text for time_s in checks_s for text in ("--span", repr(time_s))]
    blender = Blender(find_scene("living_room_walk").blend)
    blender.run("export", "--out", str(tmp_path / "dense"), "--frames", "20:20", *spans)
    dense = read_bundle(tmp_path / "dense")
    frame, chirps = (read_motion(walk, 20, span_s) for span_s in (WHOLE_FRAME, CHIRPS_S))
    assert len(frame.offset_s) == 6 and len(chirps.offset_s) == 5
    for time_s in checks_s:
        true = read_motion(dense, 20, time_s).vertices[-1]
        # 12 micrometres turn the phase at 62 GHz by 2 degrees; limbs move 130 mm in a frame.
        assert np.abs(frame.at(time_s) - true).max() < 1.2e-5
        if time_s < CHIRPS_S:
            assert np.abs(chirps.at(time_s) - true).max() < 1e-6
    assert np.abs(frame.vertices[-1] - frame.vertices[0]).max() > 0.1


def test_a_span_ends_where_the_next_frame_begins(walk: Bundle) -> None:
    motion, following = read_motion(walk, 20, WHOLE_FRAME), walk.frame(21)
    assert np.array_equal(motion.at(0.0).astype(np.float32), walk.frame(20).vertices)
    assert np.array_equal(motion.vertices[-1], following.vertices)


def test_unknown_spans_and_damaged_poses_are_named(walk: Bundle, tmp_path: Path) -> None:
    with pytest.raises(RfgsFormatError, match=r"--span 0\.03"):
        read_motion(walk, 20, 0.03)
    bundle = Path(shutil.copytree(walk.path, tmp_path / "bundle"))
    path = bundle / "frames" / "000021.npz"
    with np.load(path) as stored:
        arrays = dict(stored)
    np.savez(path, **{**arrays, "pose_offset_s": arrays["pose_offset_s"] + 1e-3})
    with pytest.raises(RfgsFormatError, match=r"000021\.npz: changed or damaged since the export"):
        read_motion(read_bundle(bundle), 21, WHOLE_FRAME)
    describe_bundle(bundle)
    with pytest.raises(RfgsFormatError, match=r"000021\.npz: poses differ"):
        read_motion(read_bundle(bundle), 21, WHOLE_FRAME)
    path.unlink()
    with pytest.raises(RfgsFormatError, match=r"000021\.npz: no such file; export"):
        read_motion(read_bundle(bundle), 21, WHOLE_FRAME)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--frames", "20:60", "--span", "0.0"], "1:59.*no packet can follow"),
        (["--frames", "20:21", "--span", "0.2"], r"expected 0 to 0\.1 s"),
    ],
)
def test_packets_beyond_the_animation_are_refused(
    tmp_path: Path, arguments: list[str], message: str
) -> None:
    blender = Blender(find_scene("living_room_walk").blend)
    with pytest.raises(RfgsError, match=message):
        blender.run("export", "--out", str(tmp_path / "bundle"), *arguments)
    assert not (tmp_path / "bundle").exists()
