# SPDX-License-Identifier: Apache-2.0
"""Fits one body to the Gaussians of one person in one frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64
from scipy.optimize import least_squares
from scipy.spatial import KDTree

from rfgs_core.pose.body import BONES, HIP, PARAMETERS, distance_to_bones, index_of, joints_of

#: Mean and standard deviation of each parameter before anything is seen; x, y and heading are
#: open. Heights of adults; angles of standing, walking and sitting people.
_PRIOR: dict[str, tuple[float, float]] = {
    "height": (1.70, 0.10),
    "sink": (0.03, 0.10),
    "pitch": (0.05, 0.15),
    "roll": (0.0, 0.10),
    **dict.fromkeys(("left_hip", "right_hip"), (0.0, 0.4)),
    **dict.fromkeys(("left_knee", "right_knee"), (0.3, 0.4)),
    **dict.fromkeys(("left_shoulder", "right_shoulder"), (0.0, 0.4)),
    **dict.fromkeys(("left_elbow", "right_elbow"), (0.4, 0.4)),
}
#: What is otherwise of who sits on a chair, thighs level and shins upright.
_SEATED: dict[str, tuple[float, float]] = {
    "sink": (0.40, 0.10),
    **dict.fromkeys(("left_hip", "right_hip", "left_knee", "right_knee"), (1.5, 0.3)),
}
_LIMITS: dict[str, tuple[float, float]] = {
    "height": (1.0, 2.2),
    "sink": (-0.1, 0.9),
    "pitch": (-0.6, 1.4),
    "roll": (-0.6, 0.6),
    **dict.fromkeys(("left_hip", "right_hip"), (-0.8, 1.8)),
    **dict.fromkeys(("left_knee", "right_knee"), (0.0, 2.2)),
    **dict.fromkeys(("left_shoulder", "right_shoulder"), (-1.2, 2.8)),
    **dict.fromkeys(("left_elbow", "right_elbow"), (0.0, 2.4)),
}
#: Distance between a Gaussian and the body's surface that is nothing unusual, first to bring limbs
#: near and then to place them [m].
SURFACE_M = (0.25, 0.06)
#: Distance between a bone and the nearest Gaussian that is nothing unusual [m].
COVER_M = 0.10
#: Points of the cloud that a fit looks at.
MAX_POINTS = 400
#: Weight of all points together against one parameter's prior, in points: Gaussians of one
#: cloud are no independent measurements.
EVIDENCE = 60.0
#: A pose says this much about the next one: its weight falls by e in this time [s].
MEMORY_S = 0.3


@dataclass(frozen=True)
class Cloud:
    """Gaussians of one person in one frame."""

    points: Float64[np.ndarray, "point 3"]
    """Centres [m]."""
    power: Float64[np.ndarray, "point"]
    """Reflected powers, any unit."""
    floor_m: float
    """Height of the floor [m]."""

    @property
    def centre(self) -> Float64[np.ndarray, "3"]:
        """Centroid [m]: of the positions, as powers speckle."""
        return self.points.mean(axis=0)


@dataclass(frozen=True)
class FittedBody:
    """Parameters of a body and how badly it fits."""

    parameters: Float64[np.ndarray, "15"]
    """As `body.PARAMETERS`."""
    cost: float
    """Half the sum of squared residuals."""


def standing(cloud: Cloud, heading: float) -> Float64[np.ndarray, "15"]:
    """A standing body of average height at the cloud's centroid: the baseline of every fit."""
    values = {name: mean for name, (mean, _) in _PRIOR.items()}
    values |= {"x": cloud.centre[0], "y": cloud.centre[1], "heading": heading}
    values |= dict.fromkeys(("sink", "pitch", "left_knee", "right_knee"), 0.0)
    values |= dict.fromkeys(("left_elbow", "right_elbow"), 0.0)
    return np.array([values[name] for name in PARAMETERS])


def lying(cloud: Cloud, way_rad: float, height_m: float) -> Float64[np.ndarray, "15"]:
    """A straight body of average height that lies at the cloud's centroid.

    Args:
        cloud: Its Gaussians.
        way_rad: Where the head points, from x towards y [rad].
        height_m: Of its middle above the floor [m].
    """
    tall = _PRIOR["height"][0]
    pelvis = cloud.centre[:2] + (HIP - 0.5) * tall * np.array([np.cos(way_rad), np.sin(way_rad)])
    values = {"x": pelvis[0], "y": pelvis[1], "height": tall, "heading": way_rad}
    values |= {"sink": HIP * tall - height_m, "pitch": 0.5 * np.pi}
    # Legs and arms point to where the feet are.
    values |= dict.fromkeys(("left_hip", "right_hip"), -0.5 * np.pi)
    values |= dict.fromkeys(("left_shoulder", "right_shoulder"), -0.5 * np.pi)
    return np.array([values.get(name, 0.0) for name in PARAMETERS])


def fit_body(
    cloud: Cloud,
    headings: list[float],
    before: Float64[np.ndarray, "15"] | None = None,
    elapsed_s: float = 0.0,
    seed: int = 0,
    *,
    seated: bool = False,
) -> FittedBody:
    """The body that lies closest to a cloud, by robust least squares from several headings.

    Args:
        cloud: What to fit.
        headings: Where the body may look [rad]; the best start wins.
        before: Parameters in an earlier frame; its limbs pull the prior towards them.
        elapsed_s: Time since then [s].
        seed: Seed of the choice of points.
        seated: Whether the body is known to sit.
    """
    chosen = np.random.default_rng(seed).permutation(len(cloud.points))[:MAX_POINTS]
    weight = cloud.power[chosen] ** 0.25
    points, weight = cloud.points[chosen], np.sqrt(EVIDENCE * weight / weight.sum())
    tree = KDTree(points)
    mean, deviation = _prior(before, elapsed_s, seated)
    closed = np.isfinite(deviation)

    def residuals(
        parameters: Float64[np.ndarray, "15"], surface_m: float
    ) -> Float64[np.ndarray, "residual"]:
        joints = joints_of(parameters, cloud.floor_m)
        near = distance_to_bones(points, joints).min(axis=1) / surface_m
        covered, _ = tree.query(_along_bones(joints))
        covered = np.sqrt(EVIDENCE / len(covered)) * np.arctan(covered / COVER_M)
        pulled = (parameters - mean)[closed] / deviation[closed]
        return np.concatenate([weight * np.arctan(near), covered, pulled])

    best = FittedBody(standing(cloud, headings[0]), np.inf)
    low, high = _bounds()
    for heading in headings:
        start, limbs = standing(cloud, heading), index_of("sink")
        if before is not None:
            start[limbs:] = before[limbs:]
        elif seated:
            start[limbs:] = mean[limbs:]
        cost = np.inf
        for surface_m in SURFACE_M:
            start = np.clip(start, low + 1e-6, high - 1e-6)
            found = least_squares(
                residuals, start, bounds=(low, high), max_nfev=40, args=(surface_m,)
            )
            start, cost = found.x, float(found.cost)
        if cost < best.cost:
            best = FittedBody(start, cost)
    return best


def _along_bones(joints: Float64[np.ndarray, "17 3"]) -> Float64[np.ndarray, "sample 3"]:
    """Three points on every bone [m]."""
    start, end = joints[BONES[:, 0]], joints[BONES[:, 1]]
    share = np.array([0.25, 0.6, 1.0])[:, None, None]
    return (start + share * (end - start)).reshape(-1, 3)


def _prior(
    before: Float64[np.ndarray, "15"] | None, elapsed_s: float, seated: bool
) -> tuple[Float64[np.ndarray, "15"], Float64[np.ndarray, "15"]]:
    """Mean and standard deviation of every parameter, infinite where nothing is known."""
    known = _PRIOR | (_SEATED if seated else {})
    pairs = [known.get(name, (0.0, np.inf)) for name in PARAMETERS]
    mean, deviation = (np.array(values) for values in zip(*pairs, strict=True))
    if before is not None:
        kept = np.exp(-elapsed_s / MEMORY_S) * np.isfinite(deviation)
        mean = mean + kept * (before - mean)
    return mean, deviation


def _bounds() -> tuple[Float64[np.ndarray, "15"], Float64[np.ndarray, "15"]]:
    pairs = [_LIMITS.get(name, (-np.inf, np.inf)) for name in PARAMETERS]
    low, high = zip(*pairs, strict=True)
    return np.array(low), np.array(high)
