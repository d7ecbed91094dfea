# SPDX-License-Identifier: Apache-2.0
"""Our network, which saw synthetic radio alone, beside what knows less, on real people.

Rows are at the place that the points tell, and at the true place (which published loaders read
too, when they cut points out around the true joints). The control of the network is its own answer
to another frame, that of both the mean pose of somebody who walks towards the radar.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float64

from rfgs_core.encode.body_maps import CENTRE_HEIGHT_M
from rfgs_core.errors import RfgsError
from rfgs_core.evaluate.limbs import moments_of_walks
from rfgs_core.limbs.network import LimbNetwork
from rfgs_core.limbs.propose import propose
from rfgs_core.limbs.tokens import MIRRORED
from rfgs_core.people_sets.hupr import HuPR
from rfgs_core.people_sets.m4human import M4Human
from rfgs_core.people_sets.m4human_lmdb import M4HumanLmdb
from rfgs_core.people_sets.mmbody import MMBody
from rfgs_core.people_sets.mmfi import MMFi
from rfgs_core.people_sets.model import HeardFrame, PeopleSet
from rfgs_core.people_sets.rtpose import RTPose
from rfgs_core.people_sets.scatterers import heard_by_us
from rfgs_core.seeds import sub_seed
from rfgs_core.skeleton import JOINTS

#: Frames that are judged, spread over the set.
MOST_FRAMES = 300
#: A body is looked for in columns of this radius, every so much [m].
_COLUMN_M, _STEP_M = 0.4, 0.1
#: Points this far from the column's middle belong to the body [m].
_BODY_M = 1.0
#: Fewer points tell nothing.
_LEAST_POINTS = 5
#: The mean of the side of a column that a radar sees is this far in front of its axis: 2R/π of
#: R = 0.18 m, see `bodies.localise`.
_AHEAD_M = 0.115
_PELVIS = JOINTS.index("pelvis")


class _Answer(NamedTuple):
    """What the rows say of one frame, and the truth."""

    frame: HeardFrame
    place: Float64[np.ndarray, "3"]
    rows: dict[str, Float64[np.ndarray, "17 3"]]


def open_people_set(folder: Path) -> PeopleSet:
    """The public set in a folder.

    Raises:
        RfgsError: There is none that is known.
    """
    if not folder.is_dir():
        raise RfgsError(f"{folder}: no such folder")
    for kind in (MMFi, MMBody, HuPR, RTPose, M4Human, M4HumanLmdb):
        found = kind.at(folder)
        if found is not None and found.count:
            return found
    raise RfgsError(
        f"{folder}: expected MM-Fi (E01/S01/A01/mmwave), mmBody (sequence_0/radar), HuPR "
        "(single_1/hori with joints), RT-Pose (Train.json and its cubes) or M4Human "
        "(p1/actions/1/mmwave and p1/parameters/1.json, or rf3dpose_all/radar_comp.lmdb), "
        "see docs/captures.md"
    )


def judge_people(
    folder: Path,
    network: LimbNetwork,
    on_frame: Callable[[], Any] = lambda: None,
    seed: int = 0,
) -> dict[str, float | str]:
    """Errors of every row on the set in a folder.

    Args:
        folder: The set.
        network: The network of the preset `mmwave`.
        on_frame: Called after each frame.
        seed: Seed of phases and walks.

    Returns:
        By `row: figure`; joints in space [m], or in pictures as a share of the height there.

    Raises:
        RfgsError: No set is known there, or nothing was heard in any frame.
        RfgsFormatError: A file is damaged.
    """
    public = open_people_set(folder)
    every = max(1, -(-public.count // MOST_FRAMES))
    walk = _facing_us(moments_of_walks(np.random.default_rng(sub_seed(seed, "walks"))))
    answers, silent = [], 0
    rng = np.random.default_rng(sub_seed(seed, public.name, "phases"))
    for frame in public.frames(every):
        answer = _answer(frame, network, walk, rng)
        silent += answer is None
        answers += [] if answer is None else [answer]
        on_frame()
    if not answers:
        raise RfgsError(f"{folder} ({public.name}): no frame holds {_LEAST_POINTS} points or more")
    return {
        "set": public.name,
        "frames": len(answers),
        "frames without points": silent,
        "points per frame": float(np.mean([len(answer.frame.points) for answer in answers])),
        **dict(_figures(answers)),
        **{f"assumed {n}": said for n, said in enumerate(public.assumptions, start=1)},
        **{f"claimed, not reproduced ({claim.source})": claim.figure for claim in public.claims},
    }


def found_place(points: Float64[np.ndarray, "point 3"]) -> Float64[np.ndarray, "3"]:
    """Middle of the body that most points lie around [m]; z is the mean of its points."""
    low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
    # Far points are no rooms: a grid of them would not end.
    low, high = np.maximum(low, -10.0), np.minimum(high, 15.0)
    axes = [np.arange(low[k], max(high[k], low[k]) + _STEP_M, _STEP_M) for k in range(2)]
    tried = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    near = [
        int((np.sum((points[:, :2] - place) ** 2, axis=1) < _COLUMN_M**2).sum()) for place in tried
    ]
    best = tried[int(np.argmax(near))]
    inside = np.sum((points[:, :2] - best) ** 2, axis=1) < _COLUMN_M**2
    place = points[inside].mean(axis=0) if inside.any() else points.mean(axis=0)
    away = place[:2] / max(float(np.linalg.norm(place[:2])), 1e-9)
    return place + _AHEAD_M * np.array([*away, 0.0])


def _answer(
    frame: HeardFrame,
    network: LimbNetwork,
    walk: Float64[np.ndarray, "17 3"],
    rng: np.random.Generator,
) -> _Answer | None:
    if len(frame.points) < _LEAST_POINTS:
        return None
    place = found_place(frame.points)
    places = {"place found": place}
    if frame.joints is not None:
        places["place told"] = np.array([*frame.joints[_PELVIS, :2], place[2]])
    rows = {}
    for words, centre in places.items():
        near = np.linalg.norm(frame.points[:, :2] - centre[:2], axis=1) < _BODY_M
        if near.sum() >= _LEAST_POINTS:
            seen = heard_by_us(frame.points[near], frame.amplitude[near], centre.copy(), rng)
            rows[f"network, {words}"] = propose(network, seen, centre[None, :2]).xyz[0]
        rows[f"mean walk, {words}"] = walk + centre - [0.0, 0.0, CENTRE_HEIGHT_M]
    return _Answer(frame, place, rows)


def _facing_us(moments: Float64[np.ndarray, "moment 17 3"]) -> Float64[np.ndarray, "17 3"]:
    """The mean pose, turned from facing along x to facing the radar, along -y."""
    x, y, z = np.moveaxis(moments.mean(axis=0), -1, 0)
    return np.stack([y, -x, z], axis=-1)


def _figures(answers: list[_Answer]) -> Iterator[tuple[str, float]]:
    names = sorted({name for answer in answers for name in answer.rows})
    swapped = _swapped(answers)
    for name in names:
        both = [(answer, answer.rows[name]) for answer in answers if name in answer.rows]
        yield from ((f"{name}: {key}", value) for key, value in _errors(both))
        if name == "network, place found":
            yield from ((f"network, another frame: {key}", v) for key, v in _errors(swapped))
    if answers[0].frame.joints is not None:
        away = [
            float(np.linalg.norm((answer.place - answer.frame.joints[_PELVIS])[:2]))
            for answer in answers
            if answer.frame.joints is not None
        ]
        yield "place found: median error [m]", float(np.median(away))


def _swapped(
    answers: list[_Answer],
) -> list[tuple[_Answer, Float64[np.ndarray, "17 3"]]]:
    """What the network says of a frame half a set away, carried to the place found in this one."""
    name, found = "network, place found", []
    have = [answer for answer in answers if name in answer.rows]
    for index, answer in enumerate(have):
        other = have[(index + len(have) // 2) % len(have)]
        found.append((answer, other.rows[name] - other.place + answer.place))
    return found


def _errors(
    both: list[tuple[_Answer, Float64[np.ndarray, "17 3"]]],
) -> Iterator[tuple[str, float]]:
    """Mean errors over frames and known joints."""
    rows: dict[str, list[float]] = {}
    for answer, said in both:
        truth, pixels = answer.frame.joints, answer.frame.pixels
        if truth is not None:
            pelvis = truth[_PELVIS]
            aligned, mirrored = said - said[_PELVIS] + pelvis, said[MIRRORED]
            mirrored = mirrored - mirrored[_PELVIS] + pelvis
            figures = {
                "joints [m]": _mean_error(said, truth),
                "joints, pelvis aligned [m]": _mean_error(aligned, truth),
                "the same, sides swapped [m]": _mean_error(mirrored, truth),
            }
        elif pixels is not None:
            # A camera next to the radar, far away: right and down, to scale and place fitted.
            flat = np.stack([said[:, 0], -said[:, 2]], axis=-1)
            figures = {"joints in the picture [heights]": _picture_error(flat, pixels)}
        else:
            figures = {}
        for key, value in figures.items():
            rows.setdefault(key, []).append(value)
    for key, values in rows.items():
        yield key, float(np.mean(values))


def _mean_error(said: Float64[np.ndarray, "17 3"], truth: Float64[np.ndarray, "17 3"]) -> float:
    return float(np.nanmean(np.linalg.norm(said - truth, axis=1)))


def _picture_error(said: Float64[np.ndarray, "17 2"], truth: Float64[np.ndarray, "17 2"]) -> float:
    """Mean error after the scale and shift of least squares, as a share of the true height."""
    known = np.isfinite(truth).all(axis=1)
    there, here = truth[known], said[known]
    middle, own = there.mean(axis=0), here.mean(axis=0)
    scale = np.sum((here - own) * (there - middle)) / max(float(np.sum((here - own) ** 2)), 1e-12)
    fitted = middle + max(float(scale), 0.0) * (here - own)
    height = max(float(np.ptp(there[:, 1])), 1e-9)
    return float(np.mean(np.linalg.norm(fitted - there, axis=1))) / height
