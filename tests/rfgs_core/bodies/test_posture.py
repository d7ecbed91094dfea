# SPDX-License-Identifier: Apache-2.0
"""Who sits is told from who stands by the evidence of the channel."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import torch
from lit_bodies import echoing

from rfgs_core.bodies import posture
from rfgs_core.bodies.body_prior import Bodies
from rfgs_core.bodies.localise import pair_maps
from rfgs_core.bodies.pair_sample import NOISE_SHARES, PairSample, pair_samples
from rfgs_core.bodies.posture import tell_postures
from rfgs_core.measure.observations import Observations
from rfgs_core.propagation import Links, Subcarriers, scatter
from rfgs_core.settings import TrainConfig

ROOM_M = np.array([[0.0, 0.0, 0.0], [4.0, 3.5, 2.5]])
AXIS = np.array([[2.2, 1.6]])
UPRIGHT = Bodies.standing(AXIS)


@pytest.fixture
def fewer_entries(monkeypatch: pytest.MonkeyPatch) -> None:
    """A sixth of the entries and fewer Gaussians tell postures in these small rooms too."""
    monkeypatch.setattr(posture, "ENTRIES", posture.ENTRIES // 6)
    monkeypatch.setattr(posture, "GAUSSIANS", 500)


@pytest.fixture
def sample() -> PairSample:
    rng = np.random.default_rng(0)
    freq_hz = 5.8e9 + np.array([0.0, 3e6, 40e6])
    ends = rng.uniform(0, 1, (4, 3)), rng.uniform(3, 4, (4, 3))
    change = rng.standard_normal(12) + 1j * rng.standard_normal(12)
    return PairSample(*ends, freq_hz, change.astype(np.complex64))


@pytest.fixture
def cloud() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(1)
    normals = rng.standard_normal((30, 3))
    return rng.uniform(1, 2, (30, 3)), normals / np.linalg.norm(normals, axis=1, keepdims=True)


def responses(sample: PairSample, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """The plain propagation model's answer to each Gaussian alone, entries by Gaussians."""
    means, turned = torch.from_numpy(points), torch.from_numpy(normals)
    quats = torch.tensor([[1.0, 0.0, 0.0, 0.0]], dtype=torch.float64)
    links = Links(torch.from_numpy(sample.tx_xyz), torch.from_numpy(sample.rx_xyz))
    columns = []
    for row in range(len(points)):
        each = [
            scatter(
                *(means[[row]], quats, torch.full((1, 3), 1e-9, dtype=torch.float64)),
                *(torch.ones(1, 1, dtype=torch.complex128), links, Subcarriers(float(f), 1.0, 1)),
                normals=turned[[row]],
                sharpness=6.0,
                backend="torch",
            )
            for f in sample.freq_hz
        ]
        columns.append(torch.cat(each, dim=1).reshape(-1).numpy())
    return np.array(columns).T


def test_evidence_is_the_likeliest_normal_density(sample: PairSample, cloud) -> None:
    """log CN(y; 0, s (A Aᴴ / level + n I)) + N log π, by brute force over s and n."""
    a = responses(sample, *cloud)
    covariance = a @ a.conj().T
    covariance /= np.trace(covariance).real / len(covariance)
    y = sample.change.astype(np.complex128)
    found = []
    for share in NOISE_SHARES:
        c = covariance + share * np.eye(len(y))
        _, log_det = np.linalg.slogdet(c)
        power = (y.conj() @ np.linalg.solve(c, y)).real
        scales = np.geomspace(0.1, 10, 4001) * power / len(y)
        found.append((-len(y) * np.log(scales) - log_det - power / scales).max())
    assert sample.log_likelihood(*cloud) == pytest.approx(max(found), abs=1e-3)


def test_evidence_does_not_know_units(sample: PairSample, cloud) -> None:
    """Ten times the channel has 10^(−2N) of the density, whatever is tried."""
    louder = replace(sample, change=10 * sample.change)
    fall = sample.log_likelihood(*cloud) - louder.log_likelihood(*cloud)
    assert fall == pytest.approx(2 * 12 * np.log(10), rel=1e-4)


def test_only_what_is_visible_is_sampled(make_observations: Callable[..., Observations]) -> None:
    links, subcarriers = np.ones((4, 64), bool), np.ones(32, bool)
    links[:, 5], subcarriers[7] = False, False
    seen = make_observations(links=links, subcarriers=subcarriers)
    rng = np.random.default_rng(0)
    delta = rng.standard_normal(seen.delta.shape) + 1j
    delta = np.where(seen.links[..., None] & seen.subcarriers, delta, np.nan)
    seen = replace(seen, delta=delta.astype(np.complex64))
    samples = pair_samples(seen, 64, 0)
    assert len(samples) == len(seen.pairs[1])
    for entry in samples:
        assert np.isfinite(entry.change).all()
        assert np.mean(np.abs(entry.change) ** 2) == pytest.approx(1.0, rel=1e-4)
        assert seen.freq_hz[7] not in entry.freq_hz
        assert not (entry.rx_xyz == seen.layout.rx_xyz[5]).all(axis=1).any()


def test_pairs_that_hear_nothing_keep_their_place_and_say_nothing(
    make_observations: Callable[..., Observations], cloud, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of few pairs several rounds are averaged, pair by pair; few Gaussians tell that as well."""
    monkeypatch.setattr(posture, "GAUSSIANS", 40)
    monkeypatch.setattr(posture, "MOST_ENTRIES", 64)
    empty = make_observations(own_device_links="only")
    seen = echoing(empty, Bodies(AXIS, np.array([0.0])), seed=3)
    pair, names = seen.pairs
    tx, rx = np.nonzero(pair == 1)
    delta = seen.delta.copy()
    # All links of one pair, and all but one of another: a round may miss that one.
    delta[pair == 0] = 0.0
    delta[tx[1:], rx[1:]] = 0.0
    quiet = seen.with_delta(delta)
    samples = pair_samples(quiet, 64, 0)
    assert len(samples) == len(names) == 4
    assert samples[0].log_likelihood(*cloud) == 0.0 != samples[2].log_likelihood(*cloud)
    told = tell_postures(quiet, pair_maps(quiet), UPRIGHT, TrainConfig(), 0)
    assert told.knees_rad.shape == (1,)


@pytest.mark.usefixtures("fewer_entries")
@pytest.mark.parametrize("knees", [np.nan, 1.5 * np.pi])
def test_posture_is_told(make_observations: Callable[..., Observations], knees: float) -> None:
    seen = echoing(make_observations(), Bodies(AXIS, np.array([knees])), seed=3)
    told = tell_postures(seen, pair_maps(seen), UPRIGHT, TrainConfig(), 0)
    np.testing.assert_array_equal(told.axes_xy, AXIS)
    np.testing.assert_array_equal(told.sits, [np.isfinite(knees)])
    if told.sits[0]:
        apart = (told.knees_rad[0] - knees + np.pi) % (2 * np.pi) - np.pi
        assert abs(apart) <= np.pi / 8 + 1e-9


@pytest.mark.usefixtures("fewer_entries")
@pytest.mark.parametrize("shifts_m", [(), posture.SHIFTS_M])
def test_an_error_of_the_place_is_not_taken_for_legs(
    make_observations: Callable[..., Observations],
    monkeypatch: pytest.MonkeyPatch,
    shifts_m: tuple[float, ...],
) -> None:
    """Without shifts this body sits."""
    monkeypatch.setattr(posture, "SHIFTS_M", shifts_m)
    empty = make_observations(freq_min_hz=5.4e9, freq_max_hz=6.4e9)
    seen = echoing(empty, Bodies.standing(AXIS), seed=9)
    off = Bodies.standing(AXIS + np.array([0.3, 0.0]))
    told = tell_postures(seen, pair_maps(seen), off, TrainConfig(), 0)
    assert told.sits.any() == (not shifts_m)


@pytest.mark.parametrize("change", ["no phases", "asked to stand"])
def test_everybody_stands_where_nothing_is_told(
    make_observations: Callable[..., Observations], change: str
) -> None:
    seen = echoing(make_observations(), Bodies(AXIS, np.array([0.0])), seed=3)
    maps, config = pair_maps(seen), TrainConfig()
    if change == "no phases":
        seen = replace(seen, kind="power")
    else:
        config = TrainConfig(posture="standing")
    assert not tell_postures(seen, maps, UPRIGHT, config, 0).sits.any()
