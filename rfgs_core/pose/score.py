# SPDX-License-Identifier: Apache-2.0
"""Estimated people held against the true ones: joint errors, tracks and identities."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Float64, Int64
from scipy.optimize import linear_sum_assignment

from rfgs_core.articulated import fit_shape, people
from rfgs_core.dataset import Sequence
from rfgs_core.pose.confidence import confidence, joints_seen
from rfgs_core.pose.estimate import PoseEstimate, is_low
from rfgs_core.skeleton import JOINTS

#: A body further than this from everybody has lost its person [m].
LOST_M = 0.5


def score_poses(estimate: PoseEstimate, sequence: Sequence) -> dict[str, Any]:
    """Errors of joints and tracks, beside the standing baseline.

    Bodies are matched to people frame by frame by the distance on the ground between pelvis and
    pelvis. `mpjpe_m` is the mean distance per joint, `aligned_m` the same with pelvis on pelvis,
    `people_m` that of each person who was matched, in the sequence's order; they are those of
    `matched` of the `people`, each counted in every frame; `heights_m` how tall
    each of these is said to be, `true_heights_m` how tall by their true limbs;
    `identity_kept` is the share of matches with the person that a body had at first, and
    `tracked` the share of people with their body within half a metre. `posture_right` is the share
    of matches of which the run says rightly whether they sit or lie, `seated` the number who do.
    `joints_seen` is the share of frames and bodies in which each joint counts as seen, and
    `confidence` whether joints are as far off as is expected; both None where limbs were not told.
    Values are None where no joint is known.
    """
    truth = [sequence.joints(frame).astype(np.float64) for frame in estimate.frames]
    matches = [_matched(estimate.joints[k], true) for k, true in enumerate(truth)]
    present = sum(int(np.isfinite(true[:, 0]).all(axis=1).sum()) for true in truth)
    result: dict[str, Any] = {"frames": len(estimate.frames), "people": present}
    result["matched"] = sum(len(row) for row in matches)
    for name, joints in (("fit", estimate.joints), ("standing", estimate.standing)):
        result[name] = _errors(joints, truth, matches)
    distance = [
        np.linalg.norm(estimate.joints[k, body, 0, :2] - truth[k][person, 0, :2])
        for k, row in enumerate(matches)
        for body, person in row
    ]
    result |= _heights(estimate.heights_m, truth, matches)
    sigma_m = estimate.sigma_m
    result["joints_seen"] = None if sigma_m is None else joints_seen(sigma_m)
    result["confidence"] = None if sigma_m is None else _confidence(estimate, truth, matches)
    result["tracked"] = float(np.sum(np.array(distance) < LOST_M) / present) if present else None
    result["identity_kept"] = identity_kept([[(int(b), int(p)) for b, p in row] for row in matches])
    floor_m = float(np.asarray(sequence.bounds_m)[0, 2])
    sits = [
        (estimate.seated[k, body], is_low(truth[k][person], floor_m))
        for k, row in enumerate(matches)
        for body, person in row
    ]
    result["posture_right"] = float(np.mean([a == b for a, b in sits])) if sits else None
    result["seated"] = int(sum(true for _, true in sits))
    return result


def _matched(
    joints: Float64[np.ndarray, "body 17 3"], truth: Float64[np.ndarray, "person 17 3"]
) -> Int64[np.ndarray, "match 2"]:
    """Body and person of each match."""
    known = np.flatnonzero(np.isfinite(truth[:, 0]).all(axis=1))
    offset = joints[:, None, 0, :2] - truth[known, 0, :2]
    body, person = linear_sum_assignment(np.linalg.norm(offset, axis=2))
    return np.stack([body, known[person]], axis=1)


def _errors(
    joints: Float64[np.ndarray, "frame body 17 3"],
    truth: list[Float64[np.ndarray, "person 17 3"]],
    matches: list[Int64[np.ndarray, "match 2"]],
) -> dict[str, Any]:
    """Mean errors, as they are and with the pelvis in place, of each joint and of each person."""
    offsets = [
        joints[k, body] - truth[k][person] for k, row in enumerate(matches) for body, person in row
    ]
    if not offsets:
        return {"mpjpe_m": None, "aligned_m": None, "joints_m": None, "people_m": None}
    offset, whose = np.array(offsets), np.concatenate(matches)[:, 1]
    each = np.linalg.norm(offset, axis=2)
    aligned = np.linalg.norm(offset - offset[:, :1], axis=2)
    return {
        "mpjpe_m": float(each.mean()),
        "aligned_m": float(aligned.mean()),
        "joints_m": {name: float(each[:, j].mean()) for j, name in enumerate(JOINTS)},
        "people_m": [float(each[whose == person].mean()) for person in np.unique(whose)],
    }


def _confidence(
    estimate: PoseEstimate,
    truth: list[Float64[np.ndarray, "person 17 3"]],
    matches: list[Int64[np.ndarray, "match 2"]],
) -> dict[str, float | None] | None:
    """`confidence` of all matches; None where there is none."""
    assert estimate.sigma_m is not None
    pairs = [(k, body, person) for k, row in enumerate(matches) for body, person in row]
    if not pairs:
        return None
    offset = np.array([estimate.joints[k, body] - truth[k][person] for k, body, person in pairs])
    sigma_m = np.array([estimate.sigma_m[k, body] for k, body, _ in pairs])
    return confidence(np.linalg.norm(offset, axis=2), sigma_m)


def _heights(
    heights_m: Float64[np.ndarray, "body"] | None,
    truth: list[Float64[np.ndarray, "person 17 3"]],
    matches: list[Int64[np.ndarray, "match 2"]],
) -> dict[str, list[float] | None]:
    """Mean height of the bodies that were matched to each person, and theirs by their limbs.

    Of people of whom nothing is known, the heights of all bodies.
    """
    if heights_m is None:
        return {"heights_m": None, "true_heights_m": None}
    if not sum(len(row) for row in matches):
        return {"heights_m": heights_m.tolist(), "true_heights_m": None}
    body, person = np.concatenate(matches).T
    told = [float(heights_m[body[person == one]].mean()) for one in np.unique(person)]
    true = [
        float(people().body(fit_shape(np.array([frame[one] for frame in truth]))).height_m)
        for one in np.unique(person)
    ]
    return {"heights_m": told, "true_heights_m": true}


def identity_kept(matches: list[list[tuple[int, int]]]) -> float | None:
    """Share of matches (body, person), frame by frame, with the person a body had at first."""
    first: dict[int, int] = {}
    kept = [first.setdefault(body, person) == person for row in matches for body, person in row]
    return float(np.mean(kept)) if kept else None
