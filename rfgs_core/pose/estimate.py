# SPDX-License-Identifier: Apache-2.0
"""Tracks and poses of all people of a run, from its moving Gaussians alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float64

from rfgs_core.articulated import people
from rfgs_core.bodies.body_prior import Bodies
from rfgs_core.errors import RfgsError
from rfgs_core.pose.body import index_of, joints_of
from rfgs_core.pose.fit import Cloud, fit_body, lying, standing
from rfgs_core.radio.levels import power_of
from rfgs_core.run import Run
from rfgs_core.run.limbs import Limbs, read_limbs
from rfgs_core.seeds import sub_seed
from rfgs_core.skeleton import JOINTS

#: Whose pelvis is lower above the floor than so many times the length of thigh and shin sits:
#: halfway between a chair and standing, for adults and children.
_LOW, _LEG = 0.84, ("hip", "knee", "ankle")
#: Slower people may walk any way [m/s].
WALKING_M_S = 0.3
#: Frames further apart than this say nothing about where somebody walks [s].
LONGEST_STEP_S = 2.0


def is_low(joints: Float64[np.ndarray, "17 3"], floor_m: float) -> bool:
    """Whether somebody sits or lies: the pelvis is lower than legs of this length bear standing."""
    legs = [
        np.linalg.norm(np.diff(joints[[JOINTS.index(f"{side}_{n}") for n in _LEG]], axis=0), axis=1)
        for side in ("left", "right")
    ]
    return bool(joints[0, 2] - floor_m < _LOW * np.sum(legs) / 2.0)


@dataclass(frozen=True)
class PoseEstimate:
    """What a run says about its people; a body keeps its place from frame to frame."""

    frames: list[int]
    """Frames."""
    time_s: Float64[np.ndarray, "frame"]
    """Their times [s]."""
    centroid: Float64[np.ndarray, "frame body 3"]
    """Centroid of each body's Gaussians [m]."""
    joints: Float64[np.ndarray, "frame body 17 3"]
    """Fitted joints [m]."""
    seated: Bool[np.ndarray, "frame body"]
    """Which bodies the run takes to sit or lie."""
    standing: Float64[np.ndarray, "frame body 17 3"]
    """Joints of the baseline: a standing body of average height at the same centroid, which
    looks where the track leads [m]."""
    sigma_m: Float64[np.ndarray, "frame body 17"] | None = None
    """How far each joint is expected to be off [m]; None where the network did not tell limbs."""
    heights_m: Float64[np.ndarray, "body"] | None = None
    """How tall everybody is, by the limbs that the network told; None where it did not [m]."""


def estimate_poses(run: Run, on_step: Callable[[], Any] = lambda: None) -> PoseEstimate:
    """People as the run's limbs have them, else one body fitted to each person's Gaussians.

    Raises:
        RfgsError: The run does not say which Gaussian belongs to whom.
    """
    if run.config.settings.start == "random":
        raise RfgsError(f"{run.path}: --start random knows of no people; train with --start prior")
    sequence = run.sequence
    floor_m = float(np.asarray(sequence.bounds_m)[0, 2])
    clouds = [_clouds(run, frame, floor_m) for frame in run.frames]
    time_s = np.array([sequence.time_s(frame) for frame in run.frames])
    centroid = np.array([[cloud.centre for cloud in row] for row in clouds])
    limbs = read_limbs(run.path)
    if limbs is not None:
        return _told(limbs, clouds, centroid, time_s, floor_m)
    joints = np.zeros((*centroid.shape[:2], 17, 3))
    baseline = np.zeros_like(joints)
    held = [_bodies(run, frame) for frame in run.frames]
    knees_rad = np.array([bodies.knees_rad for bodies in held])
    sits = np.isfinite(knees_rad)
    for body in range(centroid.shape[1]):
        headings = headings_of(time_s, centroid[:, body, :2])
        before = None
        for k, frame in enumerate(run.frames):
            cloud, seed = clouds[k][body], sub_seed(0, "pose", frame, body)
            elapsed_s = float(time_s[k] - time_s[k - 1]) if k else 0.0
            if sits[k, body]:
                headings[k] = [float(knees_rad[k, body])]
            if k and sits[k, body] != sits[k - 1, body]:
                # Limbs of another posture are no start for this one.
                before = None
            if held[k].lies[body]:
                parameters, before = lying(cloud, *held[k].ways[body]), None
            else:
                seated = bool(sits[k, body])
                found = fit_body(cloud, headings[k], before, elapsed_s, seed, seated=seated)
                parameters = before = found.parameters
            joints[k, body] = joints_of(parameters, floor_m)
            # Of a body at rest the baseline is told the fit's own heading.
            own = float(parameters[index_of("heading")])
            looks = headings[k][0] if len(headings[k]) == 1 else own
            baseline[k, body] = joints_of(standing(cloud, looks), floor_m)
            on_step()
    low = sits | np.array([bodies.lies for bodies in held])
    return PoseEstimate(list(run.frames), time_s, centroid, joints, low, baseline)


def _told(
    limbs: Limbs,
    clouds: list[list[Cloud]],
    centroid: Float64[np.ndarray, "frame body 3"],
    time_s: Float64[np.ndarray, "frame"],
    floor_m: float,
) -> PoseEstimate:
    """The poses that the Gaussians were drawn on."""
    joints = limbs.people.joints17()
    baseline = np.zeros_like(joints)
    for body in range(joints.shape[1]):
        ways = headings_of(time_s, centroid[:, body, :2])
        for k, looks in enumerate(ways):
            # Of a body at rest the baseline is told which way the pose faces.
            left = (
                joints[k, body, JOINTS.index("left_hip")]
                - joints[k, body, JOINTS.index("right_hip")]
            )
            own = float(np.arctan2(-left[0], left[1]))
            way = looks[0] if len(looks) == 1 else own
            baseline[k, body] = joints_of(standing(clouds[k][body], way), floor_m)
    seated = np.array([[is_low(person, floor_m) for person in frame] for frame in joints])
    shapes, sigma_m, heights_m = limbs.people.coefficients, limbs.joints.sigma_m, None
    # Evidence knows one shape, the mean, give or take rounding.
    if not np.allclose(shapes, 0.0):
        heights_m = np.array([people().body(shape).height_m for shape in shapes])
    return PoseEstimate(
        limbs.frames, time_s, centroid, joints, seated, baseline, sigma_m, heights_m
    )


def _bodies(run: Run, frame: int) -> Bodies:
    """How people hold themselves; all stand where the run does not tell."""
    found = run.bodies(frame)
    return Bodies.standing(np.zeros((run.config.settings.bodies, 2))) if found is None else found


def headings_of(
    time_s: Float64[np.ndarray, "frame"], track_xy: Float64[np.ndarray, "frame 2"]
) -> list[list[float]]:
    """Where somebody may look in each frame [rad]: along the track, or four ways at rest."""
    result = []
    for k in range(len(time_s)):
        first, last = max(k - 1, 0), min(k + 1, len(time_s) - 1)
        elapsed_s = float(time_s[last] - time_s[first])
        moved = track_xy[last] - track_xy[first]
        walks = 0.0 < elapsed_s <= LONGEST_STEP_S * (last - first)
        if walks and np.linalg.norm(moved) > WALKING_M_S * elapsed_s:
            result.append([float(np.arctan2(moved[1], moved[0]))])
        else:
            result.append([0.0, 0.5 * np.pi, np.pi, -0.5 * np.pi])
    return result


def _clouds(run: Run, frame: int, floor_m: float) -> list[Cloud]:
    """Moving Gaussians of a frame, one cloud per body."""
    attributes = run.attributes(frame)
    body, means = attributes["body"], run.moving(frame).means.numpy().astype(np.float64)
    power = power_of(attributes["rf_power_db"].astype(np.float64))
    clouds = []
    for number in range(run.config.settings.bodies):
        own = body == number
        if not own.any():
            raise RfgsError(
                f"{run.path}: no Gaussian of frame {frame} belongs to body {number}; train with "
                "more --gaussians"
            )
        clouds.append(Cloud(means[own], power[own], floor_m))
    return clouds
