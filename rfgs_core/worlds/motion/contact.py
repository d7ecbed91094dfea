# SPDX-License-Identifier: Apache-2.0
"""What touches the floor stays where it is and so carries the body along."""

from __future__ import annotations

import numpy as np

from rfgs_core.articulated import Body
from rfgs_core.articulated.bones import bone
from rfgs_core.worlds.motion.track import SIDES, Track

#: Of points of a foot within so much height of the lowest, all bear [m].
_TOUCH_M = 0.006


def sole_points(body: Body, side: str) -> np.ndarray:
    """Heel, ball and toes of a foot on the floor at rest [m], shape [3, 3]."""
    rows, weight = body.weights
    share = np.where(rows == bone(f"foot_{side}"), weight, 0.0).sum(axis=1)
    low = body.vertices[(share > 0.7) & (body.vertices[:, 2] < 0.03)]
    heel, toe = low[:, 0].min() + 0.015, low[:, 0].max() - 0.015
    y = low[:, 1].mean()
    return np.array([[x, y, 0.0] for x in (heel, heel + 0.7 * (toe - heel), toe)])


def soles(track: Track, side: str, world: np.ndarray, heads: np.ndarray) -> np.ndarray:
    """Heel, ball and toes of a foot over time [m], shape [T, 3, 3]."""
    foot = bone(f"foot_{side}")
    own = sole_points(track.body, side) - track.body.heads[foot]
    return heads[:, foot, None] + np.einsum("tij,pj->tpi", world[:, foot], own)


def bearing_soles(track: Track, bears: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Points of both soles [T, 6, 3], and how much each of them bears [T, 6].

    Args:
        track: Whose feet.
        bears: How much each foot bears, from 0 to 1, shape [T].
    """
    world = track.world()
    heads = track.heads(world)
    points, weight = [], []
    for side in SIDES:
        own = soles(track, side, world, heads)
        share = np.exp((own[:, :, 2].min(axis=1, keepdims=True) - own[:, :, 2]) / _TOUCH_M)
        share /= share.sum(axis=1, keepdims=True)
        points.append(own)
        weight.append(share * np.maximum(bears[side], 1e-6)[:, None])
    return np.concatenate(points, axis=1), np.concatenate(weight, axis=1)


def lowest_bears(track: Track) -> dict[str, np.ndarray]:
    """How much each foot bears if the lower one does [T], from 0 to 1."""
    world = track.world()
    heads = track.heads(world)
    low = {side: soles(track, side, world, heads)[:, :, 2].min(axis=1) for side in SIDES}
    left = 1.0 / (1.0 + np.exp(np.clip((low["left"] - low["right"]) / 0.01, -50, 50)))
    return {"left": left, "right": 1.0 - left}


def carried(points: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Where the root goes on the floor [T, 2] if points that bear stay where they are.

    Args:
        points: Points that may bear, with the root held at one place [m], shape [T, P, 3].
        weight: How much each bears, shape [T, P].
    """
    share = weight / weight.sum(axis=1, keepdims=True)
    step = np.diff(points[:, :, :2], axis=0)
    mean = 0.5 * (share[1:] + share[:-1])
    path = np.zeros((len(points), 2))
    path[1:] = -np.cumsum(np.sum(mean[:, :, None] * step, axis=1), axis=0)
    return path
