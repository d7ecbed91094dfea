# SPDX-License-Identifier: Apache-2.0
"""The likeliest poses through a sequence, out of the best guesses of each frame.

Nobody jumps from one pose into another between two frames, and who goes somewhere looks there.
The path of largest evidence and of likely motion is that of Viterbi (IEEE Transactions on
Information Theory 13(2), 1967); around it guesses have their mean, since the very best of them is
so by chance.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64, Int64

from rfgs_core.limbs.evidence.library import headings_of
from rfgs_core.limbs.evidence.track import GOES_M_S

#: Evidence counts a share of this: models err more than evidence knows of.
TEMPER = 1.0 / 15.0
#: Joints move by about this per second, and by this from one guess at a pose to another [m].
_SPEED_M_S, _APART_M = 0.8, 0.08
#: What it costs to move so far [nat].
_COST = 4.0
#: What it costs to go backwards at twice `GOES_M_S` or more [nat].
_BACKWARDS = 16.0
#: Guesses within this of the path count as the same pose [m].
_SAME_M = 0.2


def likeliest_path(
    score: list[Float64[np.ndarray, "guess"]],
    joints: list[Float64[np.ndarray, "guess 17 3"]],
    time_s: Float64[np.ndarray, "frame"],
) -> Int64[np.ndarray, "frame"]:
    """Which guess of each frame is on the likeliest path.

    Args:
        score: Evidence of the guesses of each frame [nat].
        joints: Their joints [m].
        time_s: When frames were taken [s].
    """
    total, back = TEMPER * score[0], []
    for frame in range(1, len(score)):
        elapsed_s = float(time_s[frame] - time_s[frame - 1])
        away = _between(joints[frame - 1], joints[frame]) / (_SPEED_M_S * elapsed_s + _APART_M)
        astray = _astray(joints[frame - 1], joints[frame], elapsed_s)
        before = total[:, None] - _COST * away**2 - astray
        back.append(before.argmax(axis=0))
        total = before.max(axis=0) + TEMPER * score[frame]
    path = [int(total.argmax())]
    for came_from in reversed(back):
        path.append(int(came_from[path[-1]]))
    return np.array(path[::-1], dtype=np.int64)


def _astray(
    one: Float64[np.ndarray, "a 17 3"], other: Float64[np.ndarray, "b 17 3"], elapsed_s: float
) -> Float64[np.ndarray, "a b"]:
    """What it costs to go from poses to others without looking there [nat]."""
    way = other[None, :, 0, :2] - one[:, None, 0, :2]
    speed_m_s = np.linalg.norm(way, axis=2) / elapsed_s
    goes = np.clip(speed_m_s / GOES_M_S - 1.0, 0.0, 1.0)
    ahead = np.arctan2(way[..., 1], way[..., 0])
    off = (np.cos(ahead - headings_of(one)[:, None]) + np.cos(ahead - headings_of(other))) / 2.0
    return _BACKWARDS * goes * (1.0 - off) / 2.0


def around(
    score: Float64[np.ndarray, "guess"],
    joints: Float64[np.ndarray, "guess 17 3"],
    on_path: int,
) -> tuple[Float64[np.ndarray, "17 3"], Float64[np.ndarray, "17"]]:
    """Mean joints of the guesses around the path in one frame, and how far they scatter [m]."""
    near = _between(joints[[on_path]], joints)[0] <= _SAME_M
    weight = np.exp(TEMPER * (score[near] - score[near].max()))
    weight /= weight.sum()
    mean = np.einsum("g,gjx->jx", weight, joints[near])
    off2 = np.sum((joints[near] - mean) ** 2, axis=2)
    return mean, np.sqrt(weight @ off2)


def _between(
    one: Float64[np.ndarray, "a 17 3"], other: Float64[np.ndarray, "b 17 3"]
) -> Float64[np.ndarray, "a b"]:
    """Mean distance of the joints of poses [m]."""
    return np.linalg.norm(one[:, None] - other[None], axis=3).mean(axis=2)
