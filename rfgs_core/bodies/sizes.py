# SPDX-License-Identifier: Apache-2.0
"""How tall people are, by evidence of bodies that stand where they were found.

Who stands is heard up to the top of the head: a body of another size explains less of the channel,
by ten nat a frame and more for each decimetre. Only frames in which somebody is upright on the
ground, and loud enough, have a say. There a body is likelier on the ground than above it, as of
who is on stairs, or sunk into it, as of who sits.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from jaxtyping import Float, Float64

from rfgs_core.bodies.body_prior import Bodies
from rfgs_core.bodies.echo_evidence import EchoEvidence, Parts
from rfgs_core.bodies.likeliest_place import FEWEST_PAIRS
from rfgs_core.limbs.evidence.entries import path_resolution_m
from rfgs_core.limbs.evidence.table import in_frames
from rfgs_core.measure.observations import Observations

#: Sizes that are tried [standard deviations, of 0.164 m each], and those tried off the ground.
_SIZES, _FEW_SIZES = np.arange(-3.0, 3.5), (-2.0, 0.0, 2.0)
#: Who is likelier this far above or below is not upright on the ground [m].
_OFF_GROUND_M = 0.4
#: Coarser bands and fewer links of a device pair do not tell straight echoes from those off walls.
#: At 40 MHz (7.5 m), or with 2 × 2 receiving elements, sizes found are farther off than the mean;
#: with 4 × 4, a quarter of them hidden, they are nearer [m].
_COARSEST_M, _FEWEST_LINKS = 5.0, 12
#: By how much the likeliest size leads the unlikeliest at least: with less, noise decides [nat].
_LEAST_LEAD = 20.0
#: Times that people are sized beside the others.
_ROUNDS = 2
#: Share of the frames in which somebody must be upright.
_LEAST_SHARE = 0.25
#: Variance of a size found, against that between people: so much is it drawn to the mean. Of 24
#: people heights found are 0.09 m off, root mean square, and 0.066 m drawn so. Who is
#: nearer to the mean than its root is taken to be of mean size.
_VARIANCE = 0.3


def looks(people: int, frames: int) -> int:
    """How often `sizes` calls `on_look`."""
    return frames * people * _rounds(people)


def sizes(
    seen: list[Observations],
    axes_xy: Float[np.ndarray, "frame body 2"],
    on_look: Callable[[], Any] = lambda: None,
) -> Float64[np.ndarray, "body 1"]:
    """Size of each person, the first coefficient of `articulated.ShapeSpace`.

    Args:
        seen: Frames.
        axes_xy: Where people were found in each [m].
        on_look: Called as each person is done in each frame; see `looks`.

    Returns:
        Standard deviations from the mean adult; zero of who is about as tall, of who is hardly
        ever upright, and where fewer than `FEWEST_PAIRS` device pairs hear anything, most have
        fewer than 12 links, or the band is narrower than 60 MHz.
    """
    places = np.asarray(axes_xy, dtype=np.float64)
    found = np.zeros(places.shape[1])
    frames, people = places.shape[:2]
    for _ in range(_rounds(people)):
        known = np.round(found, 1)

        def look(one: int, known: np.ndarray = known) -> float:
            frame, body = divmod(one, people)
            return _in_frame(seen[frame], places[frame], known, body)

        told = np.array(in_frames(look, frames * people, on_look)).reshape(frames, people)
        found = np.array([_of_frames(own) for own in told.T])
    return found[:, None]


def _rounds(people: int) -> int:
    return _ROUNDS if people > 1 else 1


def _of_frames(told: Float64[np.ndarray, "frame"]) -> float:
    """The size of somebody by those of all frames, NaN where none is told."""
    upright = told[np.isfinite(told)]
    if not len(upright) or len(upright) < _LEAST_SHARE * len(told):
        return 0.0
    size = float(np.median(upright)) / (1.0 + _VARIANCE)
    return size if abs(size) > math.sqrt(_VARIANCE) else 0.0


def _in_frame(
    observations: Observations,
    axes_xy: Float64[np.ndarray, "body 2"],
    known: Float64[np.ndarray, "body"],
    body: int,
) -> float:
    """The likeliest size of one person beside the others as known; NaN if none is told.

    None is of who is not upright on the ground, or hardly heard.
    """
    if not _resolves(observations):
        return np.nan
    evidence = EchoEvidence(observations, axes_xy[body])
    if len(evidence.pairs) < FEWEST_PAIRS:
        return np.nan
    standing = [Bodies.standing(place[None]) for place in axes_xy]
    others = [
        evidence.parts(one, float(size))
        for k, (one, size) in enumerate(zip(standing, known, strict=True))
        if k != body
    ]
    on_ground = _logs(evidence, standing[body], others, 0.0, tuple(_SIZES.tolist()))
    off = [
        _logs(evidence, standing[body], others, rise_m, _FEW_SIZES).max()
        for rise_m in (_OFF_GROUND_M, -_OFF_GROUND_M)
    ]
    heard = np.ptp(on_ground) >= _LEAST_LEAD and on_ground.max() >= max(off)
    return _peak(on_ground) if heard else np.nan


def _resolves(observations: Observations) -> bool:
    """Whether band and arrays tell straight echoes from those off walls."""
    layout, links = observations.layout, observations.links
    many = [np.sum(layout.links_between(*pair) & links) for pair in observations.pairs[1]]
    fine = path_resolution_m(observations.freq_hz) <= _COARSEST_M
    return fine and bool(many) and float(np.median(many)) >= _FEWEST_LINKS


def _logs(
    evidence: EchoEvidence,
    one: Bodies,
    others: list[Parts],
    rise_m: float,
    tried: tuple[float, ...],
) -> Float64[np.ndarray, "size"]:
    """Log-likelihood with somebody of some sizes beside others [nat]."""
    return np.array([evidence.log([evidence.parts(one, size, rise_m), *others]) for size in tried])


def _peak(log: Float64[np.ndarray, "size"]) -> float:
    """Where a parabola through the likeliest size and its neighbours is highest.

    NaN if the likeliest is the smallest or the largest: nobody is, and something else is heard.
    """
    best = int(log.argmax())
    if best in (0, len(log) - 1):
        return np.nan
    before, at, after = log[best - 1 : best + 2]
    return float(_SIZES[best] + 0.5 * (before - after) / (before - 2.0 * at + after))
