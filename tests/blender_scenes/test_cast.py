# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import subprocess
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from dataset_factory.scene.bundle import Bundle, read_bundle
from rfgs_core.skeleton import JOINTS

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(find_spec("anny") is None, reason="needs anny"),
]


@pytest.fixture(scope="module")
def blend(
    python: Callable[..., subprocess.CompletedProcess[str]],
    tmp_path_factory: pytest.TempPathFactory,
) -> Path:
    file = tmp_path_factory.mktemp("cast") / "cast.blend"
    python(Path(__file__).with_name("build_cast.py"), file, must_work=True)
    return file


@pytest.fixture(scope="module")
def bundle(blend: Path, python: Callable[..., subprocess.CompletedProcess[str]]) -> Bundle:
    out = blend.parent / "bundle"
    python("-m", "addon_rfgs", "--blend", blend, "export", "--out", out, must_work=True)
    return read_bundle(out)


def vertices_of(bundle: Bundle, person: int, joint: str) -> np.ndarray:
    """Vertices [frame, V, 3] of a segment of a person."""
    topology = bundle.topology
    own = (topology.instance == person) & (topology.segment == JOINTS.index(joint))
    used = np.unique(topology.faces[own])
    return np.stack([bundle.frame(frame).vertices[used] for frame in bundle.frames])


def test_people_are_instances_with_names_and_joints(bundle: Bundle) -> None:
    assert [row["name"] for row in bundle.instances] == ["anna", "felix"]
    assert all(row["person"] for row in bundle.instances)
    joints = bundle.frame(1).joints
    assert joints.shape == (2, 17, 3)
    grown, child = (joints[person, JOINTS.index("head"), 2] for person in (0, 1))
    assert grown > child + 0.15


def test_labels_say_what_each_person_does_at_each_frame(bundle: Bundle) -> None:
    actions = np.array([bundle.frame(frame).action for frame in bundle.frames])
    assert (actions[:, 0] == "stand").all()
    first = {label: int(np.argmax(actions[:, 1] == label)) for label in ("clap", "turn", "walk")}
    assert first["clap"] == 0 < first["turn"] < first["walk"]


def test_a_chest_at_rest_breathes_by_millimetres(bundle: Bundle) -> None:
    chest = vertices_of(bundle, 1, "thorax")
    idle = chest.mean(axis=1, keepdims=True)
    heading = np.array([np.cos(-1.5), np.sin(-1.5), 0.0])
    # The breast bone against the whole thorax, so that idle sway falls out.
    front = ((chest - idle) @ heading).max(axis=1)
    assert 0.002 < np.ptp(front) < 0.010
    rising = np.diff(front) > 0
    breaths = (rising[1:] & ~rising[:-1]).sum()
    assert 1 <= breaths <= 2


def test_segment_velocities_agree_with_joints(bundle: Bundle) -> None:
    frames = [bundle.frame(frame) for frame in bundle.frames]
    velocity = np.stack([frame.segment_velocity for frame in frames])[1:-1]
    joints = np.stack([frame.joints for frame in frames]).astype(np.float64)
    measured = (joints[2:] - joints[:-2]) * bundle.fps / 2
    # Trunk and head: the skin's centre lies near the joint, and neither turns fast.
    for joint in ("pelvis", "thorax", "head"):
        error = velocity[:, :, JOINTS.index(joint)] - measured[:, :, JOINTS.index(joint)]
        assert np.sqrt((error**2).mean()) < 0.06, joint
    speed = np.linalg.norm(velocity, axis=-1)
    assert speed[:, 0].max() < 0.15 < 1.0 < speed[:, 1].max() < 6.0


def test_four_people_fit_into_a_small_file(blend: Path) -> None:
    assert blend.stat().st_size / 2 < 0.7e6
