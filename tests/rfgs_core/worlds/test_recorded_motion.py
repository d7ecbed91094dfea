# SPDX-License-Identifier: Apache-2.0
"""Recorded motions in random worlds: what was written as motion capture is what is done there."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from dataset_factory.check.validate import validate
from dataset_factory.cli import main
from rfgs_core import open_dataset
from rfgs_core.articulated import people
from rfgs_core.errors import RfgsError
from rfgs_core.limbs.propose import Joints
from rfgs_core.limbs.skins import PosedPeople, shapes_of
from rfgs_core.motion_capture import read_recording
from rfgs_core.pose.bvh import write_bvh
from rfgs_core.radio.presets import preset
from rfgs_core.worlds.motion import KeptRecording, random_motion, recorded_motion
from rfgs_core.worlds.settings_file import read_worlds_file
from rfgs_core.worlds.world import WorldSettings, random_world

TIME_S = np.arange(0.0, 1.61, 0.1)


@pytest.fixture(scope="module")
def walker() -> PosedPeople:
    """Somebody who walks, away from every axis."""
    rng = np.random.default_rng(8)
    body = people().random(rng)
    motion = random_motion(rng, body, "walk")
    turn = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    xyz = np.array([[body.joints17(motion.at(0.3 + t).turned(turn))] for t in TIME_S])
    joints = Joints(xyz, np.full(xyz.shape[:3], 0.02))
    return PosedPeople.through(joints, shapes_of(joints))


@pytest.fixture(scope="module")
def file(walker: PosedPeople, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("capture") / "walk.bvh"
    write_bvh(path, walker, 0, TIME_S)
    return path


@pytest.fixture(scope="module")
def kept(file: Path) -> KeptRecording:
    return KeptRecording.of(file.name, read_recording(file))


def test_somebody_who_is_recorded_does_the_same_again(
    walker: PosedPeople, kept: KeptRecording
) -> None:
    """The writer of motion capture is another; the same body has the same joints, moved and turned
    to the origin as a whole."""
    body = walker.body(0)
    motion = recorded_motion(body, kept)
    shown = np.arange(0.0, 1.5, 0.1)
    ours = np.array([body.joints17(motion.at(float(t))) for t in shown])
    theirs = np.array([body.joints17(walker.pose(frame, 0)) for frame in range(len(shown))])
    assert ours[0, 0, :2] == pytest.approx([0.0, 0.0], abs=0.05)
    flat = (theirs - theirs[0, :1])[..., :2].reshape(-1, 2) @ [1.0, 1.0j]
    moved = (ours - ours[0, :1])[..., :2].reshape(-1, 2) @ [1.0, 1.0j]
    turn = np.vdot(moved, flat) / np.vdot(moved, moved)
    assert abs(turn) == pytest.approx(1.0, abs=0.002)
    assert np.abs(turn * moved - flat).max() < 0.004
    # The whole body is lifted by as much as soles were under the floor.
    lift = (ours - theirs)[..., 2]
    under = -np.array([body.skin(walker.pose(k, 0))[:, 2].min() for k in range(len(shown))])
    assert np.ptp(lift, axis=1).max() < 0.001
    assert (lift[:, 0] > under).all() and lift.max() < max(under.max(), 0.0) + 0.004
    # It sets off ahead: along x.
    ahead = ours[-1, 0, :2] - ours[0, 0, :2]
    assert abs(np.degrees(np.arctan2(ahead[1], ahead[0]))) < 20.0


def test_somebody_small_takes_smaller_steps(walker: PosedPeople, kept: KeptRecording) -> None:
    body = walker.body(0)
    half = dataclasses.replace(body, heads=0.5 * body.heads, vertices=0.5 * body.vertices)
    ways = [
        np.linalg.norm(np.diff(recorded_motion(who, kept).root[[0, -1], :2], axis=0))
        for who in (body, half)
    ]
    assert ways[1] == pytest.approx(0.5 * ways[0], rel=1e-3)


def test_nobody_sinks_into_the_floor(walker: PosedPeople, kept: KeptRecording) -> None:
    """A recording whose floor is 0.2 m too low is lifted, in every sample."""
    low = dataclasses.replace(kept, root=tuple((x, y - 0.2, z) for x, y, z in kept.root))
    body = walker.body(0)
    motion = recorded_motion(body, low)
    times = np.arange(0.0, motion.duration_s, 0.02)
    skins = [float(body.skin(motion.at(float(t)))[:, 2].min()) for t in times]
    assert 0.0 < min(skins) < 0.01 and max(skins) < 0.05


def test_of_a_long_recording_a_world_shows_a_part(kept: KeptRecording) -> None:
    for start_s, end_s, first, last in ((0.0, 0.5, 0, 6), (0.55, 0.95, 5, 11), (1.59, 9.0, 15, 16)):
        part = kept.between(start_s, end_s)
        assert part.root == kept.root[first : last + 1]
        assert part.quats == kept.quats[first : last + 1]
    assert kept.duration_s == pytest.approx(1.6)
    # Worlds that last 0.15 s begin at different times of it.
    settings = WorldSettings(2, families=("recorded",), people=(1, 1), recordings=(kept,))
    worlds = [random_world(preset("wifi_commodity"), settings, 0, index) for index in range(3)]
    motions = [world.actors[0].motion for world in worlds]
    assert max(motion.duration_s for motion in motions) < 0.5
    assert len({motion.local.tobytes() for motion in motions}) == 3


def test_legs_without_length_are_refused(walker: PosedPeople, kept: KeptRecording) -> None:
    flat = tuple(
        (0.0, 0.0, 0.0) if name.startswith(("lowerleg", "foot")) else offset
        for name, offset in zip(kept.joints, kept.offsets, strict=True)
    )
    with pytest.raises(RfgsError, match="legs of some length"):
        recorded_motion(walker.body(0), dataclasses.replace(kept, offsets=flat))


def test_worlds_of_recordings_are_datasets_and_keep_them(file: Path, tmp_path: Path) -> None:
    out = tmp_path / "worlds"
    asked = ("worlds", "--radio", "wifi_commodity", "--frames", "2", "--depth", "1", "--count", "1")
    assert main([*asked, "--people", "1", "--recording", str(file), "--out", str(out)]) == 0
    assert validate(out / "world_0000000") == []
    sequence = open_dataset(out / "world_0000000").sequence()
    assert sequence.actions(1) == ["recorded"]
    # The folder is enough to make the world again.
    shared = read_worlds_file(out / "worlds.json")
    (kept,) = shared.settings.recordings
    assert kept == KeptRecording.of("walk.bvh", read_recording(file))
    world = random_world(shared.radio, shared.settings, shared.seed, 0)
    np.testing.assert_allclose(sequence.joints(2), world.joints(0.1), atol=1e-6)
    # Another recording is another set of worlds.
    other = tmp_path / "other.bvh"
    other.write_text(file.read_text())
    assert main([*asked, "--people", "1", "--recording", str(other), "--out", str(out)]) != 0


def test_recorded_motions_stand_beside_others(kept: KeptRecording) -> None:
    radio = preset("wifi_commodity")
    both = WorldSettings(2, depth=1, families=("stand", "recorded"), recordings=(kept,))
    worlds = [random_world(radio, both, 0, index) for index in range(8)]
    seen = {actor.motion.family for world in worlds for actor in world.actors}
    assert seen == {"stand", "recorded"}
    again = random_world(radio, both, 0, 3)
    np.testing.assert_array_equal(worlds[3].joints(0.1), again.joints(0.1))


def changed(kept: KeptRecording, **values: object) -> WorldSettings:
    return WorldSettings(families=("recorded",), recordings=(dataclasses.replace(kept, **values),))


def test_recordings_that_nobody_did_are_refused(kept: KeptRecording) -> None:
    nowhere = tuple(tuple((0.0, 0.0, 0.0, 0.0) for _ in row) for row in kept.quats)
    for settings, said in (
        (WorldSettings(families=("recorded",)), "expected both or neither"),
        (WorldSettings(recordings=(kept,)), "expected both or neither"),
        (changed(kept, quats=nowhere), "unit quaternions"),
        (changed(kept, root=kept.root[:1]), "1 frames"),
        (changed(kept, parents=kept.parents[:-1]), "as many numbers as joints"),
        (changed(kept, parents=(5, *kept.parents[1:])), "parents before their children"),
        (changed(kept, up="x"), "an axis y or z"),
        (changed(kept, frame_s=float("nan")), "an axis y or z"),
        (changed(kept, joints=tuple(f"wheel{k}" for k in range(len(kept.joints)))), "of a person"),
    ):
        with pytest.raises(RfgsError, match=said):
            settings.check()


def test_what_cannot_be_read_is_one_line(file: Path, tmp_path: Path, capsys) -> None:
    out = tmp_path / "worlds"
    wheels = tmp_path / "wheels.bvh"
    wheels.write_text(file.read_text().replace("upperleg", "wheel"))
    text = tmp_path / "clip.txt"
    text.write_text(json.dumps({"Frames": [[1.0]]}))
    for path, said in (
        (tmp_path / "none.bvh", "no such file"),
        (wheels, "expected joints of a person"),
        (text, "expected frames of 44 numbers"),
    ):
        asked = ("worlds", "--radio", "wifi", "--recording", str(path), "--out", str(out))
        assert main(list(asked)) != 0
        error = capsys.readouterr().err
        assert said in error and str(path) in error and "Traceback" not in error
    assert not out.exists()
