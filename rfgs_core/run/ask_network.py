# SPDX-License-Identifier: Apache-2.0
"""What the network makes of a run's people, each without the echoes of the others."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from rfgs_core.bodies.separation import GAUSSIANS_PER_BODY, each_alone_posed
from rfgs_core.bodies.tracks import Tracks
from rfgs_core.limbs.postures.going import hanging
from rfgs_core.limbs.postures.through import propose_alone, propose_beside
from rfgs_core.limbs.propose import Joints, smoothed
from rfgs_core.limbs.skins import PosedPeople, shapes_of
from rfgs_core.limbs.weights import Trained
from rfgs_core.measure.observations import Observations
from rfgs_core.settings import TrainConfig

#: How often it is asked anew without the echoes of the others as these are posed by then.
ROUNDS = 2


def by_network(
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


def asked_anew(
    trained: Trained,
    seen: list[Observations],
    said: list[Joints],
    tracks: list[Tracks],
    config: TrainConfig,
    on_frame: Callable[[], Any],
) -> list[Joints]:
    """What the network says without the echoes of the others, posed as it has said by then."""
    said = _with_arms(said, tracks)
    for _ in range(ROUNDS):
        alone = _without_others(seen, Joints.side_by_side(said), config, on_frame)
        said = _with_arms(by_network(trained, alone, tracks), tracks)
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
