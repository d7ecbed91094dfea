# SPDX-License-Identifier: Apache-2.0
"""Joints of one person through a sequence, whatever they do; nothing where it does not stand out.

Every frame breeds guesses by itself, then takes up the best of the frames beside it and breeds
these. It is told only if device pairs that had no say in choosing prefer what was chosen to
somebody who stands there; if they hardly do, only which way somebody faces is.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Float64

from rfgs_core.articulated import people
from rfgs_core.encode.body_maps import views_of
from rfgs_core.limbs.evidence.body import figure_of
from rfgs_core.limbs.evidence.entries import path_resolution_m
from rfgs_core.limbs.evidence.library import headings_of
from rfgs_core.limbs.evidence.table import in_frames
from rfgs_core.limbs.evidence.tell import stands
from rfgs_core.limbs.evidence.track import GOES_M_S, course_of
from rfgs_core.limbs.postures.book import PoseBook
from rfgs_core.limbs.postures.chain import TEMPER, around, likeliest_path
from rfgs_core.limbs.postures.search import LATER, FrameSearch, Guess, spread_out
from rfgs_core.limbs.propose import Joints
from rfgs_core.measure.observations import Observations
from rfgs_core.seeds import sub_seed

#: Independent searches of each frame, whose guesses are pooled: one alone often ends beside the
#: likeliest pose.
RESTARTS = 3
#: Guesses of each frame that are chosen from, and that its neighbours take up.
KEPT, TAKEN = 60, 16
#: Device pairs without which too many poses are as likely.
FEWEST_PAIRS = 6
#: Coarser bands do not resolve straight echoes and those off walls, which then pass for limbs:
#: at 20 MHz (15 m) joints of who sits are further off than a standing body's, at 40 MHz nearer [m].
COARSEST_M = 10.0
#: The lead a frame that it takes for a heading, and for a pose: with less, joints are further off
#: than a standing body's [nat].
LEAST_LEAD, POSED_LEAD = 20.0, 40.0
#: Whose hips are lower than this share of a standing body's does not stand.
_UPRIGHT = 0.75
#: Facets lie as close as for this wavelength [m]: guesses are many.
_WAVELENGTH_M = 0.14
#: A joint is known no better than this [m].
_SUREST_M = 0.1


class Told(NamedTuple):
    """Somebody in every frame of a sequence."""

    joints: Joints
    """Shape (frame, 1, 17, ·)."""
    lead: float
    """Evidence over standing, by pairs that had no say, a frame [nat]."""


def can_tell(observations: Observations) -> bool:
    """Whether enough device pairs of a frame are visible, and their band is wide enough."""
    if path_resolution_m(observations.freq_hz) > COARSEST_M:
        return False
    return len(views_of(observations.layout, observations.links)) >= FEWEST_PAIRS


def looks(frames: int) -> int:
    """How often `tell` calls `on_frame` for so many frames."""
    return 2 * frames


def tell(
    seen: list[Observations],
    axes_xy: Float[np.ndarray, "frame 2"],
    seed: int = 0,
    on_frame: Callable[[], Any] = lambda: None,
) -> Told | None:
    """The likeliest poses of one person; None where they do not stand out from standing.

    Where they hardly do, a body that stands, facing the way they go or are likeliest to face,
    unless the likeliest poses are low.

    Args:
        seen: Frames in the order of time, without the echoes of anybody else.
        axes_xy: Where the person was found in each [m].
        seed: Seed of the guesses.
        on_frame: Called as frames are done, twice each.
    """
    body = people().body(np.zeros(0))
    figure, book = figure_of(body, _WAVELENGTH_M), PoseBook.of(body, seed)
    searches = [
        FrameSearch(one, np.asarray(xy, np.float64), figure, book, _rng(seed, frame))
        for frame, (one, xy) in enumerate(zip(seen, axes_xy, strict=True))
    ]

    def by_itself(frame: int) -> list[Guess]:
        search = searches[frame]
        found = [spread_out(search.bred(search.drawn()), KEPT) for _ in range(RESTARTS)]
        return [guess for guesses in found for guess in guesses]

    alone = in_frames(by_itself, len(seen), on_frame)

    def again(frame: int) -> tuple[list[Guess], Guess]:
        search, guesses = searches[frame], spread_out(alone[frame], KEPT)
        for beside in (frame - 1, frame + 1):
            if 0 <= beside < len(seen):
                taken = spread_out(alone[beside], TAKEN)
                guesses += [search.guess(*one[:4]) for one in taken]
        best = spread_out(search.bred(guesses, LATER), KEPT)
        return best, search.standing(best[:3])

    found = in_frames(again, len(seen), on_frame)
    scores = [np.array([guess.score for guess in best]) for best, _ in found]
    joints = [np.array([body.joints17(guess.in_world) for guess in best]) for best, _ in found]
    path = likeliest_path(scores, joints, np.array([one.time_s for one in seen]))
    means, spreads = zip(*map(around, scores, joints, path.tolist()), strict=True)
    sigma = np.hypot(_SUREST_M, np.array(spreads))
    told = Joints(np.array(means)[:, None], sigma[:, None])
    lead = float(np.mean([_lead(best, standing) for best, standing in found]))
    if lead <= LEAST_LEAD:
        return None
    if lead > POSED_LEAD:
        return Told(told, lead)
    upright = stands(seen, axes_xy, _facing(told.xyz[:, 0], seen, axes_xy))
    floor_m = float(seen[0].bounds_m[0, 2])
    low = told.xyz[:, 0, 0, 2] - floor_m < _UPRIGHT * (upright.xyz[:, 0, 0, 2] - floor_m)
    return None if low.any() else Told(upright, lead)


def _facing(
    joints: Float64[np.ndarray, "frame 17 3"],
    seen: list[Observations],
    axes_xy: Float[np.ndarray, "frame 2"],
) -> Float64[np.ndarray, "frame"]:
    """Which way somebody faces [rad]: where they go, or as their joints have it where they stay."""
    heading, speed_m_s = course_of(axes_xy, np.array([one.time_s for one in seen]))
    return np.where(speed_m_s >= GOES_M_S, heading, headings_of(joints))


def _rng(seed: int, frame: int) -> np.random.Generator:
    return np.random.default_rng(sub_seed(seed, "posture", frame))


def _lead(guesses: list[Guess], stands: Guess) -> float:
    """By how much each pair prefers guesses, weighed by all others, to standing [nat]."""
    log = np.array([guess.log for guess in guesses])
    others = log.sum(axis=1, keepdims=True) - log
    weight = np.exp(TEMPER * (others - others.max(axis=0)))
    weight /= weight.sum(axis=0)
    return float((weight * log).sum() - stands.log.sum())
