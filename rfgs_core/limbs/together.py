# SPDX-License-Identifier: Apache-2.0
"""Joints by evidence of a walk and by the network, together, as far as they agree."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float64
from scipy.optimize import root_scalar

from rfgs_core.limbs.propose import Joints, combined
from rfgs_core.limbs.skins import sized
from rfgs_core.measure.observations import Observations

#: Two ways contradict each other in a frame if the mean square of how far they are apart, in units
#: of what both are expected to be off, is more than this: on average it is 0.4 to 1.9 where a walk
#: is right, 4 to 11 where none is or the person is a child (random worlds and recorded motions).
_CONTRADICTION = 3.0
#: Who walks is not contradicted in more than this share of the frames.
_TURNED_AROUND = 0.25
#: The same mean square where a walk is as sure as it says; 1.2 if their errors had nothing in
#: common, but they have (correlation 0.1 to 0.7). What is more than that is put down to the walk:
#: of single people who walk, in every scene and random world, the network is off by what it says.
_AT_ODDS = 0.5
#: How many times less sure than it says a walk may turn out to be.
_MOST_DOUBT = 20.0


def contradiction(one: Joints, other: Joints) -> Float64[np.ndarray, "frame"]:
    """Mean square of how far two ways are apart, for how far off they say that they are."""
    apart_m = np.linalg.norm(one.xyz - other.xyz, axis=-1)
    expected_m = np.hypot(one.sigma_m, other.sigma_m)
    return np.mean((apart_m / expected_m) ** 2, axis=(1, 2))


def walk_with_network(
    walk: Joints,
    network: Joints,
    shapes: Float64[np.ndarray, "body K"],
    seen: list[Observations],
    *,
    others: bool = False,
) -> Joints:
    """Joints told by evidence of a walk of mean bodies and by the network: of both, if they agree.

    Evidence finds the likeliest walk on the floor, whoever it is; the network does not assume one.
    Where they contradict each other in more than a quarter of the frames, it alone counts. If they
    do in single ones only, the walk does there: it is one walk for all frames, while the network is
    asked for each by itself and takes a back for a front now and then.

    The walk becomes that of bodies of the size that the network tells, and less sure where it is
    still far from it. That is after they were found to agree: made as tall as the network says,
    any walk is nearer to it. Beside others, or where packets were filtered, it stays as it is:
    what is left of the others, and noise that is put back, make bodies too small or too tall, and
    the network is further off than it says.

    Args:
        walk: Of all frames, shape (frame, body, 17, ·).
        network: The same.
        shapes: Shapes of these bodies by the network, see `skins.shapes_of`.
        seen: The frames.
        others: Whether others are there.
    """
    contradicted = contradiction(walk, network) > _CONTRADICTION
    if contradicted.mean() > _TURNED_AROUND:
        return network
    if not others and all(one.packets is None for one in seen):
        walk = sized(walk, shapes, float(seen[0].bounds_m[0, 2]))
        walk = _doubted(walk, network, ~contradicted)
    both, lonely = combined(walk, network), contradicted[:, None, None]
    return Joints(
        np.where(lonely[..., None], walk.xyz, both.xyz),
        np.where(lonely, walk.sigma_m, both.sigma_m),
    )


def _doubted(walk: Joints, network: Joints, agree: Bool[np.ndarray, "frame"]) -> Joints:
    """The walk, as sure as its distance from the network allows in frames where they agree.

    Its σ knows doubts of the phase alone. Errors of gaits and bodies that the strides do not know
    show here, and all are scaled until they explain the distance (R. T. Birge, Physical Review 40,
    1932).
    """

    def excess(doubt: float) -> float:
        wider = Joints(walk.xyz, doubt * walk.sigma_m)
        return float(contradiction(wider, network)[agree].mean()) - _AT_ODDS

    if excess(1.0) <= 0.0:
        return walk
    doubt = _MOST_DOUBT
    if excess(doubt) < 0.0:
        doubt = float(root_scalar(excess, bracket=(1.0, doubt)).root)
    return Joints(walk.xyz, doubt * walk.sigma_m)
