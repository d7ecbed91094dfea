# SPDX-License-Identifier: GPL-3.0-or-later
"""Analytic inverse kinematics of limbs with two bones."""

from __future__ import annotations

import numpy as np

from blender_scenes.motion.rotations import frame_between

#: A limb is never stretched further than this share of its length.
REACH = 0.999


def solve_limb(
    rest: np.ndarray,
    rest_hinge: np.ndarray,
    start: np.ndarray,
    target: np.ndarray,
    towards: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, float]:
    """Rotations of both bones that bring a limb's end to `target`.

    Args:
        rest: Start, middle and end joint in the rest pose [m], shape (3, 3).
        rest_hinge: Axis that the middle joint bends about, in the rest pose, shape (3,).
        start: Where the limb starts [m], shape (3,).
        target: Where it shall end [m]; out of reach, it points there nearly straight.
        towards: Direction that the middle joint points to, shape (3,).

    Returns:
        Rotations from rest to world of the upper and the lower bone, and how far the limb
        is stretched, 1 being straight and more out of reach.
    """
    upper = np.linalg.norm(rest[1] - rest[0])
    lower = np.linalg.norm(rest[2] - rest[1])
    reach = target - start
    distance = np.linalg.norm(reach)
    stretch = float(distance / (upper + lower))
    down = reach / distance
    if stretch > 1.0:
        distance = REACH * (upper + lower)
        target = start + distance * down
    ahead = towards - down * (towards @ down)
    ahead /= np.linalg.norm(ahead)
    along = (distance**2 + upper**2 - lower**2) / (2 * distance)
    out = np.sqrt(max(upper**2 - along**2, 0.0))
    middle = start + along * down + out * ahead
    hinge = np.cross(ahead, down)
    return (
        frame_between(rest[1] - rest[0], rest_hinge, middle - start, hinge),
        frame_between(rest[2] - rest[1], rest_hinge, target - middle, hinge),
        stretch,
    )
