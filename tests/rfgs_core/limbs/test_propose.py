# SPDX-License-Identifier: Apache-2.0
"""What the network that comes along says of somebody whom radars hear, from where it is asked."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rfgs_core.encode.body_maps import CENTRE_HEIGHT_M, body_maps
from rfgs_core.limbs.postures.through import propose_alone
from rfgs_core.limbs.propose import Joints, propose
from rfgs_core.limbs.weights import own_network
from rfgs_core.measure.completion import complete
from rfgs_core.measure.observations import Observations


def said(observations: Observations, place_xy: np.ndarray) -> Joints:
    trained = own_network(observations.freq_hz)
    assert trained is not None
    return propose(trained.network, observations, place_xy[None])


@pytest.mark.parametrize("off_m", [0.0, 0.25, 0.4])
def test_joints_are_found_from_places_beside_the_body(
    heard_by_radars: tuple[Observations, np.ndarray], off_m: float
) -> None:
    """A body that it has not seen, whose echoes are summed facet by facet."""
    observations, joints = heard_by_radars
    found = said(observations, joints[:, :2].mean(axis=0) + off_m * np.array([0.6, -0.8]))
    error_m = np.linalg.norm(found.xyz[0] - joints, axis=1)
    assert error_m.mean() < 0.08
    assert 0.3 < error_m.mean() / found.sigma_m.mean() < 1.5


def test_where_nothing_is_heard_joints_are_anywhere_within_a_metre(
    heard_by_radars: tuple[Observations, np.ndarray],
) -> None:
    observations, _ = heard_by_radars
    silent = replace(observations, delta=np.zeros_like(observations.delta))
    found = said(silent, np.array([0.5, 0.2]))
    np.testing.assert_allclose(found.xyz[0], np.broadcast_to([0.5, 0.2, 0.95], (17, 3)), atol=0.1)
    assert (found.sigma_m == 1.0).all()


def said_alone(seen: list[Observations], axes_xy: np.ndarray) -> Joints:
    trained = own_network(seen[0].freq_hz)
    assert trained is not None
    return propose_alone(trained.network, seen, axes_xy, np.arange(len(seen), dtype=np.float64))


def test_hidden_entries_are_told_before_the_network_reads(
    heard_by_radars: tuple[Observations, np.ndarray],
) -> None:
    """Maps of a held-out frame are those of the whole one, and so is what is said of them."""
    whole, joints = heard_by_radars
    columns = whole.layout.rx_column
    links = whole.links & (columns < columns.max() + 1 - (columns.max() + 1) // 4)
    subcarriers = whole.subcarriers.copy()
    subcarriers[len(subcarriers) * 5 // 8 : len(subcarriers) * 3 // 4] = False
    seen = links[..., None] & subcarriers
    held_out = replace(
        whole, links=links, subcarriers=subcarriers, delta=np.where(seen, whole.delta, 0)
    )
    centre = np.array([*joints[:, :2].mean(axis=0), CENTRE_HEIGHT_M])

    def maps(one: Observations) -> np.ndarray:
        return body_maps(
            one.delta, one.layout, one.links, one.freq_hz, one.subcarriers, centre
        )  # fmt: skip

    def apart(one: Observations) -> float:
        return float(np.linalg.norm(maps(one) - maps(whole)) / np.linalg.norm(maps(whole)))

    assert apart(complete(held_out)) < 0.2 * apart(held_out)
    place = joints[:, :2].mean(axis=0)
    as_whole = said_alone([whole], place[None]).xyz[0, 0]
    off_m = [
        np.linalg.norm(xyz - as_whole, axis=1).mean()
        for xyz in (said_alone([held_out], place[None]).xyz[0, 0], said(held_out, place).xyz[0])
    ]
    assert off_m[0] < 0.5 * off_m[1]


def test_beside_who_lies_heads_are_no_longer_taken_for_feet(
    who_lies_heard_by_radars: tuple[Observations, np.ndarray],
) -> None:
    observations, joints = who_lies_heard_by_radars
    places = joints[0, :2] + np.array([[-0.25, -0.25], [0.0, 0.35], [0.0, 0.0]])
    once = np.array([said(observations, place).xyz[0] for place in places])
    through = said_alone([observations] * 3, places)
    alone = said_alone([observations], places[:1])
    error_m = np.linalg.norm(once - joints, axis=2).mean(axis=1)
    better_m = np.linalg.norm(through.xyz[:, 0] - joints, axis=2).mean(axis=1)
    assert error_m[0] > 0.8, "the case is too easy"
    assert better_m.max() < 0.35
    assert better_m.mean() < 0.6 * error_m.mean()
    assert np.linalg.norm(alone.xyz[0, 0] - joints, axis=1).mean() < 0.35
    # How far they are expected to be off is told, too.
    assert 0.5 < better_m.mean() / through.sigma_m.mean() < 2.0


def test_where_a_frame_has_an_echo_it_is_asked_at_the_place_of_the_frames_beside(
    who_lies_heard_by_radars: tuple[Observations, np.ndarray],
) -> None:
    """A place over a metre off, too far for those that are asked around it."""
    observations, joints = who_lies_heard_by_radars
    places = joints[0, :2] + np.array([[0.0, 0.0], [1.2, 0.7], [0.0, 0.0]])
    lost, through = (said_alone([observations] * len(at), at) for at in (places[[1]], places))
    assert np.linalg.norm(lost.xyz[0, 0] - joints, axis=1).mean() > 0.8, "the case is too easy"
    assert np.linalg.norm(through.xyz[1, 0] - joints, axis=1).mean() < 0.35


def test_whom_the_network_is_sure_of_it_is_asked_once(
    heard_by_radars: tuple[Observations, np.ndarray],
) -> None:
    observations, joints = heard_by_radars
    places = joints[:, :2].mean(axis=0) + np.array([[0.0, 0.0], [0.2, 0.1]])
    alone = said_alone([observations] * 2, places)
    once = [said(observations, place) for place in places]
    np.testing.assert_array_equal(alone.xyz, [one.xyz for one in once])
    np.testing.assert_array_equal(alone.sigma_m, [one.sigma_m for one in once])
