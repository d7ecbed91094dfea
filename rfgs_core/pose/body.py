# SPDX-License-Identifier: Apache-2.0
"""A body of few parameters: 17 joints of average proportions, bones with a thickness.

Lengths are shares of the standing height after Drillis and Contini (1966), as tabulated by
Winter, Biomechanics and Motor Control of Human Movement (2009), figure 4.1.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from rfgs_core.skeleton import JOINTS, PARENTS

#: Parameters in their order; lengths in metres, angles in radians.
PARAMETERS: tuple[str, ...] = (
    "x", "y", "height", "heading", "sink", "pitch", "roll", "left_hip", "right_hip", "left_knee",
    "right_knee", "left_shoulder", "right_shoulder", "left_elbow", "right_elbow",
)  # fmt: skip

#: Heights above the floor and half widths of a standing body, shares of its height.
HIP, KNEE, ANKLE, SHOULDER, NECK, HEAD = 0.530, 0.285, 0.039, 0.818, 0.870, 0.936
HALF_HIPS, HALF_SHOULDERS = 0.0955, 0.1295
UPPER_ARM, FOREARM = 0.186, 0.146

#: Bones as pairs of joints: every joint with its parent.
BONES = np.array([(parent, joint) for joint, parent in enumerate(PARENTS) if parent >= 0])
_THICK = {
    **dict.fromkeys(("spine", "thorax"), 0.13),
    **dict.fromkeys(("left_hip", "right_hip", "left_shoulder", "right_shoulder"), 0.08),
    **dict.fromkeys(("left_knee", "right_knee", "head"), 0.07),
    **dict.fromkeys(("left_ankle", "right_ankle", "neck"), 0.05),
    **dict.fromkeys(("left_elbow", "right_elbow", "left_wrist", "right_wrist"), 0.04),
}
#: Radius of the body around each bone [m].
RADIUS_M = np.array([_THICK[JOINTS[joint]] for _, joint in BONES])

_INDEX = {name: index for index, name in enumerate(PARAMETERS)}


def index_of(name: str) -> int:
    """Place of a parameter."""
    return _INDEX[name]


def joints_of(parameters: Float64[np.ndarray, "15"], floor_m: float) -> Float64[np.ndarray, "17 3"]:
    """Joints of a body [m].

    Args:
        parameters: As `PARAMETERS`. `sink` is how far the pelvis is below that of a standing
            body [m]; pitch and roll lean the trunk forward and to the left; hips and shoulders
            swing forward, knees bend backward, elbows forward.
        floor_m: Height of the floor [m].
    """
    p = dict(zip(PARAMETERS, parameters, strict=True))
    size = p["height"]
    ahead = np.array([np.cos(p["heading"]), np.sin(p["heading"]), 0.0])
    left = np.array([-ahead[1], ahead[0], 0.0])
    up = np.array([0.0, 0.0, 1.0])
    trunk = up * np.cos(p["pitch"]) * np.cos(p["roll"])
    trunk += ahead * np.sin(p["pitch"]) + left * np.sin(p["roll"]) * np.cos(p["pitch"])
    found = {"pelvis": np.array([p["x"], p["y"], floor_m + HIP * size - p["sink"]])}
    found["thorax"] = found["pelvis"] + (SHOULDER - HIP) * size * trunk
    found["spine"] = 0.5 * (found["pelvis"] + found["thorax"])
    found["neck"] = found["pelvis"] + (NECK - HIP) * size * trunk
    found["head"] = found["pelvis"] + (HEAD - HIP) * size * trunk
    for side, sign in (("left", 1.0), ("right", -1.0)):
        hip = found["pelvis"] + sign * HALF_HIPS * size * left
        knee = hip + (HIP - KNEE) * size * _swung(p[f"{side}_hip"], ahead)
        shank = p[f"{side}_hip"] - p[f"{side}_knee"]
        ankle = knee + (KNEE - ANKLE) * size * _swung(shank, ahead)
        shoulder = found["thorax"] + sign * HALF_SHOULDERS * size * left
        elbow = shoulder + UPPER_ARM * size * _swung(p[f"{side}_shoulder"], ahead)
        forearm = p[f"{side}_shoulder"] + p[f"{side}_elbow"]
        wrist = elbow + FOREARM * size * _swung(forearm, ahead)
        names = ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")
        places = (hip, knee, ankle, shoulder, elbow, wrist)
        found |= {f"{side}_{name}": place for name, place in zip(names, places, strict=True)}
    return np.stack([found[name] for name in JOINTS])


def _swung(angle: float, ahead: Float64[np.ndarray, "3"]) -> Float64[np.ndarray, "3"]:
    """Direction of a limb that hangs at angle 0 and points ahead at a quarter turn."""
    return np.sin(angle) * ahead - np.array([0.0, 0.0, np.cos(angle)])


def distance_to_bones(
    points: Float64[np.ndarray, "point 3"], joints: Float64[np.ndarray, "17 3"]
) -> Float64[np.ndarray, "point bone"]:
    """Distance of each point to the surface around each bone [m], negative inside."""
    start, along = joints[BONES[:, 0]], joints[BONES[:, 1]] - joints[BONES[:, 0]]
    offset = points[:, None] - start
    length2 = np.maximum(np.sum(along**2, axis=1), 1e-12)
    share = np.clip(np.sum(offset * along, axis=2) / length2, 0.0, 1.0)
    return np.linalg.norm(offset - share[..., None] * along, axis=2) - RADIUS_M
