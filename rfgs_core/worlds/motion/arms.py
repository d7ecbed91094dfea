# SPDX-License-Identifier: Apache-2.0
"""Arms: reached places, key poses, and what keeps them out of the trunk."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rfgs_core.articulated import BONES, Body
from rfgs_core.articulated.bones import SKULL_M, bone
from rfgs_core.articulated.limits import limits
from rfgs_core.articulated.turns import vector_of
from rfgs_core.worlds.motion.curves import X, Y, Z, about, keyed, keyed_turns
from rfgs_core.worlds.motion.track import SIGN, Track

#: Arms keep this far from the surface of trunk and head [m].
_CLEAR_M = 0.045
#: Of the elevation of an arm over 30 degrees, the shoulder girdle takes this share; of the whole
#: it is a third (Inman, Saunders and Abbott 1944), but the blade's part is in the arm's angle.
_GIRDLE = 0.22
#: Flexion of elbows ends here [rad].
_ELBOW_MOST = 2.5
#: Shoulders turn over this share of their limits; the girdle adds to it.
_WITHIN = 0.85


@dataclass(frozen=True)
class ArmPose:
    """How an arm is held against the thorax."""

    shoulder: np.ndarray
    """Rotation of the upper arm from hanging, shape [3, 3]."""
    elbow: float
    """Flexion of the elbow [rad]."""
    wrist: float = 0.0
    """Flexion of the wrist [rad]."""


class Shoulder:
    """One shoulder of a body: poses of its arm in the axes of the thorax."""

    def __init__(self, body: Body, side: str) -> None:
        """Measures arm and trunk.

        Args:
            body: Whose arm.
            side: `left` or `right`.
        """
        heads = {name: body.heads[row] for row, name in enumerate(BONES)}
        self.side, self.sign = side, SIGN[side]
        origin = heads["spine_upper"]
        self.place = heads[f"upperarm_{side}"] - origin
        self.upper_m = float(np.linalg.norm(heads[f"lowerarm_{side}"] - heads[f"upperarm_{side}"]))
        self.fore_m = float(np.linalg.norm(heads[f"hand_{side}"] - heads[f"lowerarm_{side}"]))
        self.hand_m = 0.1 * body.height_m / 1.7
        self.skull = heads["head"] - origin + np.array([0.02, 0.0, SKULL_M])
        self.skull_m = 0.12 * body.height_m / 1.7
        self.middle, self.half = _trunk(body, origin)

    @property
    def reach_m(self) -> float:
        """Length of the arm to the wrist [m]."""
        return self.upper_m + self.fore_m

    def hang(self, elbow: float = 0.25, out: float = 0.0, ahead: float = 0.0) -> ArmPose:
        """The arm hangs beside the trunk.

        Args:
            elbow: Flexion of the elbow [rad].
            out: How far it is held away beyond what the trunk needs [rad].
            ahead: Flexion of the shoulder [rad].
        """
        need = self.half[1] + _CLEAR_M - abs(self.place[1])
        aside = float(np.arcsin(np.clip(need / self.upper_m, 0.08, 0.7))) + out
        turn = about(X, self.sign * aside) @ about(Y, -ahead)
        return ArmPose(turn, elbow)

    def reach(self, target: np.ndarray, swivel: float = 0.0, wrist: float = 0.0) -> ArmPose:
        """The wrist at a place, or as near as the arm goes.

        Args:
            target: Place in the axes of the thorax, from the head of `spine_upper` [m], [3].
            swivel: How far the elbow is lifted outwards from pointing down [rad].
            wrist: Flexion of the wrist [rad].
        """
        towards = target - self.place
        far = float(np.clip(np.linalg.norm(towards), 0.25 * self.reach_m, 0.995 * self.reach_m))
        up = -towards / max(float(np.linalg.norm(towards)), 1e-6)
        # Elbows point down and a little back, or outwards where the arm goes down or up.
        down = np.array([-0.35, 0.35 * self.sign, -1.0 if abs(up[2]) < 0.8 else 0.0])
        elbow_way = down - (down @ up) * up
        elbow_way = about(up, -self.sign * swivel) @ elbow_way
        ahead = -elbow_way / max(float(np.linalg.norm(elbow_way)), 1e-6)
        frame = np.stack([ahead, np.cross(up, ahead), up], axis=1)
        a, b = self.upper_m, self.fore_m
        at_shoulder = np.arccos(np.clip((a * a + far * far - b * b) / (2 * a * far), -1, 1))
        inner = np.arccos(np.clip((a * a + b * b - far * far) / (2 * a * b), -1, 1))
        elbow = float(min(np.pi - inner, _ELBOW_MOST))
        return ArmPose(frame @ about(Y, float(at_shoulder)), elbow, wrist)

    def points(self, shoulder: np.ndarray, elbow: np.ndarray) -> np.ndarray:
        """Elbow, middle of the forearm, wrist and fingers [N, 4, 3] in the axes of the thorax."""
        down = np.array([0.0, 0.0, -1.0])
        at_elbow = self.place + self.upper_m * (shoulder @ down)
        fore = shoulder @ about(Y, -elbow) @ down
        lengths = np.array([0.0, 0.5 * self.fore_m, self.fore_m, self.fore_m + self.hand_m])
        return at_elbow[:, None] + lengths[:, None] * fore[:, None]

    def inside_m(self, shoulder: np.ndarray, elbow: np.ndarray) -> np.ndarray:
        """How deep the arm is in trunk or head, below zero outside, roughly [m], shape [N]."""
        points = self.points(shoulder, elbow)
        flat = (points[..., :2] - self.middle) / (self.half + _CLEAR_M)
        trunk = (1.0 - np.linalg.norm(flat, axis=-1)) * self.half[1]
        trunk = np.where(points[..., 2] > self.place[2] + 0.02, -1.0, trunk)
        head = self.skull_m - np.linalg.norm(points - self.skull, axis=-1)
        return np.maximum(trunk, head).max(axis=1)

    def allowed(self, pose: ArmPose) -> bool:
        """Whether a shoulder turns that far: little behind the back and across the chest."""
        prior, row = limits(), bone(f"upperarm_{self.side}")
        vector = vector_of(np.ascontiguousarray(prior.middle[row].T @ pose.shoulder))
        if (vector < _WITHIN * prior.low[row]).any() or (vector > _WITHIN * prior.high[row]).any():
            return False
        way = pose.shoulder @ np.array([0.0, 0.0, -1.0])
        out = way[1] * self.sign
        behind = -0.6 if way[2] < -0.5 else -0.25
        return bool(way[0] > behind and (out > -0.1 or way[0] > 0.3) and out > -0.65)

    def way(self, first: ArmPose, second: ArmPose) -> tuple[np.ndarray, np.ndarray]:
        """Rotations [9, 3, 3] and flexions of the elbow [9] from one pose to the other."""
        times = np.linspace(0.0, 1.0, 9)
        turns = keyed_turns(times, (0.0, 1.0), np.stack([first.shoulder, second.shoulder]))
        return turns, keyed(times, (0.0, 1.0), np.array([first.elbow, second.elbow]))

    def way_clear(self, first: ArmPose, second: ArmPose) -> bool:
        """Whether the arm goes from one pose to the other outside of trunk and head."""
        deep = self.inside_m(*self.way(first, second))
        # What begins inside may leave: only going deeper is refused.
        return bool((deep[1:] < max(0.0, deep[0]) + 1e-3).all())

    def anywhere(self, rng: np.random.Generator, start: ArmPose) -> ArmPose:
        """A random pose that the arm can go to from `start`."""
        for _ in range(30):
            way = rng.standard_normal(3)
            far = self.reach_m * rng.uniform(0.35, 1.0) ** 0.5
            target = self.place + far * way / np.linalg.norm(way)
            pose = self.reach(target, rng.uniform(-0.5, 1.2), rng.uniform(-0.5, 0.5))
            if self.allowed(pose) and self.way_clear(start, pose):
                return pose
        return start


def set_arm(track: Track, side: str, knots_s: list[float], poses: list[ArmPose]) -> None:
    """Moves an arm through key poses, with minimum jerk from each to the next."""
    shoulder = keyed_turns(track.times, knots_s, np.stack([pose.shoulder for pose in poses]))
    elbow = keyed(track.times, knots_s, np.array([pose.elbow for pose in poses]))
    wrist = keyed(track.times, knots_s, np.array([pose.wrist for pose in poses]))
    place_arm(track, side, shoulder, elbow, wrist)


def place_arm(
    track: Track,
    side: str,
    shoulder: np.ndarray,
    elbow: np.ndarray,
    wrist: np.ndarray | float = 0.0,
) -> None:
    """Sets girdle, shoulder, elbow and wrist.

    Args:
        track: Whose arm.
        side: `left` or `right`.
        shoulder: Rotation of the upper arm from hanging against the thorax, shape [T, 3, 3].
        elbow: Flexion [rad], shape [T].
        wrist: Flexion [rad].
    """
    sign = SIGN[side]
    way = -shoulder[:, :, 2]
    raised = np.arccos(np.clip(-way[:, 2], -1.0, 1.0))
    lift = _GIRDLE * np.maximum(raised - np.pi / 6, 0.0)
    ahead = 0.2 * np.clip(way[:, 0] - 0.3 * sign * way[:, 1], -0.5, 1.0) * np.sin(raised)
    girdle = about(Z, -sign * ahead) @ about(X, sign * lift)
    track.local[:, bone(f"clavicle_{side}")] = girdle
    track.local[:, bone(f"upperarm_{side}")] = np.swapaxes(girdle, 1, 2) @ shoulder
    track.local[:, bone(f"lowerarm_{side}")] = about(Y, -np.asarray(elbow))
    bend = np.broadcast_to(np.asarray(wrist, np.float64), elbow.shape)
    track.local[:, bone(f"hand_{side}")] = about(X, -sign * bend)


def _trunk(body: Body, origin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Middle [2] and half the size [2] of the trunk, seen from above, from `origin` [m]."""
    rows, weight = body.weights
    inner = [i for i, name in enumerate(BONES) if name.startswith(("spine", "pelvis"))]
    share = np.where(np.isin(rows, inner), weight, 0.0).sum(axis=1)
    low, high = body.heads[0][2], body.heads[bone("upperarm_left")][2] - 0.05
    skin = body.vertices[(share > 0.9) & (body.vertices[:, 2] > low) & (body.vertices[:, 2] < high)]
    ends = np.quantile(skin[:, :2] - origin[:2], [0.02, 0.98], axis=0)
    return ends.mean(axis=0), 0.5 * (ends[1] - ends[0])
