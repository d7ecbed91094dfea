# SPDX-License-Identifier: Apache-2.0
"""Joints and surfaces of one person beside everything that knows less: the table of limbs.

All rows are at the place that radio found, but for the ceiling. Rows that say so are told which
way the person truly faces, which no method is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float, Float64
from tqdm import tqdm

from rfgs_core.articulated import fit_pose, people
from rfgs_core.bodies.tracks import Tracks
from rfgs_core.dataset import Sequence
from rfgs_core.dataset.observed import Observed
from rfgs_core.errors import RfgsError
from rfgs_core.evaluate.geometry import geometry_metrics, reference_points, voxel_budget
from rfgs_core.evaluate.grid import Grid, splat_gaussians
from rfgs_core.fit.frame import followed
from rfgs_core.limbs.evidence.library import headings_of, upright
from rfgs_core.limbs.evidence.tell import tell
from rfgs_core.limbs.network import LimbNetwork
from rfgs_core.limbs.postures.tell import can_tell, looks
from rfgs_core.limbs.postures.tell import tell as tell_posture
from rfgs_core.limbs.postures.through import propose_alone
from rfgs_core.limbs.propose import Joints, smoothed
from rfgs_core.limbs.skins import PosedPeople, shapes_of
from rfgs_core.limbs.together import walk_with_network
from rfgs_core.measure.observations import Observations, observe, packets_to_read
from rfgs_core.pose.confidence import confidence
from rfgs_core.seeds import sub_seed
from rfgs_core.settings import TrainConfig
from rfgs_core.skeleton import JOINTS
from rfgs_core.worlds.motion import random_motion

#: Joints that a standing body has in other places than a moving one.
LIMBS = [
    JOINTS.index(f"{s}_{n}") for s in ("left", "right") for n in ("knee", "ankle", "elbow", "wrist")
]
WRISTS = [JOINTS.index(f"{s}_wrist") for s in ("left", "right")]
#: Rows that are told together.
_SMOOTH, _EVIDENCE = "network, smoothed", "evidence of a walk"
_ANOTHER = "radio of another frame"
#: Seed of walks and of whose radio is swapped.
_SEED = 0
#: Walks whose mean pose is a row, and moments of each.
_WALKS, _MOMENTS = 40, 10
#: Points that stand for a posed surface, and the deviation around each [m].
_POINTS, _POINT_M = 6000, 0.01


@dataclass(frozen=True)
class Person:
    """The one person of a sequence, in all frames, and what radio says of them."""

    frames: list[int]
    time_s: Float64[np.ndarray, "frame"]
    seen: list[Observations]
    """What the method may see."""
    axes_xy: Float64[np.ndarray, "frame 2"]
    """Where radio finds the person [m]."""
    truth: Float64[np.ndarray, "frame 17 3"]
    """True joints [m]."""

    @staticmethod
    def of(
        sequence: Sequence,
        radio: str,
        frames: list[int],
        config: TrainConfig,
        everything: bool,
        on_frame: Callable[[], Any],
    ) -> Person:
        """Reads and follows, as a training does.

        Raises:
            RfgsError: There is not exactly one person, or their joints are not known.
        """
        count = sum(1 for row in sequence.instances if row["class"] == "person")
        if count != 1:
            raise RfgsError(f"{sequence.name}: expected one person for the table, found {count}")
        packets = packets_to_read(None, sequence, radio, config)
        seen, truth = [], []
        tracks: list[Tracks] = []
        for frame in frames:
            one = observe(
                sequence, radio, frame, config.channel, packets=packets, everything=everything
            )
            seed = sub_seed(_SEED, sequence.name, radio, frame, "fit")
            tracks.append(followed(tracks[-1] if tracks else None, one, config, seed))
            seen.append(one)
            truth.append(np.asarray(sequence.joints(frame)[0], dtype=np.float64))
            on_frame()
        time_s = np.array([sequence.time_s(frame) for frame in frames])
        axes_xy = np.array([track.axes_xy[0] for track in tracks])
        return Person(list(frames), time_s, seen, axes_xy, np.array(truth))

    @property
    def headings(self) -> Float64[np.ndarray, "frame"]:
        """Which way the person truly faces [rad]."""
        return headings_of(self.truth)


def limb_table(
    sequence: Sequence,
    radio: str,
    network: LimbNetwork | None,
    frames: list[int],
    *,
    everything: bool = True,
    channel: Observed = "clean",
    on_frame: Callable[[], Any] = lambda: None,
    others: Callable[[Person], dict[str, np.ndarray]] = lambda person: {},
) -> dict[str, dict[str, float | None]]:
    """Errors of every row.

    Args:
        sequence: One person, whose joints are known.
        radio: Which radio.
        network: The network of that radio; None leaves its rows out.
        frames: Frames.
        everything: Whether held-out entries are read as well.
        channel: The traced channel, or what imperfect radios made of it.
        on_frame: Called as frames are located.
        others: Joints by methods of others, float64, shape (frame, 17, 3) [m], by name of the row.

    Returns:
        For each row: joints, with the pelvis in place, limbs and wrists [m], F-scores at 5 and
        10 cm of the posed surface, and of rows with a deviation for each joint what
        `pose.confidence` says. Rows of the evidence are missing where it tells nothing, those
        of the radio of another frame where there is one only.
    """
    config = TrainConfig(channel=channel)
    person = Person.of(sequence, radio, frames, config, everything, on_frame)
    # Frames from the other half of the sequence.
    other = [(k + len(frames) // 2) % len(frames) for k in range(len(frames))]
    told = {} if network is None else _by_network(network, person, other)
    told |= _by_evidence(person, other, _SEED)
    if _EVIDENCE not in told and can_tell(person.seen[0]):
        told |= _by_postures(person, other, _SEED)
    if _SMOOTH in told and _EVIDENCE in told:
        shapes = shapes_of(told[_SMOOTH])
        both = walk_with_network(told[_EVIDENCE], told[_SMOOTH], shapes, person.seen)
        told = {"evidence and network together": _on_bodies(both, shapes)} | told
    if _SMOOTH in told:
        told[_SMOOTH] = _on_bodies(told[_SMOOTH], shapes_of(told[_SMOOTH]))
    if len(frames) == 1:
        # There is no other frame.
        told = {name: joints for name, joints in told.items() if _ANOTHER not in name}
    rows = others(person) | {name: joints.xyz[:, 0] for name, joints in told.items()}
    mean, phases = _walking(person, _SEED)
    own = people().body(np.zeros(0))
    rows |= {
        "standing, true heading": _placed(own.joints17(upright(own)), person),
        "mean walk, true heading": _placed(mean, person),
        "walk at a random phase, true heading": _placed(phases, person),
        "true joints, another body": person.truth,
    }
    surfaces = _Surfaces.of(sequence, person)
    sure = {name: joints.sigma_m[:, 0] for name, joints in told.items()}
    return {
        name: _scores(joints, person, surfaces, sure.get(name)) for name, joints in rows.items()
    }


def _by_network(network: LimbNetwork, person: Person, other: list[int]) -> dict[str, Joints]:
    """Joints by the network, and those it gives to the radio of other frames.

    Those of one frame are not smoothed; where it is unsure they are on the likeliest path.
    """
    proposed, swapped = (
        propose_alone(network, seen, person.axes_xy, person.time_s)
        for seen in (person.seen, [person.seen[k] for k in other])
    )
    return {
        _SMOOTH: smoothed(proposed, person.time_s),
        "network, one frame": proposed,
        _ANOTHER: swapped,
    }


def _by_evidence(person: Person, other: list[int], seed: int) -> dict[str, Joints]:
    """Joints by evidence, and by that of other frames' radio, where they are told."""
    swapped = _swapped(person, other)
    rows = {_EVIDENCE: person.seen, f"evidence, {_ANOTHER}": swapped}
    told = {name: tell(seen, person.axes_xy, seed) for name, seen in rows.items()}
    return {name: one.joints for name, one in told.items() if one is not None}


def _by_postures(person: Person, other: list[int], seed: int) -> dict[str, Joints]:
    """The same by evidence of any pose."""
    rows = {
        "evidence of any pose": person.seen,
        f"evidence of any pose, {_ANOTHER}": _swapped(person, other),
    }
    found = {}
    with tqdm(total=len(rows) * looks(len(person.seen)), desc="seeking postures") as bar:
        for name, seen in rows.items():
            told = tell_posture(seen, person.axes_xy, seed, bar.update)
            if told is not None:
                found[name] = _on_bodies(told.joints)
    return found


def _swapped(person: Person, other: list[int]) -> list[Observations]:
    """What the method may see, each frame with the radio of another."""
    return [
        replace(person.seen[k], time_s=one.time_s)
        for k, one in zip(other, person.seen, strict=True)
    ]


def _on_bodies(joints: Joints, shapes: Float64[np.ndarray, "1 K"] | None = None) -> Joints:
    """Joints of the bodies that are posed through them, as a run has them."""
    return Joints(PosedPeople.through(joints, shapes).joints17(), joints.sigma_m)


def _walking(
    person: Person, seed: int
) -> tuple[Float64[np.ndarray, "17 3"], Float64[np.ndarray, "frame 17 3"]]:
    """Mean pose of random walks, and one moment of a walk for each frame, facing along x."""
    rng = np.random.default_rng(sub_seed(seed, "walks"))
    ahead = moments_of_walks(rng)
    return ahead.mean(axis=0), ahead[rng.integers(len(ahead), size=len(person.frames))]


def moments_of_walks(rng: np.random.Generator) -> Float64[np.ndarray, "moment 17 3"]:
    """Joints at moments of random walks, the pelvis above the origin, facing along x [m]."""
    body = people().body(np.zeros(0))
    moments = []
    for _ in range(_WALKS):
        motion = random_motion(rng, body, "walk")
        moments += [
            body.joints17(motion.at(t)) for t in rng.uniform(0.0, motion.duration_s, _MOMENTS)
        ]
    ahead = _turned(np.array(moments), -headings_of(np.array(moments)))
    ahead[..., :2] -= ahead[:, :1, :2]
    return ahead


def _turned(
    joints: Float[np.ndarray, "frame 17 3"], angle: Float[np.ndarray, "frame"]
) -> Float64[np.ndarray, "frame 17 3"]:
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    x, y, z = np.moveaxis(np.asarray(joints, dtype=np.float64), -1, 0)
    return np.stack([c * x - s * y, s * x + c * y, z], axis=-1)


def _placed(joints: Float[np.ndarray, "*frame 17 3"], person: Person) -> np.ndarray:
    """Joints around the origin, facing along x, at the places found and facing the true way."""
    many = np.broadcast_to(joints, (len(person.frames), 17, 3))
    many = _turned(many, person.headings)
    floor_m = float(person.seen[0].bounds_m[0, 2])
    places = np.column_stack([person.axes_xy, np.full(len(many), floor_m)])
    return many + places[:, None]


@dataclass(frozen=True)
class _Surfaces:
    """True surfaces, and the grid they are compared on."""

    grid: Grid
    budget: int
    truth: list[Float64[np.ndarray, "n 3"]]

    @staticmethod
    def of(sequence: Sequence, person: Person) -> _Surfaces:
        truth = [reference_points(*sequence.moving_mesh(frame)[:2]) for frame in person.frames]
        grid = Grid.over(np.asarray(sequence.bounds_m))
        return _Surfaces(grid, voxel_budget(sequence.instances), truth)

    def scores(self, frame: int, points: Float64[np.ndarray, "n 3"]) -> tuple[float, float]:
        """F-scores at 5 and 10 cm of points on a surface."""
        covariance = np.broadcast_to(np.eye(3) * _POINT_M**2, (len(points), 3, 3))
        score = splat_gaussians(self.grid, points, covariance, np.ones(len(points)))
        metrics = geometry_metrics(score, self.grid, self.truth[frame], self.budget)
        return metrics["f05"] or 0.0, metrics["f10"] or 0.0


def _scores(
    joints: Float64[np.ndarray, "frame 17 3"],
    person: Person,
    surfaces: _Surfaces,
    sigma_m: Float64[np.ndarray, "frame 17"] | None,
) -> dict[str, float | None]:
    """Mean errors and F-scores of one row, and whether joints know how far off they are."""
    error = np.linalg.norm(joints - person.truth, axis=2)
    aligned = (joints - joints[:, :1]) - (person.truth - person.truth[:, :1])
    body, found = people().body(np.zeros(0)), []
    for frame, wanted in enumerate(joints):
        pose = fit_pose(body, wanted, np.ones(17), None)
        skin = body.skin(pose)
        points = reference_points(skin, body.faces)[:_POINTS]
        found.append(surfaces.scores(frame, points))
    f05, f10 = np.mean(found, axis=0)
    return {
        "joints_m": float(error.mean()),
        "aligned_m": float(np.linalg.norm(aligned, axis=2).mean()),
        "limbs_m": float(error[:, LIMBS].mean()),
        "wrists_m": float(error[:, WRISTS].mean()),
        "f05": float(f05),
        "f10": float(f10),
    } | ({} if sigma_m is None else confidence(error, sigma_m))
