# SPDX-License-Identifier: Apache-2.0
"""What the network makes of one person through a sequence: of all that it may be, what goes on.

It looks at single frames. Of somebody alone, entries that are hidden are told from the visible ones
first, so that maps have narrower beams and lower side lobes; what is left of others beside somebody
is no echo to be carried on. Now and then it takes a back for a front, and beside the place of
somebody who lies it takes heads for feet, and is the less sure.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Float64

from rfgs_core.limbs.network import LimbNetwork
from rfgs_core.limbs.postures.chain import TEMPER, likeliest_path
from rfgs_core.limbs.postures.going import facing, fronts
from rfgs_core.limbs.propose import SURE_M, Joints, propose
from rfgs_core.measure.completion import complete
from rfgs_core.measure.observations import Observations
from rfgs_core.skeleton import JOINTS

#: Places from which it is asked again [m]: who lies is found so far off.
_BESIDE_M = 0.3 * np.array([[np.cos(a), np.sin(a)] for a in np.arange(8) * np.pi / 4])
#: A place this far from the middle between those of the frames before and after may be that of an
#: echo [m].
_ASTRAY_M = 0.3
#: Within this ratio of σ it is as sure wherever it is asked.
_AS_SURE = 1.05


def propose_alone(
    network: LimbNetwork,
    seen: list[Observations],
    axes_xy: Float[np.ndarray, "frame 2"],
    time_s: Float64[np.ndarray, "frame"],
) -> Joints:
    """Joints of somebody with nobody else near, whom the network might find instead.

    Where it is less sure than `SURE_M` it begins again from eight places around, and, of who is
    astray, from where the frames before and after have them: the place found may be an echo's. Of
    each frame that counts which is surest and goes on from the frames before and after. Frames
    whose packets were filtered are asked once.

    Args:
        network: The network of this kind of radio.
        seen: Frames in the order of time.
        axes_xy: Where the person is in each [m].
        time_s: Their times [s].

    Returns:
        Of all frames, shape (frame, 1, 17, ·).
    """
    told, places = [], np.asarray(axes_xy, np.float64)
    for number, frame in enumerate(seen):
        observations, place = complete(frame), places[number]
        one = propose(network, observations, place[None])
        if one.sigma_m.mean() > SURE_M and observations.packets is None:
            one = _together(one, propose(network, observations, place + _BESIDE_M))
            elsewhere = _elsewhere(places, number)
            if len(elsewhere):
                one = _both(one, propose(network, observations, elsewhere))
        told.append(one)
    # Of joints with the same σ, what is more certain is likelier.
    score = [-len(JOINTS) / TEMPER * np.log(one.sigma_m.mean(axis=1)) for one in told]
    path = likeliest_path(score, [one.xyz for one in told], time_s)
    chosen = list(zip(told, path.tolist(), strict=True))
    joints = Joints(
        np.array([one.xyz[[row]] for one, row in chosen]),
        np.array([one.sigma_m[[row]] for one, row in chosen]),
    )
    return fronts(joints, time_s)


def propose_beside(
    network: LimbNetwork,
    alone: list[Observations],
    axes_xy: Float[np.ndarray, "frame 2"],
    time_s: Float64[np.ndarray, "frame"],
) -> Joints:
    """Joints of somebody beside others, who looks where they go.

    Args:
        network: The network of this kind of radio.
        alone: Frames in the order of time, without the echoes of the others.
        axes_xy: Where the person is in each [m].
        time_s: Their times [s].

    Returns:
        Of all frames, shape (frame, 1, 17, ·).
    """
    told = [
        propose(network, observations, place[None])
        for observations, place in zip(alone, axes_xy, strict=True)
    ]
    joints = Joints(*(np.array(values) for values in zip(*told, strict=True)))
    return facing(fronts(joints, time_s), time_s)


def _elsewhere(
    places: Float64[np.ndarray, "frame 2"], number: int
) -> Float64[np.ndarray, "place 2"]:
    """Where the frames before and after have the person, if this one is astray from these [m]."""
    near = places[[number - 1, number + 1]] if 0 < number < len(places) - 1 else places[:0]
    astray = len(near) > 0 and np.linalg.norm(places[number] - near.mean(axis=0)) > _ASTRAY_M
    return near if astray else places[:0]


def _together(found: Joints, others: Joints) -> Joints:
    """Both, one after the other, or the first alone if it makes no difference where it is asked."""
    both = _both(found, others)
    sigma_m = both.sigma_m.mean(axis=1)
    return both if sigma_m.max() > _AS_SURE * sigma_m.min() else found


def _both(one: Joints, other: Joints) -> Joints:
    """One after the other."""
    return Joints(*(np.concatenate(values) for values in zip(one, other, strict=True)))
