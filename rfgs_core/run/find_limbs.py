# SPDX-License-Identifier: Apache-2.0
"""Finds the limbs of a run's people: followed through all frames, told and posed."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any

import numpy as np
from jaxtyping import Float64

from rfgs_core.bodies.localise import pair_maps
from rfgs_core.bodies.separation import GAUSSIANS_PER_BODY, each_alone, each_alone_posed
from rfgs_core.bodies.tracks import Tracks
from rfgs_core.errors import RfgsFormatError
from rfgs_core.fit.frame import followed
from rfgs_core.limbs.evidence.tell import long_enough, looks, stands, tell
from rfgs_core.limbs.evidence.track import GOES_M_S, course_of
from rfgs_core.limbs.postures.going import hanging
from rfgs_core.limbs.postures.tell import can_tell
from rfgs_core.limbs.postures.tell import looks as posture_looks
from rfgs_core.limbs.postures.tell import tell as tell_posture
from rfgs_core.limbs.postures.through import propose_alone, propose_beside
from rfgs_core.limbs.propose import SMOOTH_S, Joints, smoothed
from rfgs_core.limbs.skins import PosedPeople, shapes_of
from rfgs_core.limbs.together import walk_with_network
from rfgs_core.limbs.weights import Trained, own_network
from rfgs_core.measure.observations import Observations
from rfgs_core.run.costs import FIND, POSE
from rfgs_core.run.folder import LIMBS_FILE, Run
from rfgs_core.run.limbs import REMEDY, Limbs, read_limbs, store_limbs
from rfgs_core.run.people import known_people
from rfgs_core.run.pose_bars import Begin, no_bar
from rfgs_core.seeds import sub_seed
from rfgs_core.settings import TrainConfig

_LOG = logging.getLogger(__name__)
#: Limbs that are expected to be further off on average than this, and than this where somebody
#: lies, are left alone: joints of a standing body at the right place are 0.11 m off those of one
#: who walks, those of the prior of who lies some 0.4 m. But not those that are so many times
#: further from a standing body than they are expected to be off: it is further off.
_UNSURE_M, _UNSURE_LYING_M, _FAR = 0.15, 0.3, 1.2
#: How often the network is asked anew without the echoes of the others as these are posed by then.
_ROUNDS = 2


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
    begin: Begin = no_bar,
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
        begin: Told of each stage: people are found (`FIND`) and posed (`POSE`, `looks_at`), and
            other postures than walks are sought if there are some to find.

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
    frames, seen, tracks, alone = _read(run, frames, config, begin(FIND, len(frames)))
    # A vehicle is a body too, and does not walk.
    only_people = len(alone[0]) == known_people(run)
    walks = only_people and evidence_tells(run, frames)
    told: list[Joints | None] = [None] * len(alone[0])
    on_frame = begin(POSE, looks_at(run, trained) if only_people else 0)
    if walks:
        told = _by_evidence(alone, tracks, config.seed, on_frame)
        told = _by_postures(told, alone, tracks, config.seed, begin)
    shapes = None
    if trained is not None:
        said = _by_network(trained, alone, tracks)
        if only_people and len(said) > 1:
            said = _asked_anew(trained, seen, said, tracks, config, on_frame)
        shapes = shapes_of(_side_by_side(said))
        others = len(said) > 1
        told = [
            other if one is None else walk_with_network(one, other, shape, seen, others=others)
            for one, other, shape in zip(told, said, shapes[:, None], strict=True)
        ]
    if walks and not any(told):
        told = _upright(alone, tracks)
    if not any(told):
        return None
    joints = _together(told, alone, tracks)
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
) -> tuple[list[int], list[Observations], list[Tracks], list[list[Observations]]]:
    """Frames, where bodies are in each, and each once for each body without the others.

    Frames beside those of the run in which nobody is heard, since people come and go, are left out.
    """
    kept: list[int] = []
    seen: list[Observations] = []
    tracks: list[Tracks] = []
    alone: list[list[Observations]] = []
    for frame in frames:
        seed = sub_seed(config.seed, run.config.sequence, run.config.radio, frame, "fit")
        heard = run.observations(frame)
        if heard.changed or frame in run.frames:
            kept.append(frame)
            seen.append(heard)
            tracks.append(followed(tracks[-1] if tracks else None, heard, config, seed))
            alone.append(_alone(heard, tracks[-1].axes_xy, config, seed))
        on_frame()
    return kept, seen, tracks, alone


def evidence_tells(run: Run, frames: list[int]) -> bool:
    """Whether frames are those of people and show enough of a walk."""
    sequence = run.sequence
    time_s = np.array([sequence.time_s(frame) for frame in frames])
    return known_people(run) > 0 and long_enough(time_s)


def looks_at(run: Run, trained: Trained | None) -> int:
    """How often frames are looked at to pose people, if they walk wherever evidence may tell."""
    frames, people = frames_read(run), known_people(run)
    by_evidence = people * looks(len(frames)) if evidence_tells(run, frames) else 0
    rounds = _ROUNDS if trained is not None and people > 1 else 0
    return rounds * len(frames) + by_evidence


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
    alone: list[list[Observations]], tracks: list[Tracks], seed: int, on_frame: Callable[[], Any]
) -> list[Joints | None]:
    """Joints of each person in all frames; None of somebody of whom evidence tells nothing."""
    axes_xy = np.array([track.axes_xy for track in tracks])
    found = []
    for body in range(axes_xy.shape[1]):
        told = tell([frame[body] for frame in alone], axes_xy[:, body], seed, on_frame)
        found.append(None if told is None else told.joints)
    return found


def _by_postures(
    told: list[Joints | None],
    alone: list[list[Observations]],
    tracks: list[Tracks],
    seed: int,
    begin: Begin,
) -> list[Joints | None]:
    """Joints in all frames, as `told` where a walk is; None of whom nothing is.

    Of several people nobody is posed this way: what is left of the others' echoes poses them
    worse than the prior has them (`two_crossing`).
    """
    if len(told) > 1 or told[0] is not None or not can_tell(alone[0][0]):
        return told
    on_frame = begin("seeking postures", posture_looks(len(alone)))
    axes_xy = np.array([track.axes_xy[0] for track in tracks])
    one = tell_posture([frame[0] for frame in alone], axes_xy, seed, on_frame)
    return [None if one is None else one.joints]


def _upright(alone: list[list[Observations]], tracks: list[Tracks]) -> list[Joints | None]:
    """Bodies that stand, facing the way they go, where nobody stays; else nothing is known.

    Who goes neither sits nor lies, and a body that stands is nearer to them than the prior.
    """
    time_s = np.array([track.time_s for track in tracks])
    upright: list[Joints | None] = []
    for body in range(len(alone[0])):
        axes_xy = np.array([track.axes_xy[body] for track in tracks])
        heading, speed_m_s = course_of(axes_xy, time_s)
        if speed_m_s.min() < GOES_M_S:
            return [None] * len(alone[0])
        upright.append(stands([frame[body] for frame in alone], axes_xy, heading))
    return upright


def _by_network(
    trained: Trained, alone: list[list[Observations]], tracks: list[Tracks]
) -> list[Joints]:
    """Joints of each person in all frames, on curves through them."""
    time_s = np.array([track.time_s for track in tracks])
    axes_xy = np.array([track.axes_xy for track in tracks])
    ask = propose_alone if len(alone[0]) == 1 else propose_beside
    found = []
    for body in range(len(alone[0])):
        seen = [frame[body] for frame in alone]
        joints = ask(trained.network, seen, axes_xy[:, body], time_s)
        found.append(smoothed(joints, time_s))
    return found


def _asked_anew(
    trained: Trained,
    seen: list[Observations],
    said: list[Joints],
    tracks: list[Tracks],
    config: TrainConfig,
    on_frame: Callable[[], Any],
) -> list[Joints]:
    """What the network says without the echoes of the others, posed as it has said by then."""
    said = _with_arms(said, tracks)
    for _ in range(_ROUNDS):
        alone = _without_others(seen, _side_by_side(said), config, on_frame)
        said = _with_arms(_by_network(trained, alone, tracks), tracks)
    return said


def _with_arms(said: list[Joints], tracks: list[Tracks]) -> list[Joints]:
    """The same, arms hanging of who goes somewhere."""
    time_s = np.array([track.time_s for track in tracks])
    return [hanging(joints, time_s) for joints in said]


def _without_others(
    seen: list[Observations], joints: Joints, config: TrainConfig, on_frame: Callable[[], Any]
) -> list[list[Observations]]:
    """Each frame once for each person, without the echoes of the others in their poses."""
    count, alone = joints.xyz.shape[1], []
    posed = PosedPeople.through(joints, shapes_of(joints))
    for frame, observations in enumerate(seen):
        skin = posed.gaussians(frame, GAUSSIANS_PER_BODY * count, config.seed)
        alone.append(
            each_alone_posed(observations, skin.points, skin.normals, skin.body, count, config)
        )
        on_frame()
    return alone


def _together(
    told: list[Joints | None], alone: list[list[Observations]], tracks: list[Tracks]
) -> Joints:
    """Everybody's joints, standing where nothing is known of somebody."""
    whole = []
    for body, joints in enumerate(told):
        axes_xy = np.array([track.axes_xy[body] for track in tracks])
        whole.append(joints or stands([frame[body] for frame in alone], axes_xy))
    return _side_by_side(whole)


def _side_by_side(people: list[Joints]) -> Joints:
    """Joints of several people, each of shape (frame, 1, 17, ·), as one of them all."""
    return Joints(*(np.concatenate(values, axis=1) for values in zip(*people, strict=True)))


def _of_use(joints: Joints, alone: list[list[Observations]], tracks: list[Tracks]) -> bool:
    """Whether joints say more than that somebody stands, or lies as was found."""
    expected_m = float(joints.sigma_m.mean())
    if expected_m <= _unsure_m(tracks):
        return True
    if any(track.bodies.lies.any() for track in tracks):
        return False
    standing = _together([None] * joints.xyz.shape[1], alone, tracks)
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
