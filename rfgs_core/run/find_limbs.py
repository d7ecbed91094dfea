# SPDX-License-Identifier: Apache-2.0
"""Finds the limbs of a run's people: followed through all frames, told and posed."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any

import numpy as np
from jaxtyping import Float64

from rfgs_core.bodies.localise import pair_maps
from rfgs_core.bodies.separation import each_alone
from rfgs_core.bodies.sizes import looks as size_looks
from rfgs_core.bodies.sizes import sizes
from rfgs_core.bodies.tracks import Tracks
from rfgs_core.errors import RfgsFormatError
from rfgs_core.fit.frame import followed
from rfgs_core.limbs.evidence.tell import long_enough, looks, stands, tell
from rfgs_core.limbs.evidence.track import GOES_M_S, course_of
from rfgs_core.limbs.postures.tell import can_tell
from rfgs_core.limbs.postures.tell import looks as posture_looks
from rfgs_core.limbs.postures.tell import tell as tell_posture
from rfgs_core.limbs.propose import SMOOTH_S, Joints, of_walk_and_network
from rfgs_core.limbs.skins import PosedPeople, shapes_of
from rfgs_core.limbs.weights import Trained, own_network
from rfgs_core.measure.observations import Observations
from rfgs_core.run.ask_network import ROUNDS, asked_anew, by_network
from rfgs_core.run.folder import LIMBS_FILE, Run
from rfgs_core.run.limbs import REMEDY, Limbs, read_limbs, store_limbs
from rfgs_core.run.people import known_people
from rfgs_core.seeds import sub_seed
from rfgs_core.settings import TrainConfig

_LOG = logging.getLogger(__name__)
#: Limbs that are expected to be further off on average than this, and than this where somebody
#: lies, are left alone: joints of a standing body at the right place are 0.11 m off those of one
#: who walks, those of the prior of who lies some 0.4 m. But not those that are so many times
#: further from a standing body than they are expected to be off: it is further off.
_UNSURE_M, _UNSURE_LYING_M, _FAR = 0.15, 0.3, 1.2


def limbs_wanted(run: Run, config: TrainConfig) -> bool:
    """Whether limbs are asked for and the radio's report may tell them."""
    if config.limbs == "off" or config.observe != "complex" or config.recipe == "paper":
        return False
    if config.density not in (None, "none") or config.calibrate != "none":
        return False
    return not run.sequence.radio_spec(run.config.radio).antennas_move


def limbs_network(run: Run) -> Trained | None:
    """The network for a run's radio; None where there is none, and evidence alone may tell."""
    coordinates = run.sequence.coordinates(run.config.radio)
    return own_network(np.asarray(coordinates["freq_hz"].values, dtype=np.float64))


def find_limbs(
    run: Run,
    config: TrainConfig,
    trained: Trained | None,
    on_frame: Callable[[], Any] = lambda: None,
    seeking: Callable[[int], Callable[[], Any]] = lambda _: lambda: None,
) -> Limbs | None:
    """Follows people through a run's frames and poses them; what is kept is read.

    Evidence tells those of people who walk, or else whatever they do; the network tells those of
    everybody: both together count where both tell. Where neither does for some, these stand, and
    so does everybody where neither does for any, if all of them go somewhere all the time.
    Frames of the sequence beside those of the run, near enough to smooth them, are read as well.

    Args:
        run: The run.
        config: Its settings.
        trained: The network for its radio; None where there is none.
        on_frame: Called as frames are read and looked at; see `looks_at`.
        seeking: Told how many looks it takes to seek other postures than walks, if it is done;
            what it gives is called at each.

    Returns:
        None where nothing can be told, or nothing that would be of use.
    """
    kept = read_limbs(run.path)
    if kept is not None:
        if not set(run.frames) <= set(kept.frames):
            raise RfgsFormatError(
                f"{run.path / LIMBS_FILE}: frames of the run are missing; {REMEDY}"
            )
        return kept
    frames = frames_read(run)
    seen, tracks, alone = _read(run, frames, config, on_frame)
    # A vehicle is a body too, and does not walk.
    only_people = len(alone[0]) == known_people(run)
    walks = only_people and evidence_tells(run, frames)
    told: list[Joints | None] = [None] * len(alone[0])
    shapes = np.zeros((len(told), 1))
    if walks and trained is None:
        shapes = sizes(seen, np.array([track.axes_xy for track in tracks]), on_frame)
    if walks:
        told = _by_evidence(alone, tracks, shapes, config.seed, on_frame)
        told = _by_postures(told, alone, tracks, shapes, config.seed, seeking)
    if trained is not None:
        said = by_network(trained, alone, tracks)
        if only_people and len(said) > 1:
            said = asked_anew(trained, seen, said, tracks, config, on_frame)
        shapes = shapes_of(Joints.side_by_side(said))
        told = [
            other if one is None else of_walk_and_network(one, other)
            for one, other in zip(told, said, strict=True)
        ]
    if walks and not any(told):
        told = _upright(alone, tracks, shapes)
    if not any(told):
        return None
    joints = _together(told, alone, tracks, shapes)
    own = [frames.index(frame) for frame in run.frames]
    joints = Joints(joints.xyz[own], joints.sigma_m[own])
    alone, tracks = [alone[k] for k in own], [tracks[k] for k in own]
    if not _of_use(joints, alone, tracks):
        _LOG.warning(
            "limbs are expected to be %.2f m off, more than %.2f m: bodies stay without",
            joints.sigma_m.mean(),
            _unsure_m(tracks),
        )
        return None
    limbs = Limbs(list(run.frames), tracks, joints, PosedPeople.through(joints, shapes))
    store_limbs(run.path, limbs)
    return limbs


def _read(
    run: Run, frames: list[int], config: TrainConfig, on_frame: Callable[[], Any]
) -> tuple[list[Observations], list[Tracks], list[list[Observations]]]:
    """Frames, where bodies are in each, and each once for each body without the others."""
    seen: list[Observations] = []
    tracks: list[Tracks] = []
    alone: list[list[Observations]] = []
    for frame in frames:
        seed = sub_seed(config.seed, run.config.sequence, run.config.radio, frame, "fit")
        seen.append(run.observations(frame))
        tracks.append(followed(tracks[-1] if tracks else None, seen[-1], config, seed))
        alone.append(_alone(seen[-1], tracks[-1].axes_xy, config, seed))
        on_frame()
    return seen, tracks, alone


def evidence_tells(run: Run, frames: list[int]) -> bool:
    """Whether frames are those of people and show enough of a walk."""
    sequence = run.sequence
    time_s = np.array([sequence.time_s(frame) for frame in frames])
    return known_people(run) > 0 and long_enough(time_s)


def looks_at(run: Run, trained: Trained | None) -> int:
    """How often `find_limbs` calls `on_frame`, if somebody walks wherever evidence may tell."""
    frames, people = frames_read(run), known_people(run)
    by_evidence = people * looks(len(frames)) if evidence_tells(run, frames) else 0
    if by_evidence and trained is None:
        by_evidence += size_looks(people, len(frames))
    rounds = ROUNDS if trained is not None and people > 1 else 0
    return (1 + rounds) * len(frames) + by_evidence


def _alone(
    observations: Observations,
    axes_xy: Float64[np.ndarray, "body 2"],
    config: TrainConfig,
    seed: int,
) -> list[Observations]:
    """A frame once for each body, without the echoes of the others."""
    if len(axes_xy) == 1:
        return [observations]
    return each_alone(observations, pair_maps(observations), axes_xy, config, seed)


def _by_evidence(
    alone: list[list[Observations]],
    tracks: list[Tracks],
    shapes: Float64[np.ndarray, "body K"],
    seed: int,
    on_frame: Callable[[], Any],
) -> list[Joints | None]:
    """Joints of each person in all frames; None of somebody of whom evidence tells nothing."""
    axes_xy = np.array([track.axes_xy for track in tracks])
    found = []
    for body, shape in enumerate(shapes):
        told = tell([frame[body] for frame in alone], axes_xy[:, body], seed, on_frame, shape)
        found.append(None if told is None else told.joints)
    return found


def _by_postures(
    told: list[Joints | None],
    alone: list[list[Observations]],
    tracks: list[Tracks],
    shapes: Float64[np.ndarray, "body K"],
    seed: int,
    seeking: Callable[[int], Callable[[], Any]],
) -> list[Joints | None]:
    """Joints in all frames, as `told` where a walk is; None of whom nothing is.

    Of several people nobody is posed this way: what is left of the others' echoes poses them
    worse than the prior has them (`two_crossing`).
    """
    if len(told) > 1 or told[0] is not None or not can_tell(alone[0][0]):
        return told
    on_frame = seeking(posture_looks(len(alone)))
    axes_xy = np.array([track.axes_xy[0] for track in tracks])
    one = tell_posture([frame[0] for frame in alone], axes_xy, seed, on_frame, shapes[0])
    return [None if one is None else one.joints]


def _upright(
    alone: list[list[Observations]], tracks: list[Tracks], shapes: Float64[np.ndarray, "body K"]
) -> list[Joints | None]:
    """Bodies that stand, facing the way they go, where nobody stays; else nothing is known.

    Who goes neither sits nor lies, and a body that stands is nearer to them than the prior.
    """
    time_s = np.array([track.time_s for track in tracks])
    upright: list[Joints | None] = []
    for body, shape in enumerate(shapes):
        axes_xy = np.array([track.axes_xy[body] for track in tracks])
        heading, speed_m_s = course_of(axes_xy, time_s)
        if speed_m_s.min() < GOES_M_S:
            return [None] * len(alone[0])
        upright.append(stands([frame[body] for frame in alone], axes_xy, heading, shape))
    return upright


def _together(
    told: list[Joints | None],
    alone: list[list[Observations]],
    tracks: list[Tracks],
    shapes: Float64[np.ndarray, "body K"],
) -> Joints:
    """Everybody's joints, standing where nothing is known of somebody."""
    whole = []
    for body, joints in enumerate(told):
        axes_xy = np.array([track.axes_xy[body] for track in tracks])
        seen = [frame[body] for frame in alone]
        whole.append(joints or stands(seen, axes_xy, shape=shapes[body]))
    return Joints.side_by_side(whole)


def _of_use(joints: Joints, alone: list[list[Observations]], tracks: list[Tracks]) -> bool:
    """Whether joints say more than that somebody stands, or lies as was found."""
    expected_m = float(joints.sigma_m.mean())
    if expected_m <= _unsure_m(tracks):
        return True
    if any(track.bodies.lies.any() for track in tracks):
        return False
    bodies = joints.xyz.shape[1]
    standing = _together([None] * bodies, alone, tracks, np.zeros((bodies, 1)))
    apart_m = np.linalg.norm(joints.xyz - standing.xyz, axis=-1).mean()
    return float(apart_m) > _FAR * expected_m


def _unsure_m(tracks: list[Tracks]) -> float:
    """How far off limbs may be expected to be on average, by who lies and who does not [m]."""
    lies = np.array([track.bodies.lies for track in tracks])
    return float(np.where(lies, _UNSURE_LYING_M, _UNSURE_M).mean())


def frames_read(run: Run) -> list[int]:
    """Frames of the run, and those of its sequence that smooth them."""
    sequence = run.sequence
    own = np.array([sequence.time_s(frame) for frame in run.frames])
    return [
        frame
        for frame in sequence.frames
        if np.abs(own - sequence.time_s(frame)).min() <= SMOOTH_S + 1e-6
    ]
