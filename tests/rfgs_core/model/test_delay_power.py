# SPDX-License-Identifier: Apache-2.0
"""Delay–angle power maps: their expectation and their level."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest
import torch

from rfgs_core.measure.observations import Observations
from rfgs_core.model.delay_power import RUN_WAVELENGTHS, DelayPowerModel, power_maps
from rfgs_core.propagation import Links, Subcarriers, scatter
from rfgs_core.radio import Layout, layout, place_devices, preset
from rfgs_core.radio.constants import SPEED_OF_LIGHT

BOUNDS_M = np.array([[0.0, 0.0, 0.0], [4.0, 3.0, 2.2]])

POINTS = np.array([[1.2, 1.0, 0.8], [2.4, 2.0, 1.2], [1.9, 1.6, 1.6], [2.7, 1.1, 0.5]])
#: The model takes spreading and delay at the centre of an array of 8 cm, and one wavelength.
TOLERANCE = 0.02


def channels(observations: Observations, points: np.ndarray) -> np.ndarray:
    """What points of unit reflectivity scatter on visible entries, (point, tx, rx, subcarrier)."""
    tx, rx = np.nonzero(observations.links)
    links = Links(
        torch.from_numpy(observations.layout.tx_xyz[tx]),
        torch.from_numpy(observations.layout.rx_xyz[rx]),
    )
    freq_hz = observations.freq_hz
    subcarriers = Subcarriers(float(freq_hz[0]), float(freq_hz[1] - freq_hz[0]), len(freq_hz))
    result = np.zeros((len(points), *observations.delta.shape), np.complex64)
    for index, point in enumerate(points):
        csi = scatter(
            torch.from_numpy(point[None]),
            torch.tensor([[1.0, 0.0, 0.0, 0.0]], dtype=torch.float64),
            torch.full((1, 3), 1e-6, dtype=torch.float64),
            torch.ones(1, 1, dtype=torch.complex128),
            links,
            subcarriers,
        )
        result[index, tx, rx] = csi.numpy()
    return result * observations.subcarriers


@pytest.fixture
def observations(make_observations) -> Observations:
    subcarriers = np.ones(32, bool)
    subcarriers[20:24] = False
    return make_observations(subcarriers=subcarriers)


@pytest.mark.parametrize("name", ["small", "mmwave"])
def test_maps_of_single_points_follow_the_model(make_observations, name: str) -> None:
    """One point has no phase to average over: the map itself is the expectation."""
    observations = make_observations(radio=None if name == "small" else preset(name))
    for index, csi in enumerate(channels(observations, POINTS)):
        model = DelayPowerModel(observations.with_delta(csi), POINTS)
        assert len(model.parts) == (16 if name == "small" else 4)
        power = np.zeros(len(POINTS), np.float32)
        power[index] = 1.0
        for part, (_, _, data) in enumerate(model.parts):
            expected = model.expected(part, power)
            assert np.abs(expected - data).max() < TOLERANCE * data.max()
            assert expected.sum() == pytest.approx(data.sum(), rel=TOLERANCE)


def test_expected_map_is_the_mean_over_phases(observations: Observations) -> None:
    power = np.array([0.5, 2.0, 1.0, 0.7], np.float32)
    single = channels(observations, POINTS) * np.sqrt(power)[:, None, None, None]
    rng = np.random.default_rng(0)
    draws = []
    for _ in range(300):
        turn = np.exp(2j * np.pi * rng.random(len(POINTS)))
        delta = np.tensordot(turn, single, axes=1)
        draws.append([entry.power for entry in power_maps(observations.with_delta(delta))])
    model = DelayPowerModel(observations.with_delta(delta), POINTS)
    for part, (_, _, data) in enumerate(model.parts):
        maps = np.stack([draw[part] for draw in draws])
        # Delays at which no point answers are left out of the model.
        kept = np.isin(maps[-1, :, 0], data[:, 0])
        assert kept.sum() == len(data) > 30
        mean = maps.mean(axis=0)
        spread = maps.std(axis=0) / np.sqrt(len(maps))
        error = np.abs(model.expected(part, power) - mean[kept])
        assert (error < 5 * spread[kept] + TOLERANCE * mean.max()).all()
        # There, each of the four points has at most a thousandth of its peak.
        assert mean[~kept].max() < 4e-3 * mean.max()


def test_scaling_matches_the_total_power(observations: Observations) -> None:
    delta = channels(observations, POINTS).sum(axis=0)
    model = DelayPowerModel(observations.with_delta(delta), POINTS)
    seen = np.full((len(model.parts), 4), 0.5, np.float32)
    power = model.scaled(np.array([1, 2, 3, 4], np.float32), seen)
    np.testing.assert_allclose(power / power[0], [1, 2, 3, 4], rtol=1e-5)
    have = sum(float(model.expected(k, power * seen[k]).sum()) for k in range(len(seen)))
    assert have == pytest.approx(sum(float(part[2].sum()) for part in model.parts), rel=1e-4)


def test_clocks_do_not_matter(observations: Observations) -> None:
    """A phase per link pair of devices leaves all maps as they are."""
    delta = channels(observations, POINTS).sum(axis=0)
    pair, names = observations.pairs
    turn = np.exp(2j * np.pi * np.random.default_rng(2).random(len(names)))
    turned = observations.with_delta(delta * turn[pair][..., None])
    for first, second in zip(
        power_maps(observations.with_delta(delta)), power_maps(turned), strict=True
    ):
        np.testing.assert_allclose(
            second.power, first.power, rtol=1e-3, atol=1e-6 * first.power.max()
        )


@pytest.fixture
def circling() -> Observations:
    """An antenna that goes around the points, far out: wider than any far field."""
    radio = preset("sar")
    places = place_devices(radio, BOUNDS_M)[::4]
    each = [layout(radio, places, number) for number in range(len(places))]
    count, names = len(places), [f.name for f in fields(Layout) if f.name != "measured"]
    elements = Layout(
        **{name: np.concatenate([getattr(one, name) for one in each]) for name in names},
        measured=np.eye(count, dtype=bool),
    )
    nothing = np.zeros((count, count, 64), np.complex64)
    freq_hz = np.linspace(9.6e9, 10.4e9, 64)
    every = np.ones(64, bool)
    return Observations(nothing, nothing, elements.measured, every, elements, freq_hz, BOUNDS_M)


def test_a_wide_aperture_makes_several_maps(circling: Observations) -> None:
    """Of one point each map is the expectation, though the aperture as a whole has no far field."""
    wavelength_m = SPEED_OF_LIGHT / circling.centre_hz
    for index, csi in enumerate(channels(circling, POINTS)):
        model = DelayPowerModel(circling.with_delta(csi), POINTS)
        assert sum(len(entry.tx_xyz) for entry in model.maps) == len(circling.layout.tx_xyz)
        assert len(model.maps) > 5
        power = np.zeros(len(POINTS), np.float32)
        power[index] = 1.0
        for part, (_, _, data) in enumerate(model.parts):
            width_m = np.linalg.norm(np.ptp(model.maps[part].tx_xyz, axis=0))
            assert width_m <= RUN_WAVELENGTHS * wavelength_m
            assert np.abs(model.expected(part, power) - data).max() < TOLERANCE * data.max()
