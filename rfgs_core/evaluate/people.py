# SPDX-License-Identifier: Apache-2.0
"""Each person's own centroid, held against the body that the method tells to be there.

The centroid of all that moves says little of two people: it is off where one of them gets more
voxels than the other, and it is right where their errors cancel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Float64, Int
from scipy.optimize import linear_sum_assignment

from rfgs_core.bodies.body_prior import nearest_axis
from rfgs_core.evaluate.geometry import TRACKED_M, spanned
from rfgs_core.pose.score import identity_kept


@dataclass(frozen=True)
class FramePeople:
    """Who was matched with whom in one frame."""

    body: tuple[int, ...]
    """Bodies of the method, one per match."""
    person: tuple[int, ...]
    """Instance of the scene that each was matched with."""
    distance_m: tuple[float, ...]
    """Distance between the centroids of both [m]."""
    present: int
    """People in the frame, matched or not."""


def surface_centroids(
    vertices: Float[np.ndarray, "V 3"],
    faces: Int[np.ndarray, "T 3"],
    instance: Int[np.ndarray, "T"],
) -> dict[int, Float64[np.ndarray, "3"]]:
    """Centroid of the surface of each instance [m], weighed by area."""
    corners, _, area = spanned(vertices, faces)
    centre = corners.mean(axis=1)
    known = [int(number) for number in np.unique(instance) if area[instance == number].sum() > 0]
    return {
        number: np.average(centre[instance == number], axis=0, weights=area[instance == number])
        for number in known
    }


def match_people(
    predicted: Float[np.ndarray, "k 3"],
    axes_xy: Float[np.ndarray, "body 2"],
    people: dict[int, Float64[np.ndarray, "3"]],
) -> FramePeople:
    """Matches bodies with people, least sum of distances first.

    Args:
        predicted: Centres of the predicted voxels [m]; each belongs to the nearest body.
        axes_xy: Where the method has its bodies [m].
        people: True centroids by instance [m].
    """
    whose = nearest_axis(predicted, axes_xy)
    bodies = [body for body in range(len(axes_xy)) if (whose == body).any()]
    numbers = list(people)
    if not bodies or not numbers:
        return FramePeople((), (), (), len(numbers))
    own = np.array([predicted[whose == body].mean(axis=0) for body in bodies])
    gap_m = np.linalg.norm(own[:, None] - np.array([people[n] for n in numbers]), axis=2)
    rows, columns = linear_sum_assignment(gap_m)
    return FramePeople(
        tuple(bodies[row] for row in rows),
        tuple(numbers[column] for column in columns),
        tuple(float(gap_m[row, column]) for row, column in zip(rows, columns, strict=True)),
        len(numbers),
    )


def people_metrics(frames: Sequence[FramePeople]) -> dict[str, Any]:
    """The group `people` of `metrics.json`.

    Returns:
        `centroid_m`, mean distance of matched centroids; `found`, share of people with their
        body's centroid within `TRACKED_M`; `identity_kept`, see `pose.score`. Values are None where
        nobody was matched.
    """
    distance = [far for frame in frames for far in frame.distance_m]
    present = sum(frame.present for frame in frames)
    return {
        "centroid_m": float(np.mean(distance)) if distance else None,
        "found": float(np.sum(np.array(distance) <= TRACKED_M)) / present if present else None,
        "identity_kept": identity_kept(
            [list(zip(frame.body, frame.person, strict=True)) for frame in frames]
        ),
    }
