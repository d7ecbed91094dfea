# SPDX-License-Identifier: Apache-2.0
"""Clips in DeepMimic's format: axes, joints and order of the numbers, by closed forms."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from rfgs_core.articulated import BONES, Pose, people
from rfgs_core.errors import RfgsError
from rfgs_core.motion_capture import retarget
from rfgs_core.motion_capture.clip import read_clip
from rfgs_core.motion_capture.joints import match_joints

#: Lengths of thigh, shin and foot's height that the format fixes [m].
THIGH_M, SHIN_M = 0.421546, 0.409870
#: First column of each joint in a row.
COLUMN = {"root": 4, "right hip": 16, "right knee": 20, "left hip": 30, "left elbow": 43}


def standing(**angles: float) -> list[float]:
    """A row in which every joint is at rest but for angles [rad] about the axis to the right."""
    row = [1 / 30, 0.0, 0.85, 0.0]
    for width in (4, 4, 4, 4, 1, 4, 4, 1, 4, 1, 4, 4, 1):
        row += [1.0, 0.0, 0.0, 0.0] if width == 4 else [0.0]
    for name, angle in angles.items():
        column = COLUMN[name.replace("_", " ")]
        if "knee" in name or "elbow" in name:
            row[column] = angle
        else:
            row[column : column + 4] = [np.cos(angle / 2), 0.0, 0.0, np.sin(angle / 2)]
    return row


def written(path: Path, rows: list[list[float]]) -> Path:
    path.write_text(json.dumps({"Loop": "wrap", "Frames": rows}))
    return path


def test_a_bent_leg_is_where_trigonometry_has_it(tmp_path: Path) -> None:
    """People look along z in BVH's axes, their left is x; a knee bends backwards."""
    hip, knee = 0.5, -0.9
    clip = read_clip(written(tmp_path / "a.txt", [standing(right_hip=hip, right_knee=knee)]))
    foot, thigh = (clip.joints.index(name) for name in ("foot.R", "thigh.R"))
    below = clip.places()[0, foot] - clip.places()[0, thigh]
    ahead = THIGH_M * np.sin(hip) + SHIN_M * np.sin(hip + knee)
    down = THIGH_M * np.cos(hip) + SHIN_M * np.cos(hip + knee)
    assert below == pytest.approx([0.0, -down, ahead], abs=1e-9)
    assert clip.places()[0, thigh, 0] < 0.0 < clip.places()[0, clip.joints.index("thigh.L"), 0]
    assert clip.places()[0, 0] == pytest.approx([0.0, 0.85, 0.0])


def test_every_number_has_its_joint(tmp_path: Path) -> None:
    rows = [standing(left_elbow=1.2), standing(left_hip=0.4), standing(root=0.3)]
    clip = read_clip(written(tmp_path / "a.txt", rows))
    turned = np.linalg.norm(clip.turns - np.eye(3), axis=(2, 3)) > 1e-9
    names = [[clip.joints[j] for j in np.flatnonzero(row)] for row in turned]
    assert names == [["forearm.L"], ["thigh.L"], ["hips"]]
    assert clip.frame_s == pytest.approx(1 / 30)


def test_our_people_stand_on_the_floor_and_swing_a_leg_as_recorded(tmp_path: Path) -> None:
    rows = [standing(), standing(right_hip=0.6)]
    for row in rows:
        # Soles are on the floor where hips are a leg's length, and an ankle's height, above it.
        row[2] = THIGH_M + SHIN_M + 0.07
    clip, body = read_clip(written(tmp_path / "a.txt", rows)), people().body(np.zeros(0))
    assert {"pelvis", "upperarm_left", "lowerarm_right", "foot_left"} <= set(match_joints(clip))
    heads = dict(zip(BONES, body.heads, strict=True))
    root, turns = retarget(clip, heads)
    # Bones that clips do not have follow the trunk.
    trunk = turns["spine_middle"]
    whole = np.stack([turns.get(name, trunk) for name in BONES], axis=1)
    upright, swung = (
        body.heads_at(Pose(place, turn)) for place, turn in zip(root, whole, strict=True)
    )
    hip, knee, ankle = (BONES.index(f"{n}_right") for n in ("upperleg", "lowerleg", "foot"))
    scale = sum(np.diff(-upright[[hip, knee, ankle], 2])) / (THIGH_M + SHIN_M)
    assert upright[ankle, 2] == pytest.approx(0.07 * scale, abs=1e-6)
    leg = swung[ankle] - swung[hip]
    assert np.arctan2(leg[0], -leg[2]) == pytest.approx(0.6, abs=1e-6)
    assert np.abs(swung - upright)[BONES.index("foot_left")].max() < 1e-9


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ([[0.1] * 43], "expected frames of 44 numbers, those of a person, found 43"),
        ([], "found none"),
        ([standing()[:1] + [0.0] * 43], "rotations of hips are no unit quaternions"),
        ([standing(), [0.0, *standing()[1:]], standing()], "frames of one duration above zero"),
    ],
)
def test_what_is_no_clip_of_a_person_is_named(
    tmp_path: Path, rows: list[list[float]], message: str
) -> None:
    path = written(tmp_path / "a.txt", rows)
    with pytest.raises(ValueError, match=message) as caught:
        read_clip(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("HIERARCHY", "JSON"),
        ('{"Frames": [[NaN]]}', "JSON"),
        ("[]", "expected a clip as DeepMimic has them"),
        ('{"Frames": [["a"]]}', "expected a clip as DeepMimic has them"),
    ],
)
def test_other_files_are_one_line(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "a.txt"
    path.write_text(text)
    with pytest.raises(RfgsError, match=message) as caught:
        read_clip(path)
    assert str(path) in str(caught.value) and "\n" not in str(caught.value)


def test_a_cycle_goes_on_from_where_it_ended(tmp_path: Path) -> None:
    """A metre and a twelfth of a circle, twelve times, is a dodecagon."""
    turn = 2.0 * np.pi / 12.0
    rows = []
    for share in np.linspace(0.0, 1.0, 5):
        row = standing(right_hip=np.sin(2.0 * np.pi * share))
        # About y, which is up: anticlockwise from above, from ahead (x) to the left (-z).
        angle = turn * share
        row[1], row[3] = share, 0.1 * np.sin(np.pi * share)
        row[4:8] = [np.cos(angle / 2), 0.0, np.sin(angle / 2), 0.0]
        rows.append(row)
    clip = read_clip(written(tmp_path / "a.txt", rows))
    whole = clip.repeated(12)
    assert len(whole.root) == 12 * 4 + 1 and whole.repeated(1).root.tolist() == whole.root.tolist()
    assert whole.root[-1] == pytest.approx(whole.root[0], abs=1e-9)
    assert whole.turns[-1] == pytest.approx(whole.turns[0], abs=1e-9)
    sides = np.linalg.norm(np.diff(whole.root[::4], axis=0), axis=1)
    assert sides == pytest.approx(np.ones(12))
    # Within every cycle it moves as in the first, seen from where it began.
    for k in range(12):
        again = whole.turns[4 * k : 4 * k + 5, 0]
        assert again[0].T @ again == pytest.approx(clip.turns[:, 0], abs=1e-9)
        assert whole.turns[4 * k : 4 * k + 5, 1:] == pytest.approx(clip.turns[:, 1:], abs=1e-12)
