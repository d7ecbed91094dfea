# SPDX-License-Identifier: Apache-2.0
"""Evidence of many poses at many places in one frame, device pair by device pair."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

import numba
import numpy as np
from jaxtyping import Float64

from rfgs_core.articulated import Pose
from rfgs_core.encode.body_maps import CENTRE_HEIGHT_M
from rfgs_core.limbs.evidence.body import by_bounces, direct, images_of, posed
from rfgs_core.limbs.evidence.entries import pairs_of
from rfgs_core.limbs.evidence.kernel import log_evidence
from rfgs_core.limbs.evidence.library import about_z
from rfgs_core.measure.observations import Observations
from rfgs_core.worlds.figure import Figure

Found = TypeVar("Found")


def evidence_table(
    observations: Observations,
    figure: Figure,
    poses: list[Pose],
    place: tuple[Float64[np.ndarray, "2"], float],
    shifts: Float64[np.ndarray, "shift 3"],
    alphas: tuple[float, ...],
) -> dict[tuple[int, int], Float64[np.ndarray, "pose shift alpha"]]:
    """Log evidence [nat] of each pose, by device pair.

    What a pose sends by way of walls is taken from the middle of the places: they are too near
    to each other for it to differ.

    Args:
        observations: The frame.
        figure: Whose poses.
        poses: Poses above the origin that look along x.
        place: Where the body is on the ground [m], and which way it faces [rad].
        shifts: Places around that one [m].
        alphas: Amplitudes of walls.
    """
    floor_m = float(observations.bounds_m[0, 2])
    spot = np.array([*place[0], floor_m])
    centre = np.array([*place[0], floor_m + CENTRE_HEIGHT_M])
    pairs = pairs_of(observations, centre)
    table = {pair.devices: np.zeros((len(poses), len(shifts), len(alphas))) for pair in pairs}
    images = {pair.devices: images_of(pair, observations.bounds_m, centre) for pair in pairs}
    for row, pose in enumerate(poses):
        body = posed(figure, pose.turned(about_z(place[1])).moved(spot), pairs)
        for pair in pairs:
            bounces = 0.0
            if any(alphas):
                bounces = by_bounces(body.facets, pair, images[pair.devices])
            for column, shift in enumerate(shifts):
                straight = direct(body, pair, shift)
                table[pair.devices][row, column] = [
                    log_evidence(pair.change, straight + alpha * alpha * bounces)
                    for alpha in alphas
                ]
    return table


def in_frames(work: Callable[[int], Found], count: int, on_frame: Callable[[], Any]) -> list[Found]:
    """What some work finds in each of so many frames, as many at a time as numba has threads.

    Args:
        work: Given the place of a frame; its kernels let other threads run.
        count: Frames.
        on_frame: Called as frames are done, in their order.
    """
    with ThreadPoolExecutor(numba.get_num_threads()) as pool:
        begun = [pool.submit(work, frame) for frame in range(count)]
        found = []
        try:
            for each in begun:
                found.append(each.result())
                on_frame()
            return found
        finally:
            # Whoever stops does not wait for frames that nobody has begun.
            for each in begun:
                each.cancel()


def stacked(
    tables: list[dict[tuple[int, int], np.ndarray]],
) -> Float64[np.ndarray, "frame pose shift alpha pair"]:
    """Tables of several frames; a pair that heard nothing in one says nothing there."""
    names = sorted({name for table in tables for name in table})
    some = next(iter(tables[0].values()))
    nothing = np.zeros_like(some)
    return np.array(
        [np.stack([table.get(name, nothing) for name in names], axis=-1) for table in tables]
    )
