# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from blender_scenes.motion.going import Walk
from blender_scenes.motion.recorded import Recorded, poses_of
from blender_scenes.motion.score import Figure, Posture, Score, compose
from blender_scenes.motion.skeleton import Skeleton
from rfgs_core.motion_capture.bvh import read_bvh
from rfgs_core.motion_capture.joints import plain_name

#: Bones that the file shall have, under names of another rig.
OTHER_NAMES = {
    "root": "Hips",
    "spine04": "Spine",
    "spine02": "Spine1",
    "spine01": "Spine2",
    "neck01": "Neck",
    "head": "Head",
    "clavicle": "Shoulder",
    "upperarm01": "Arm",
    "lowerarm01": "ForeArm",
    "wrist": "Hand",
    "upperleg01": "UpLeg",
    "lowerleg01": "Leg",
    "foot": "Foot",
    "toe1-1": "ToeBase",
}
#: From our axes to the file's: y is up, people look along +z.
TO_FILE = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
FRAME_S = 1 / 30


def euler_zxy(turn: np.ndarray) -> tuple[float, float, float]:
    """Angles [degrees] about z, x and y, in this order, of a rotation."""
    x = np.arcsin(np.clip(turn[2, 1], -1, 1))
    z = np.arctan2(-turn[0, 1], turn[1, 1])
    y = np.arctan2(-turn[2, 0], turn[2, 2])
    return float(np.degrees(z)), float(np.degrees(x)), float(np.degrees(y))


def file_name(bone: str) -> str:
    plain, _, side = bone.partition(".")
    return {"L": "Left", "R": "Right", "": ""}[side] + OTHER_NAMES[plain]


class Writer:
    """Writes the motion of a score as a BVH file in centimetres."""

    def __init__(self, skeleton: Skeleton) -> None:
        self.skeleton = skeleton
        self.bones = [b for b in skeleton.bones if b.partition(".")[0] in OTHER_NAMES]
        self.order: list[str] = []

    def parent(self, bone: str) -> str | None:
        """The nearest bone above that is in the file."""
        index = self.skeleton.parents[self.skeleton.index[bone]]
        while index >= 0 and self.skeleton.bones[index] not in self.bones:
            index = self.skeleton.parents[index]
        return self.skeleton.bones[index] if index >= 0 else None

    def hierarchy(self, bone: str, depth: int) -> str:
        self.order.append(bone)
        parent, pad = self.parent(bone), "  " * depth
        rest = self.skeleton.head(bone) - (self.skeleton.head(parent) if parent else 0.0)
        offset = 100 * TO_FILE @ rest
        kind = f"JOINT {file_name(bone)}" if parent else f"ROOT {file_name(bone)}"
        places = "" if parent else "Xposition Yposition Zposition "
        text = f"{pad}{kind}\n{pad}{{\n{pad}  OFFSET " + " ".join(f"{v:.6f}" for v in offset)
        count = 3 if parent else 6
        text += f"\n{pad}  CHANNELS {count} {places}Zrotation Xrotation Yrotation\n"
        children = [child for child in self.bones if self.parent(child) == bone]
        for child in children:
            text += self.hierarchy(child, depth + 1)
        if not children:
            text += f"{pad}  End Site\n{pad}  {{\n{pad}    OFFSET 0 5 0\n{pad}  }}\n"
        return text + f"{pad}}}\n"

    def write(self, path: Path, score: Score) -> None:
        text = "HIERARCHY\n" + self.hierarchy("root", 0)
        times = np.arange(0, score.duration_s, FRAME_S)
        rows = []
        for time_s in times:
            pose = score.pose(float(time_s))
            world = dict(zip(self.skeleton.bones, self.skeleton.world_turns(pose), strict=True))
            row = [*(100 * TO_FILE @ pose.root)]
            for bone in self.order:
                parent = self.parent(bone)
                local = (world[parent].T if parent else np.eye(3)) @ world[bone]
                row += euler_zxy(TO_FILE @ local @ TO_FILE.T)
            rows.append(" ".join(f"{value:.6f}" for value in row))
        text += f"MOTION\nFrames: {len(times)}\nFrame Time: {FRAME_S:.8f}\n" + "\n".join(rows)
        path.write_text(text + "\n")


@pytest.fixture(scope="module")
def walk(figure: Figure) -> Score:
    return compose(figure, Posture((0.3, -0.2), 0.4), [Walk([(1.8, 0.8)], 1.1)])


@pytest.fixture(scope="module")
def recording(figure: Figure, walk: Score, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("bvh") / "walk.bvh"
    Writer(figure.skeleton).write(path, walk)
    return path


def angle_between(first: np.ndarray, second: np.ndarray) -> float:
    """Angle [degrees] between two rotations."""
    cosine = 0.5 * (np.trace(first.T @ second) - 1)
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))


def test_a_recording_comes_back_as_it_was(figure: Figure, walk: Score, recording: Path) -> None:
    skeleton = figure.skeleton
    bvh = read_bvh(recording)
    assert bvh.frame_s == pytest.approx(FRAME_S)
    poses = poses_of(bvh, skeleton)
    kept = [skeleton.index[b] for b in Writer(skeleton).bones]
    for index in range(0, len(poses), 7):
        wanted = walk.pose(index * FRAME_S)
        gaps = np.linalg.norm(skeleton.joints(poses[index]) - skeleton.joints(wanted), axis=1)
        # Spines with fewer joints bend less smoothly: millimetres at the hands.
        assert gaps[kept].max() < 0.01
        turns = skeleton.world_turns(wanted)
        for bone in ("root", "head", "upperarm01.L", "lowerleg01.R", "foot.L"):
            assert angle_between(poses[index].turns[bone], turns[skeleton.index[bone]]) < 1.0


def test_limbs_point_as_recorded_on_a_body_of_other_size(
    figure: Figure, walk: Score, recording: Path
) -> None:
    small = figure.skeleton
    heads = small.heads * [0.8, 0.8, 0.8]
    # Arms that hang wider at rest than the recorded ones.
    for index, name in enumerate(small.bones):
        if name.startswith(("lowerarm", "wrist", "finger")):
            heads[index, 2] += 0.1
    other = Skeleton(small.bones, small.parents, heads, 0.8 * small.heel, small.surface)
    poses = poses_of(read_bvh(recording), other)
    for index in range(0, len(poses), 11):
        ours = other.joints(poses[index])
        theirs = small.joints(walk.pose(index * FRAME_S))
        for first, second in (("upperarm01.L", "lowerarm01.L"), ("upperleg01.R", "lowerleg01.R")):
            a, b = small.index[first], small.index[second]
            cosine = (ours[b] - ours[a]) @ (theirs[b] - theirs[a])
            cosine /= np.linalg.norm(ours[b] - ours[a]) * np.linalg.norm(theirs[b] - theirs[a])
            assert np.degrees(np.arccos(min(cosine, 1.0))) < 3.0
    way = np.linalg.norm(poses[-1].root[:2] - poses[0].root[:2])
    recorded = np.linalg.norm(walk.pose(len(poses) * FRAME_S).root[:2] - walk.pose(0).root[:2])
    assert way == pytest.approx(0.8 * recorded, rel=0.01)


def test_a_recording_is_a_piece_like_any_other(figure: Figure, recording: Path) -> None:
    here = Posture((2.0, 1.0), -1.0)
    score = compose(figure, here, [Recorded(read_bvh(recording), "captured"), Walk([(4.0, 1.0)])])
    skeleton = figure.skeleton
    times = np.arange(0, score.duration_s, 0.02)
    joints = np.stack([skeleton.joints(score.pose(float(t))) for t in times])
    assert np.linalg.norm(np.diff(joints, axis=0), axis=2).max() / 0.02 < 5.5
    assert joints[0] == pytest.approx(skeleton.joints(here.pose(figure)), abs=1e-6)
    assert score.label(1.0) == "captured"
    moved = score.parts[0].end.place_m - np.array(here.place_m)
    # It sets off as recorded, seen from the pelvis: 1.8 m along its own heading.
    assert np.linalg.norm(moved) == pytest.approx(np.hypot(1.5, 1.0), abs=0.05)


def test_names_of_other_rigs_are_understood() -> None:
    assert plain_name("mixamorig:LeftUpLeg") == ("upleg", "L")
    assert plain_name("rShin") == ("shin", "R")
    assert plain_name("foot.R") == ("foot", "R")
    assert plain_name("R_Hand") == ("hand", "R")
    assert plain_name("Hips") == ("hips", "")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("HIERARCHY", "NOTHING"), "expected HIERARCHY"),
        (("Frames:", "Pictures:"), "Frames:"),
        (("Frames: ", "Frames: 1"), "channels, got"),
        (("Zrotation", "Wrotation"), "unknown channel 'Wrotation'"),
        (("OFFSET", "SHIFT"), "unexpected"),
    ],
)
def test_damaged_files_are_named(
    recording: Path, tmp_path: Path, change: tuple[str, str], message: str
) -> None:
    file = tmp_path / "bad.bvh"
    file.write_text(recording.read_text().replace(*change))
    with pytest.raises(ValueError, match=message) as caught:
        read_bvh(file)
    assert str(file) in str(caught.value)


def test_recordings_of_things_are_refused(figure: Figure, recording: Path, tmp_path: Path) -> None:
    file = tmp_path / "thing.bvh"
    file.write_text(recording.read_text().replace("UpLeg", "Wheel"))
    with pytest.raises(ValueError, match="joints of a person"):
        poses_of(read_bvh(file), figure.skeleton)
