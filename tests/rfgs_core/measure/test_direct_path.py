# SPDX-License-Identifier: Apache-2.0
"""Direct paths of the empty room: gains, which links have one, which pair lends its gain."""

from __future__ import annotations

import numpy as np
import pytest

from rfgs_core.measure.direct_path import direct_gain, direct_paths
from rfgs_core.radio import preset
from rfgs_core.radio.constants import SPEED_OF_LIGHT


def between(observations, first: int, second: int) -> np.ndarray:
    """Links from one device to another."""
    elements = observations.layout
    return (elements.tx_device[:, None] == first) & (elements.rx_device == second)


@pytest.fixture
def gain() -> np.ndarray:
    """Another factor for each ordered pair of devices."""
    rng = np.random.default_rng(0)
    return rng.uniform(0.5, 2, (4, 4)) * np.exp(1j * rng.uniform(0, 2 * np.pi, (4, 4)))


def test_friis_has_gain_one(make_observations) -> None:
    observations = make_observations()
    pair, names = observations.pairs
    got = direct_gain(observations, pair, len(names))
    assert len(names) == 16
    np.testing.assert_allclose(got, np.ones(16), atol=1e-5)


def test_each_pairs_factor_is_found_without_held_out_subcarriers(make_observations, gain) -> None:
    subcarriers = np.ones(32, bool)
    subcarriers[20:24] = False
    observations = make_observations(gain=gain, subcarriers=subcarriers)
    pair, names = observations.pairs
    got = direct_gain(observations, pair, len(names))
    np.testing.assert_allclose(got, [gain[a, b] for a, b in names], rtol=1e-5)


def test_paths_rebuild_the_empty_room_at_the_centre(make_observations, gain) -> None:
    """amplitude · exp(−j 2π f τ) at the band's centre against the capture itself."""
    observations = make_observations(gain=gain, num_subcarriers=33)
    paths = direct_paths(observations, observations.links)
    tx, rx = np.nonzero(observations.links)
    link = paths.link.numpy()
    expected = observations.static[tx[link], rx[link], 16]
    turn = np.exp(-2j * np.pi * observations.centre_hz * paths.delay_s.numpy())
    got = paths.amplitude.numpy() * turn
    np.testing.assert_allclose(got, expected, rtol=1e-4, atol=1e-9)
    np.testing.assert_array_equal(paths.a_xyz.numpy(), observations.layout.tx_xyz[tx[link]])
    np.testing.assert_array_equal(paths.b_xyz.numpy(), observations.layout.rx_xyz[rx[link]])
    assert paths.wavelength_m == pytest.approx(SPEED_OF_LIGHT / 5.8e9)


def test_links_within_a_device_have_no_path(make_observations) -> None:
    observations = make_observations()
    paths = direct_paths(observations, observations.links)
    tx, rx = np.nonzero(observations.links)
    with_path = np.isin(np.arange(len(tx)), paths.link.numpy())
    own = observations.layout.tx_device[tx] == observations.layout.rx_device[rx]
    np.testing.assert_array_equal(with_path, ~own)
    assert 0 < len(paths) < len(tx)


def test_a_radar_has_no_paths_at_all(make_observations) -> None:
    observations = make_observations(radio=preset("mmwave"))
    assert observations.monostatic
    assert len(direct_paths(observations, observations.links)) == 0


def test_an_unseen_direction_has_the_gain_of_the_other(make_observations, gain) -> None:
    links = np.ones((4, 64), bool)
    everything = make_observations()
    links[between(everything, 1, 3)] = False
    observations = make_observations(gain=gain, links=links)
    chosen = between(observations, 1, 3)
    paths = direct_paths(observations, chosen)
    length = SPEED_OF_LIGHT * paths.delay_s.numpy()
    got = paths.amplitude.numpy() * 4 * np.pi * length / paths.wavelength_m
    assert len(paths) == 16
    np.testing.assert_allclose(got, np.full(16, gain[3, 1]), rtol=1e-5)


def test_an_unseen_pair_has_the_mean_gain(make_observations, gain) -> None:
    links = np.ones((4, 64), bool)
    everything = make_observations()
    links[between(everything, 1, 3) | between(everything, 3, 1)] = False
    observations = make_observations(gain=gain, links=links)
    paths = direct_paths(observations, between(observations, 3, 1))
    length = SPEED_OF_LIGHT * paths.delay_s.numpy()
    got = paths.amplitude.numpy() * 4 * np.pi * length / paths.wavelength_m
    seen = [(a, b) for a in range(4) for b in range(4) if a != b and {a, b} != {1, 3}]
    mean = np.mean([gain[a, b] for a, b in seen])
    np.testing.assert_allclose(got, np.full(16, mean), rtol=1e-5)
