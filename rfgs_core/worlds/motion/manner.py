# SPDX-License-Identifier: Apache-2.0
"""What arms do of their own: hang, wave, point, clap, carry, reach at random."""

from __future__ import annotations

import numpy as np

from rfgs_core.worlds.motion.arms import ArmPose, Shoulder, place_arm, set_arm
from rfgs_core.worlds.motion.curves import Y, Z, about, between, keyed, keyed_turns, noise
from rfgs_core.worlds.motion.track import SIDES, Track

#: Mean speed of a hand between two places [m/s], from slow to hasty.
_HAND_M_S = (0.35, 1.6)


def rest_pose(rng: np.random.Generator, shoulder: Shoulder) -> ArmPose:
    """How somebody holds an arm who does nothing with it."""
    hang = shoulder.hang(rng.uniform(0.1, 0.5), rng.uniform(0.0, 0.12), rng.uniform(-0.1, 0.15))
    kind = rng.choice(["hang", "hip", "folded", "front"], p=[0.7, 0.1, 0.1, 0.1])
    ahead = shoulder.middle[0] + shoulder.half[0]
    pose = hang
    if kind == "hip":
        place = np.array([0.02, shoulder.sign * (shoulder.half[1] + 0.07), -0.26])
        pose = shoulder.reach(place, rng.uniform(0.5, 0.9))
    elif kind == "folded":
        place = np.array([ahead + 0.08, shoulder.sign * 0.02, rng.uniform(-0.1, 0.05)])
        pose = shoulder.reach(place, rng.uniform(0.1, 0.4))
    elif kind == "front":
        place = np.array([ahead + rng.uniform(0.1, 0.22), 0.08 * shoulder.sign, -0.12])
        pose = shoulder.reach(place, rng.uniform(0.0, 0.3))
    return pose if shoulder.way_clear(hang, pose) else hang


def lap_pose(rng: np.random.Generator, shoulder: Shoulder) -> ArmPose:
    """A hand on the lap, a thigh or a knee of somebody who sits."""
    ahead = shoulder.middle[0] + shoulder.half[0] + rng.uniform(0.04, 0.26)
    place = np.array([ahead, shoulder.sign * rng.uniform(0.04, 0.2), rng.uniform(-0.28, -0.16)])
    return shoulder.reach(place, rng.uniform(0.0, 0.4))


def quiet_arm(
    rng: np.random.Generator, track: Track, side: str, pose: ArmPose | None = None
) -> None:
    """An arm at rest, by default as somebody who stands holds it, moves by a few degrees."""
    shoulder = Shoulder(track.body, side)
    pose = pose or rest_pose(rng, shoulder)
    size = rng.uniform(0.0, 0.06)
    turn = pose.shoulder @ about(Y, size * noise(rng, track.times, 0.5))
    elbow = np.clip(pose.elbow + size * (1.0 + noise(rng, track.times, 0.5)), 0.05, 2.5)
    place_arm(track, side, turn, elbow)


def gesture(rng: np.random.Generator, track: Track, side: str, kind: str | None = None) -> None:
    """An arm that does something from beginning to end.

    Args:
        rng: Where chance comes from.
        track: Whose arm.
        side: `left` or `right`.
        kind: `reach`, `wave`, `point` or `circle`; by default drawn.
    """
    kind = kind or rng.choice(["reach", "wave", "point", "circle"], p=[0.6, 0.15, 0.15, 0.1])
    shoulder = Shoulder(track.body, side)
    if kind == "wave":
        _wave(rng, track, shoulder)
    elif kind == "circle":
        _circle(rng, track, shoulder)
    else:
        knots, poses = _places(rng, track.times[-1], shoulder, pointing=kind == "point")
        set_arm(track, side, knots, poses)


def _places(
    rng: np.random.Generator, duration_s: float, shoulder: Shoulder, pointing: bool
) -> tuple[list[float], list[ArmPose]]:
    """Times and key poses: from rest through random places, sometimes back to rest."""
    home = shoulder.hang(rng.uniform(0.15, 0.5), rng.uniform(0.0, 0.1))
    pose = home if rng.uniform() < 0.6 else shoulder.anywhere(rng, home)
    time_s, hurry = rng.uniform(0.0, 1.2), rng.uniform(*_HAND_M_S)
    knots, poses = [0.0, time_s + 0.01], [pose, pose]
    while time_s < duration_s:
        back = rng.uniform() < 0.15 and shoulder.way_clear(pose, home)
        new = home if back else shoulder.anywhere(rng, pose)
        if pointing and not back:
            new = ArmPose(new.shoulder, min(new.elbow, rng.uniform(0.05, 0.35)))
            new = new if shoulder.way_clear(pose, new) else pose
        far = np.linalg.norm(_wrist(shoulder, new) - _wrist(shoulder, pose))
        turn = np.arccos(np.clip(0.5 * (np.trace(pose.shoulder.T @ new.shoulder) - 1.0), -1, 1))
        lasts = max(far / hurry, turn / (3.0 * hurry), 0.35) * rng.uniform(0.8, 1.3)
        stays = rng.choice([0.02, rng.uniform(0.1, 1.5)])
        knots += [time_s + lasts, time_s + lasts + stays]
        poses += [new, new]
        pose, time_s = new, time_s + lasts + stays
    return knots, poses


def _wrist(shoulder: Shoulder, pose: ArmPose) -> np.ndarray:
    return shoulder.points(pose.shoulder[None], np.array([pose.elbow]))[0, 2]


def _wave(rng: np.random.Generator, track: Track, shoulder: Shoulder) -> None:
    """Raises the hand, swings the forearm from side to side, lowers it again."""
    times, lasts = track.times, track.times[-1]
    home = shoulder.hang(rng.uniform(0.15, 0.4))
    place = shoulder.place + np.array(
        [rng.uniform(0.1, 0.3), shoulder.sign * rng.uniform(0.05, 0.3), rng.uniform(0.05, 0.4)]
    )
    up = shoulder.reach(place, rng.uniform(0.2, 0.9))
    start, end = rng.uniform(0.1, 0.2) * lasts, rng.uniform(0.75, 0.95) * lasts
    turns = np.stack([home.shoulder, home.shoulder, up.shoulder, up.shoulder, home.shoulder])
    bends = np.array([home.elbow, home.elbow, up.elbow, up.elbow, home.elbow])
    knots = [0.0, start - 0.1, start + 0.8, end - 0.8, end]
    on = between(times, start + 0.5, start + 1.2) * (1.0 - between(times, end - 1.2, end - 0.6))
    swing = rng.uniform(0.15, 0.5) * np.sin(2 * np.pi * rng.uniform(0.8, 2.2) * times) * on
    turn = keyed_turns(times, knots, turns) @ about(Z, swing)
    place_arm(track, shoulder.side, turn, keyed(times, knots, bends), 0.5 * swing)


def _circle(rng: np.random.Generator, track: Track, shoulder: Shoulder) -> None:
    """Draws circles with the hand in front of the body."""
    times = track.times
    hz, size = rng.uniform(0.2, 0.8), rng.uniform(0.06, 0.18)
    ahead = shoulder.middle[0] + shoulder.half[0]
    centre = np.array([ahead + 0.32, shoulder.sign * rng.uniform(0.1, 0.3), rng.uniform(-0.1, 0.2)])
    swivel = rng.uniform(0.0, 0.6)
    phase = np.arange(0.0, times[-1] + 0.1, 0.1) * hz * 2 * np.pi
    around = np.stack([0.3 * np.sin(phase), np.cos(phase), np.sin(phase)], axis=1)
    poses = [shoulder.reach(centre + size * way, swivel) for way in around]
    follow(track, shoulder.side, poses, 0.1)


def follow(track: Track, side: str, poses: list[ArmPose], every_s: float) -> None:
    """Moves an arm steadily through dense poses, one every `every_s` seconds."""
    knots = np.arange(len(poses)) * every_s
    flat = np.stack([pose.shoulder for pose in poses]).reshape(len(poses), 9)
    turn = np.stack([np.interp(track.times, knots, column) for column in flat.T], axis=1)
    u, _, v = np.linalg.svd(turn.reshape(-1, 3, 3))
    elbow = np.interp(track.times, knots, [pose.elbow for pose in poses])
    place_arm(track, side, u @ v, elbow)


def clap(rng: np.random.Generator, track: Track) -> None:
    """Both hands meet in front of the chest, again and again."""
    times = track.times
    hz, wide = rng.uniform(0.8, 2.5), rng.uniform(0.1, 0.3)
    height, far = rng.uniform(-0.1, 0.25), rng.uniform(0.22, 0.36)
    phase = np.arange(0.0, times[-1] + 0.05, 0.05) * hz * 2 * np.pi
    for side in SIDES:
        shoulder = Shoulder(track.body, side)
        ahead = shoulder.middle[0] + shoulder.half[0] + far
        aside = 0.03 + wide * 0.5 * (1.0 - np.cos(phase))
        poses = [shoulder.reach(np.array([ahead, shoulder.sign * y, height]), 0.3) for y in aside]
        follow(track, side, poses, 0.05)


def carry(rng: np.random.Generator, track: Track, both: bool, side: str = "left") -> None:
    """Holds something: a box before the belly with both arms, or a thing at the side with one."""
    low = rng.uniform(-0.25, 0.05)
    far, wide = rng.uniform(0.12, 0.26), rng.uniform(0.1, 0.22)
    size = rng.uniform(0.0, 0.03)
    for one in SIDES if both else (side,):
        shoulder = Shoulder(track.body, one)
        ahead = shoulder.middle[0] + shoulder.half[0] + far
        pose = shoulder.reach(np.array([ahead, shoulder.sign * wide, low]), 0.1)
        if not both and rng.uniform() < 0.5:
            pose = shoulder.hang(rng.uniform(0.05, 0.3), 0.1)
        shake = about(Y, size * noise(rng, track.times, 1.0))
        place_arm(track, one, pose.shoulder @ shake, np.full(len(track.times), pose.elbow))
