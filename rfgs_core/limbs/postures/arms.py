# SPDX-License-Identifier: Apache-2.0
"""Arms of people who go somewhere: they hang, as far as the network is not surer of something else.

The network looks at single frames and does not know who goes. Beside other people it bends arms to
where something is left of these, and is surer of it than it should be.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float64

from rfgs_core.articulated import people
from rfgs_core.limbs.evidence.library import about_z, headings_of, upright
from rfgs_core.limbs.evidence.track import course_of
from rfgs_core.limbs.propose import Joints, combined
from rfgs_core.skeleton import JOINTS

#: Whose hips are as fast as this, and no faster, goes somewhere [m/s]: who climbs or crawls is
#: slower, and a place found wrongly jumps.
_GOES_M_S, _FASTEST_M_S = 0.6, 3.0
#: How far elbows and wrists of who goes are from hanging [m].
_SWING_M = {"elbow": 0.07, "wrist": 0.12}
#: As much farther they may be for each second before somebody goes and after that [m].
_FARTHER_M_S = 0.1


def hanging(joints: Joints, time_s: Float64[np.ndarray, "frame"]) -> Joints:
    """Joints of one person, their arms hanging if they go somewhere upright and arms are unsure.

    Args:
        joints: Of all frames, shape (frame, 1, 17, ·).
        time_s: Their times [s].

    Returns:
        The same for somebody who goes nowhere.
    """
    xyz = joints.xyz[:, 0]
    _, speed_m_s = course_of(xyz[:, JOINTS.index("pelvis"), :2], time_s)
    stands = _upright(xyz)
    goes = stands & (speed_m_s >= _GOES_M_S) & (speed_m_s <= _FASTEST_M_S)
    if not goes.any():
        return joints
    since_s = np.abs(time_s[:, None] - time_s[goes]).min(axis=1)
    own = people().body(np.zeros(0))
    rest = own.joints17(upright(own))
    turns = np.array([about_z(heading) for heading in headings_of(xyz) - headings_of(rest[None])])
    hang, sigma_m = xyz.copy(), np.full(xyz.shape[:2], np.inf)
    for joint, name in enumerate(JOINTS):
        side, _, part = name.partition("_")
        if part in _SWING_M:
            shoulder = JOINTS.index(f"{side}_shoulder")
            hang[:, joint] = xyz[:, shoulder] + turns @ (rest[joint] - rest[shoulder])
            sigma_m[stands, joint] = _SWING_M[part] + _FARTHER_M_S * since_s[stands]
    return combined(joints, Joints(hang[:, None], sigma_m[:, None]))


def _upright(xyz: Float64[np.ndarray, "frame 17 3"]) -> Bool[np.ndarray, "frame"]:
    """Whose trunk is less than 45° from the vertical."""
    trunk = xyz[:, JOINTS.index("thorax")] - xyz[:, JOINTS.index("pelvis")]
    return trunk[:, 2] > np.sqrt(0.5) * np.linalg.norm(trunk, axis=1)
