# SPDX-License-Identifier: Apache-2.0
"""BVH files of rigs that others use: where hips are below a root, and what arms are called."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rfgs_core.articulated import BONES, people
from rfgs_core.motion_capture.bvh import read_bvh
from rfgs_core.motion_capture.joints import match_joints
from rfgs_core.motion_capture.retarget import retarget

PLACE = "Xposition Yposition Zposition "
TURN = "Zrotation Xrotation Yrotation"
END = "End Site { OFFSET 0 -5 0 }"


def joint(name: str, offset: str, *children: str, free: bool = False, kind: str = "JOINT") -> str:
    channels = f"6 {PLACE}{TURN}" if free else f"3 {TURN}"
    inner = "".join(children) or END
    return f"{kind} {name} {{ OFFSET {offset} CHANNELS {channels} {inner} }}\n"


def limbs(names: tuple[str, ...], *, collar: bool = True) -> tuple[str, ...]:
    """Legs, trunk and arms in a T-pose [cm]; people look along z, y is up."""
    collar_name, upper, lower, hand = names
    parts = []
    for side, sign in (("Left", 1), ("Right", -1)):
        knee = joint(f"{side}Knee", "0 -42 0", joint(f"{side}Ankle", "0 -41 0"))
        parts.append(joint(f"{side}Hip", f"{9 * sign} 0 0", knee))
    arms = []
    for side, sign in (("Left", 1), ("Right", -1)):
        wrist = joint(side + hand, f"{25 * sign} 0 0")
        arm = joint(
            side + upper, f"{15 * sign} 0 0", joint(side + lower, f"{28 * sign} 0 0", wrist)
        )
        arms.append(joint(side + collar_name, f"{3 * sign} 15 0", arm) if collar else arm)
    neck = joint("Neck", "0 25 0", joint("Head", "0 8 0"))
    return (*parts, joint("Chest", "0 20 0", *arms, neck))


BIOVISION = ("Collar", "Shoulder", "Elbow", "Wrist")


def written(path: Path, hierarchy: str, first: list[list[float]]) -> Path:
    """A file whose channels are 0 but for the first ones of each frame."""
    channels = sum(int(row.split()[0]) for row in hierarchy.split("CHANNELS ")[1:])
    rows = [" ".join(map(str, [*row, *[0] * (channels - len(row))])) for row in first]
    head = f"HIERARCHY\n{hierarchy}MOTION\nFrames: {len(rows)}\nFrame Time: 0.04\n"
    path.write_text(head + "\n".join(rows) + "\n")
    return path


@pytest.fixture
def heads() -> dict[str, np.ndarray]:
    return dict(zip(BONES, people().random(np.random.default_rng(0)).heads, strict=True))


@pytest.mark.parametrize("turned", [0.0, 90.0])
def test_hips_that_move_below_a_root_carry_the_person(tmp_path: Path, heads, turned) -> None:
    """A metre and 90° a frame of the hips, seen from a root that is turned and stays."""
    hips = joint("Hips", "0 90 0", *limbs(BIOVISION), free=True)
    prop = joint("Camera", "0 0 50", free=True)
    rig = joint("Root", "0 0 0", hips, prop, free=True, kind="ROOT")
    moves = [[0, 0, 0, 0, 0, turned, 0, 90, 100 * f, 0, 0, 90 * f] for f in range(3)]
    recording = read_bvh(written(tmp_path / "a.bvh", rig, moves))
    assert recording.joints[0] == "Hips" and "Camera" not in recording.joints
    ahead = np.array([np.sin(np.radians(turned)), 0.0, np.cos(np.radians(turned))])
    expected = [[0.0, 90.0, 0.0] + 100.0 * f * ahead for f in range(3)]
    np.testing.assert_allclose(recording.places()[:, 0], expected, atol=1e-9)
    told = retarget(recording, heads)
    way = np.diff(told.root, axis=0)
    assert np.linalg.norm(way, axis=1) == pytest.approx([np.linalg.norm(way[0])] * 2, rel=0.05)
    assert np.linalg.norm(way[0]) > 0.5
    # Its own turn and its root's add up.
    facing = [np.arctan2(turn[1, 0], turn[0, 0]) for turn in told.turns["pelvis"]]
    np.testing.assert_allclose(np.unwrap(facing) - facing[0], np.radians([0, 90, 180]), atol=1e-6)


def test_what_moves_beside_the_person_or_in_it_carries_nobody(tmp_path: Path) -> None:
    chest = list(limbs(BIOVISION))
    chest[-1] = chest[-1].replace(f"3 {TURN}", f"6 {PLACE}{TURN}", 1)
    hips = joint("Hips", "0 90 0", *chest, kind="ROOT", free=True)
    still = read_bvh(written(tmp_path / "a.bvh", hips, [[0, 90, 50 * f] for f in range(3)]))
    assert still.joints[0] == "Hips" and len(still.joints) == 18
    np.testing.assert_allclose(still.root[:, 2], [0.0, 50.0, 100.0])


@pytest.mark.parametrize(
    ("names", "collar", "clavicle"),
    [
        (BIOVISION, True, "LeftCollar"),
        (BIOVISION, False, None),
        (("Shoulder", "Arm", "ForeArm", "Hand"), True, "LeftShoulder"),
    ],
)
def test_upper_arms_point_as_recorded_whatever_they_are_called(
    tmp_path: Path, heads, names, collar, clavicle
) -> None:
    rig = joint("Hips", "0 0 0", *limbs(names, collar=collar), free=True, kind="ROOT")
    recording = read_bvh(written(tmp_path / "a.bvh", rig, [[0, 90, 0]] * 2))
    found = {bone: recording.joints[row] for bone, row in match_joints(recording).items()}
    assert found["upperarm_left"] == f"Left{names[1]}"
    assert found.get("clavicle_left") == clavicle
    turns = retarget(recording, heads).turns
    for upper, lower in (("upperarm_left", "lowerarm_left"), ("lowerarm_left", "hand_left")):
        rest = heads[lower] - heads[upper]
        points = turns[upper][0] @ rest / np.linalg.norm(rest)
        # A T-pose: to the left.
        np.testing.assert_allclose(points, [0.0, 1.0, 0.0], atol=1e-6)
