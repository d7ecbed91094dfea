# SPDX-License-Identifier: Apache-2.0
"""Who goes somewhere looks there, their arms hanging, as far as the network is not surer otherwise.

The network looks at single frames and does not know who goes. Now and then it takes a back for a
front. Beside other people it is unsure which way somebody faces, and bends arms to where something
is left of these, of which it is surer than it should be.
"""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Bool, Float64

from rfgs_core.articulated import people
from rfgs_core.limbs.evidence.library import about_z, headings_of
from rfgs_core.limbs.evidence.library import upright as standing
from rfgs_core.limbs.evidence.track import GOES_M_S, course_of
from rfgs_core.limbs.propose import Joints, combined
from rfgs_core.limbs.tokens import MIRRORED
from rfgs_core.skeleton import JOINTS

_PELVIS = JOINTS.index("pelvis")
#: Whose hips are as fast as this, and no faster, goes somewhere [m/s]: who climbs or crawls is
#: slower, and a place found wrongly jumps.
_GOES_M_S, _FASTEST_M_S = 0.6, 3.0
#: How far off the network's headings are for each metre that it expects joints to be [rad/m]: in
#: random worlds three of single people, three and five of several.
_HEADING_RAD_M = 5.0
#: How far hips and shoulders turn from the way in a gait [rad].
_GAIT_RAD = 0.2
#: How many of those who go do not look there, and how far the others' headings are off [rad].
_ASTRAY, _HEADED_RAD = 0.03, 0.5
#: How far elbows and wrists of who goes are from hanging [m].
_SWING_M = {"elbow": 0.07, "wrist": 0.12}
#: As much farther they may be for each second before somebody goes and after that [m].
_FARTHER_M_S = 0.1
#: What it costs to take the network's front for a back [nat]: so it errs in 5 of 120 frames of
#: random worlds.
_TURNED = 3.0
#: How fast people turn [rad/s], how far off headings are from frame to frame [rad], and what any
#: turn costs at most [nat].
_TURNS_RAD_S, _OFF_RAD, _ANY_TURN = 2.0, 0.35, 8.0


def fronts(joints: Joints, time_s: Float64[np.ndarray, "frame"]) -> Joints:
    """Joints of one person whose back is not taken for a front in single frames.

    Left and right exchanged in place, somebody who is upright looks the other way. The likeliest
    way through all frames (Viterbi, IEEE Transactions on Information Theory 13(2), 1967) does that
    where it costs less than to turn around in between or to go backwards.

    Args:
        joints: Of all frames, shape (frame, 1, 17, ·).
        time_s: Their times [s].

    Returns:
        The same, turned where that is likelier. Who walks backwards all the time is turned, too.
    """
    xyz = joints.xyz[:, 0]
    both = headings_of(xyz)[:, None] + [0.0, np.pi]
    course, speed_m_s = course_of(xyz[:, _PELVIS, :2], time_s)
    goes = np.clip(speed_m_s / GOES_M_S - 1.0, 0.0, 1.0) * (speed_m_s <= _FASTEST_M_S)
    off = np.angle(np.exp(1j * (course[:, None] - both)))
    ahead = np.exp(-0.5 * (off / _HEADED_RAD) ** 2) / (math.sqrt(2 * math.pi) * _HEADED_RAD)
    astray = np.log(ahead + _ASTRAY / (2 * math.pi))
    cost = goes[:, None] * (astray.max(axis=1, keepdims=True) - astray)
    cost[:, 1] += np.where(upright(xyz), _TURNED, np.inf)
    total, back = cost[0], []
    for frame in range(1, len(xyz)):
        turn = np.angle(np.exp(1j * (both[frame] - both[frame - 1][:, None])))
        scale = _TURNS_RAD_S * (time_s[frame] - time_s[frame - 1]) + _OFF_RAD
        way = total[:, None] + np.minimum(0.5 * (turn / scale) ** 2, _ANY_TURN)
        back.append(way.argmin(axis=0))
        total = way.min(axis=0) + cost[frame]
    path = [int(total.argmin())]
    for came_from in reversed(back):
        path.append(int(came_from[path[-1]]))
    turned = np.array(path[::-1], dtype=bool)[:, None, None]
    return Joints(
        np.where(turned[..., None], joints.xyz[:, :, MIRRORED], joints.xyz),
        np.where(turned, joints.sigma_m[:, :, MIRRORED], joints.sigma_m),
    )


def facing(joints: Joints, time_s: Float64[np.ndarray, "frame"]) -> Joints:
    """Joints of one person, turned to where they go as far as they may be off.

    The way that somebody faces is normal around where they go, and around what is said of it;
    where both are too far apart, somebody goes backwards or sideways and is left alone.

    Args:
        joints: Of all frames, shape (frame, 1, 17, ·).
        time_s: Their times [s].

    Returns:
        The same for somebody who goes nowhere.
    """
    xyz, sigma_m = joints.xyz[:, 0].copy(), joints.sigma_m[:, 0]
    course, speed_m_s, goes = _going(xyz, time_s)
    off = np.angle(np.exp(1j * (course - headings_of(xyz))))
    for frame in np.flatnonzero(goes):
        said_rad = _HEADING_RAD_M * float(sigma_m[frame].mean())
        near = time_s[max(frame - 1, 0) : frame + 2]
        way_m = speed_m_s[frame] * (near[-1] - near[0])
        course_rad = math.hypot(_GAIT_RAD, float(sigma_m[frame, _PELVIS]) / way_m)
        both_rad = math.hypot(said_rad, course_rad)
        ahead = math.exp(-0.5 * (off[frame] / both_rad) ** 2) / (math.sqrt(2 * math.pi) * both_rad)
        if ahead < _ASTRAY / (2 * math.pi):
            continue
        turn = about_z(off[frame] * (said_rad / both_rad) ** 2)
        middle = xyz[frame].mean(axis=0)
        xyz[frame] = (xyz[frame] - middle) @ turn.T + middle
    return Joints(xyz[:, None], joints.sigma_m)


def hanging(joints: Joints, time_s: Float64[np.ndarray, "frame"]) -> Joints:
    """Joints of one person, their arms hanging if they go somewhere upright and arms are unsure.

    Args:
        joints: Of all frames, shape (frame, 1, 17, ·).
        time_s: Their times [s].

    Returns:
        The same for somebody who goes nowhere.
    """
    xyz = joints.xyz[:, 0]
    _, _, goes = _going(xyz, time_s)
    if not goes.any():
        return joints
    stands = upright(xyz)
    since_s = np.abs(time_s[:, None] - time_s[goes]).min(axis=1)
    own = people().body(np.zeros(0))
    rest = own.joints17(standing(own))
    turns = np.array([about_z(heading) for heading in headings_of(xyz) - headings_of(rest[None])])
    hang, sigma_m = xyz.copy(), np.full(xyz.shape[:2], np.inf)
    for joint, name in enumerate(JOINTS):
        side, _, part = name.partition("_")
        if part in _SWING_M:
            shoulder = JOINTS.index(f"{side}_shoulder")
            hang[:, joint] = xyz[:, shoulder] + turns @ (rest[joint] - rest[shoulder])
            sigma_m[stands, joint] = _SWING_M[part] + _FARTHER_M_S * since_s[stands]
    return combined(joints, Joints(hang[:, None], sigma_m[:, None]))


def upright(xyz: Float64[np.ndarray, "pose 17 3"]) -> Bool[np.ndarray, "pose"]:
    """Whose trunk is less than 45° from the vertical."""
    trunk = xyz[:, JOINTS.index("thorax")] - xyz[:, _PELVIS]
    return trunk[:, 2] > np.sqrt(0.5) * np.linalg.norm(trunk, axis=1)


def _going(
    xyz: Float64[np.ndarray, "frame 17 3"], time_s: Float64[np.ndarray, "frame"]
) -> tuple[Float64[np.ndarray, "frame"], Float64[np.ndarray, "frame"], Bool[np.ndarray, "frame"]]:
    """Which way hips go [rad], how fast [m/s], and in which frames somebody goes upright."""
    course, speed_m_s = course_of(xyz[:, _PELVIS, :2], time_s)
    goes = upright(xyz) & (speed_m_s >= _GOES_M_S) & (speed_m_s <= _FASTEST_M_S)
    return course, speed_m_s, goes
