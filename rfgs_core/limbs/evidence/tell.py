# SPDX-License-Identifier: Apache-2.0
"""Limbs of somebody who walks, by evidence alone; nothing where it does not stand out.

In turn: the way from the places found, the amplitude of walls, the places anew by a few poses, the
stride and how far legs are bent by a few frames, and the likeliest walk. It is told only if device
pairs that had no say in its phases and places hear it rather than somebody who stands there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Float64

from rfgs_core.articulated import Body, Pose, people
from rfgs_core.limbs.evidence.body import figure_of
from rfgs_core.limbs.evidence.follow import Path, off_track, stood, walked
from rfgs_core.limbs.evidence.library import (
    BENDS_RAD,
    PHASES,
    Stride,
    about_z,
    strides,
    upright,
)
from rfgs_core.limbs.evidence.table import evidence_table, in_frames, stacked
from rfgs_core.limbs.evidence.track import Way, looks_of, way_of
from rfgs_core.limbs.propose import Joints
from rfgs_core.measure.observations import Observations
from rfgs_core.seeds import sub_seed
from rfgs_core.worlds.figure import Figure

#: Who is slower in more than a tenth of the frames does not walk through them [m/s].
SLOWEST_M_S, _SLOW_SHARE = 0.3, 0.1
#: A walk is followed through at least this many frames, over at least this long [s].
FEWEST_FRAMES, SHORTEST_S = 4, 0.75
#: Strides that are tried, and amplitudes of walls, and in how many frames.
STRIDES, ALPHAS, _FEW_FRAMES = 8, (0.0, 0.25, 0.5, 0.8), 8
#: Places that are tried around the way, first with a few poses, then with all [m].
_FAR = np.array([[x, y, 0.0] for x in range(-2, 3) for y in range(-2, 3)]) * 0.05
_NEAR = np.array([[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]]) * 0.04
_HERE = np.zeros((1, 3))
#: Places around those of the likeliest walk [m].
_FINE = np.array([[x, y, 0.0] for x in range(-1, 2) for y in range(-1, 2)]) * 0.02
#: A joint is known no better than this [m].
_SUREST_M = 0.055
#: Joints of a standing body are so far off those of people of whom nothing else is known [m].
_STANDING_M = 0.11
#: Phases this far from the likeliest one are in doubt [share of a stride].
_DOUBT = 0.08
#: A frame agrees with a walk if it is likeliest this near to its phase [share of a stride]; of a
#: walk that is told, this share of the frames must.
_NEAR_PHASE, _AGREE = 1.5 / PHASES, 0.65
#: Where frames do not agree with a walk whose evidence leads by this much a frame [nat], strides
#: are drawn once more: five of the demo's eight frames agree by one draw, all by another.
_STANDS_OUT = 40.0


class Told(NamedTuple):
    """Somebody who walks through a sequence."""

    joints: Joints
    """Shape (frame, 1, 17, ·)."""
    lead: float
    """Evidence over standing in the same places, by pairs that had no say [nat]."""
    agree: float
    """Share of the frames that by themselves are likeliest at about the phase of the walk."""


@dataclass(frozen=True)
class _Case:
    """Frames of somebody, and what is known so far."""

    seen: list[Observations]
    figure: Figure
    way: Way
    alpha: float = 0.0

    @property
    def time_s(self) -> Float64[np.ndarray, "frame"]:
        return np.array([one.time_s for one in self.seen])

    @property
    def body(self) -> Body:
        return self.figure.body

    def few(self) -> _Case:
        """Some frames, spread over all."""
        count = min(len(self.seen), _FEW_FRAMES)
        some = np.linspace(0, len(self.seen) - 1, count).round().astype(int)
        way = Way(*(values[some] for values in self.way))
        return replace(self, seen=[self.seen[frame] for frame in some], way=way)

    def log(
        self,
        poses: list[Pose],
        shifts: Float64[np.ndarray, "shift 3"],
        alphas: tuple[float, ...] | None = None,
        on_frame: Callable[[], Any] = lambda: None,
    ) -> Float64[np.ndarray, "frame pose shift alpha pair"]:
        """Evidence of poses that face the way, in all frames."""

        def table(frame: int) -> dict[tuple[int, int], np.ndarray]:
            place = self.way.xy[frame], float(self.way.heading[frame])
            one, tried = self.seen[frame], alphas or (self.alpha,)
            return evidence_table(one, self.figure, poses, place, shifts, tried)

        return stacked(in_frames(table, len(self.seen), on_frame))


def long_enough(time_s: Float64[np.ndarray, "frame"]) -> bool:
    """Whether frames at some times [s] show enough of a walk."""
    return len(time_s) >= FEWEST_FRAMES and float(np.ptp(time_s)) >= SHORTEST_S


def looks(frames: int) -> int:
    """How often `tell` calls `on_frame` for a walk of so many frames."""
    few = min(frames, _FEW_FRAMES)
    return few + frames + (STRIDES + len(BENDS_RAD)) * few + 2 * frames


def tell(
    seen: list[Observations],
    axes_xy: Float[np.ndarray, "frame 2"],
    seed: int = 0,
    on_frame: Callable[[], Any] = lambda: None,
) -> Told | None:
    """Joints of one person; None where nobody walks or it cannot be told.

    Which strides are tried is chance, and so is whether one of them is near enough for frames to
    agree: where a walk stands out and they do not, others are tried, once.

    Args:
        seen: Frames in the order of time.
        axes_xy: Where the person was found in each [m].
        seed: Seed of the strides.
        on_frame: Called as frames are done.
    """
    found = best_walk(seen, axes_xy, seed, on_frame)
    if found is not None and found.agree < _AGREE and found.lead > _STANDS_OUT * len(seen):
        found = best_walk(seen, axes_xy, sub_seed(seed, "again"))
    if found is None or found.lead <= 0.0 or found.agree < _AGREE:
        return None
    return found


def stands(
    seen: list[Observations],
    axes_xy: Float[np.ndarray, "frame 2"],
    heading: Float64[np.ndarray, "frame"] | None = None,
) -> Joints:
    """Joints of somebody of whom no walk is told: a body that stands.

    Args:
        seen: Frames in the order of time.
        axes_xy: Where the person was found in each [m].
        heading: Which way they face [rad]; None: the way of the places, where they go.
    """
    time_s = np.array([one.time_s for one in seen])
    way = way_of(np.asarray(axes_xy, np.float64), time_s)
    body = people().body(np.zeros(0))
    own, floor_m = body.joints17(upright(body)), float(seen[0].bounds_m[0, 2])
    facing = looks_of(way, time_s) if heading is None else heading
    turned = np.array([own @ about_z(one).T for one in facing])
    spots = np.column_stack([way.xy, np.full(len(way.xy), floor_m)])
    xyz = (turned + spots[:, None])[:, None]
    return Joints(xyz, np.full(xyz.shape[:3], _STANDING_M))


def best_walk(
    seen: list[Observations],
    axes_xy: Float[np.ndarray, "frame 2"],
    seed: int = 0,
    on_frame: Callable[[], Any] = lambda: None,
) -> Told | None:
    """The likeliest walk, whether or not it stands out; None where nobody walks."""
    time_s = np.array([one.time_s for one in seen])
    if not long_enough(time_s):
        return None
    way = way_of(np.asarray(axes_xy, np.float64), time_s)
    if not np.quantile(way.speed_m_s, _SLOW_SHARE) > SLOWEST_M_S:
        return None
    case = _Case(seen, figure_of(people().body(np.zeros(0))), way)
    found = strides(case.body, float(np.median(way.speed_m_s)), STRIDES, seed)
    if not found:
        return None
    by_alpha = case.few().log([upright(case.body)], _HERE, ALPHAS, on_frame)
    by_alpha = by_alpha.sum(axis=(0, 1, 2, 4))
    case = replace(case, alpha=ALPHAS[int(by_alpha.argmax())])
    case = replace(case, way=_nearer(case, found[0], on_frame))
    stride = _likeliest(case.few(), found, on_frame)
    bent = [stride.bent(case.body, bend) for bend in BENDS_RAD]
    stride = _likeliest(case.few(), bent, on_frame)
    log = case.log([upright(case.body), *stride.poses], _NEAR, on_frame=on_frame)
    return _told(case, stride, log[:, :, :, 0], on_frame)


def _nearer(case: _Case, stride: Stride, on_frame: Callable[[], Any]) -> Way:
    """The way through the places where somebody who stands or makes a step is likeliest."""
    poses = [upright(case.body), stride.poses[0], stride.poses[PHASES // 2]]
    log = case.log(poses, _FAR, on_frame=on_frame)[:, :, :, 0].sum(axis=3).max(axis=1)
    shift = stood(log, _FAR, case.time_s).shift
    return way_of(case.way.xy + _FAR[shift, :2], case.time_s)


def _likeliest(case: _Case, found: list[Stride], on_frame: Callable[[], Any]) -> Stride:
    """The stride of the likeliest walk."""
    if len(found) == 1:
        return found[0]
    scores = []
    for stride in found:
        log = case.log(stride.poses, _HERE, on_frame=on_frame)[:, :, :, 0].sum(axis=3)
        scores.append(walked(log, _HERE, case.time_s, stride.lasts_s).score)
    return found[int(np.argmax(scores))]


def _told(
    case: _Case,
    stride: Stride,
    log: Float64[np.ndarray, "frame pose shift pair"],
    on_frame: Callable[[], Any],
) -> Told:
    """The likeliest walk, and by how much pairs that had no say prefer it to standing."""
    time_s, every = case.time_s, np.arange(len(case.seen))
    whole, lead = log.sum(axis=3), 0.0
    for pair in range(log.shape[3]):
        others = whole - log[..., pair]
        path = walked(others[:, 1:], _NEAR, time_s, stride.lasts_s)
        still = stood(others[:, 0], _NEAR, time_s)
        nearest = 1 + np.round(path.phase * PHASES).astype(int) % PHASES
        lead += float(log[every, nearest, path.shift, pair].sum())
        lead -= float(log[every, 0, still.shift, pair].sum())
    path = walked(whole[:, 1:], _NEAR, time_s, stride.lasts_s)
    floor_m = float(case.seen[0].bounds_m[0, 2])
    spots = np.column_stack([case.way.xy, np.full(len(every), floor_m)]) + _NEAR[path.shift]
    spots += _settled(case, stride, path, on_frame)
    alone = whole[:, 1:].max(axis=2).argmax(axis=1) / PHASES
    off = np.abs((path.phase - alone + 0.5) % 1.0 - 0.5)
    agree = float(np.mean(off <= _NEAR_PHASE))
    return Told(_joints(case, stride, path.phase, spots), lead, agree)


def _settled(
    case: _Case, stride: Stride, path: Path, on_frame: Callable[[], Any]
) -> Float64[np.ndarray, "frame 3"]:
    """How far from the places of the likeliest walk its poses are likelier still [m]."""

    def move(frame: int) -> Float64[np.ndarray, "3"]:
        pose = stride.poses[int(np.round(path.phase[frame] * PHASES)) % PHASES]
        place = case.way.xy[frame], float(case.way.heading[frame])
        shifts = _NEAR[path.shift[frame]] + _FINE
        table = evidence_table(case.seen[frame], case.figure, [pose], place, shifts, (case.alpha,))
        likely = sum(found[0, :, 0] for found in table.values())
        return _FINE[int(np.argmax(likely - off_track(shifts)))]

    return np.array(in_frames(move, len(case.seen), on_frame))


def _joints(
    case: _Case, stride: Stride, phase: np.ndarray, spots: Float64[np.ndarray, "frame 3"]
) -> Joints:
    """Joints at phases of a stride, facing the way, at some places [m]."""
    round_ = np.array([case.body.joints17(pose) for pose in stride.poses])

    def at(share: float) -> np.ndarray:
        low = int(share % 1.0 * PHASES)
        part = share % 1.0 * PHASES - low
        return (1.0 - part) * round_[low % PHASES] + part * round_[(low + 1) % PHASES]

    xyz, sigma = [], []
    for frame, share in enumerate(phase.tolist()):
        xyz.append(at(share) @ about_z(case.way.heading[frame]).T + spots[frame])
        doubt = np.linalg.norm(at(share + _DOUBT) - at(share - _DOUBT), axis=1) / 2.0
        sigma.append(np.hypot(_SUREST_M, doubt))
    return Joints(np.array(xyz)[:, None], np.array(sigma)[:, None])
