# SPDX-License-Identifier: Apache-2.0
"""Encoders learn to predict what is hidden, and would be caught if they collapsed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from rfgs_core.encode import spread as spread_module
from rfgs_core.encode.learned import LearnedEncoder
from rfgs_core.encode.spread import FeatureSpread
from rfgs_core.errors import RfgsError
from rfgs_core.fit.losses import SamplePoints, feature_loss, paper_loss
from rfgs_core.fit.self_supervised import Example, SelfSupervised, correlation, train_encoder
from rfgs_core.measure.observations import Observations
from rfgs_core.radio import Radio
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.seeds import sub_seed

SCATTERERS_M = np.array([[1.3, 2.1, 1.2], [2.4, 1.3, 0.8], [1.5, 2.3, 0.5]])


def with_scatterers(
    empty: Observations, frame: int, places: np.ndarray = SCATTERERS_M
) -> Observations:
    """Scatterers that wander from frame to frame."""
    wavelength_m = SPEED_OF_LIGHT / empty.freq_hz
    delta = np.zeros(empty.delta.shape, complex)
    for place in np.atleast_2d(places) + 0.2 * frame:
        out = np.linalg.norm(empty.layout.tx_xyz - place, axis=1)[:, None, None]
        back = np.linalg.norm(empty.layout.rx_xyz - place, axis=1)[:, None]
        delta += np.exp(-2j * np.pi * (out + back) / wavelength_m) / (out * back)
    return empty.with_delta(np.where(empty.links[..., None], delta, 0))


@pytest.fixture
def frames(make_observations) -> list[Observations]:
    """Two frames of a radio without packets."""
    empty = make_observations(num_subcarriers=16, rx_rows=2)
    return [with_scatterers(empty, frame) for frame in range(2)]


@pytest.fixture
def trained(frames) -> SelfSupervised:
    return train_encoder(frames, "csi", 30, 0)


def weights(result: SelfSupervised) -> list[torch.Tensor]:
    return list(result.encoder.model.state_dict().values())


def test_features_part_and_still_predict_what_is_hidden(trained, frames) -> None:
    """On the frame that was not trained on: weights part the features at no cost in error."""
    assert trained.unseen
    assert trained.trained_db < -5.0
    assert trained.trained_db < trained.untrained_db + 0.3
    first = LearnedEncoder.untrained("csi", frames[0], sub_seed(0, "weights"))
    points = np.random.default_rng(0).uniform([0.5, 0.5, 0.3], [3.5, 3.0, 2.0], (400, 3))
    before, after = (encoder(frames[1], points) for encoder in (first, trained.encoder))
    assert correlation(torch.from_numpy(after)) < 0.9 * correlation(torch.from_numpy(before))
    assert not trained.spread.collapsed


def test_training_repeats_itself(frames) -> None:
    again, twin, other = (train_encoder(frames[:1], "csi", 2, seed) for seed in (0, 0, 1))
    assert not again.unseen
    assert all(torch.equal(a, b) for a, b in zip(weights(again), weights(twin), strict=True))
    assert not all(torch.equal(a, b) for a, b in zip(weights(again), weights(other), strict=True))


def test_masks_hide_runs_and_nothing_else(frames) -> None:
    example = Example.of(frames[0], 0)
    full, seen, points = example.draw(np.random.default_rng(0))
    assert points.shape == (256, 3)
    hidden = full.visible & ~seen.visible
    assert (seen.csi[hidden] == 0).all()
    assert torch.equal(seen.csi[~hidden], full.csi[~hidden])
    for pair in hidden:
        subcarriers = pair.all(dim=1).all(dim=0)
        antennas = pair.all(dim=2).all(dim=0)
        assert subcarriers.sum() == 2
        assert antennas.sum() == 2
        for run in (subcarriers, antennas):
            assert run.nonzero().diff(dim=0).abs().max() == 1
        assert torch.equal(pair, (subcarriers | antennas[:, None]).expand_as(pair))


@pytest.fixture
def chirps(make_observations) -> list[Observations]:
    """Scatterers that pass a radar, each at a speed of its own."""
    radar = Radio("radar", 60e9, 61e9, 24, 4, 1, 1, 4, (0.0, 0.05, 0.0), own_device_links="only")
    empty = make_observations(radar)
    result = []
    for frame in range(2):
        packets = np.zeros((16, *empty.delta.shape), np.complex64)
        for place, bins in zip(SCATTERERS_M, (3.0, -5.0, 0.0), strict=True):
            turn = np.exp(2j * np.pi * bins / 16 * np.arange(16))[:, None, None, None]
            packets += turn * with_scatterers(empty, frame, place).delta
        seen = empty.with_delta(packets[0])
        result.append(replace(seen, packets=packets, packet_interval_s=0.25e-3))
    return result


def test_features_of_a_doppler_encoder_part(chirps) -> None:
    """As `test_features_part_and_still_predict_what_is_hidden`, of chirps."""
    result = train_encoder(chirps, "doppler", 20, 0)
    assert result.unseen and not result.spread.collapsed
    assert result.trained_db < result.untrained_db + 0.3
    first = LearnedEncoder.untrained("doppler", chirps[0], sub_seed(0, "weights"))
    points = np.random.default_rng(0).uniform([0.5, 0.5, 0.3], [3.5, 3.0, 2.0], (400, 3))
    before, after = (encoder(chirps[1], points) for encoder in (first, result.encoder))
    assert correlation(torch.from_numpy(after)) < 0.9 * correlation(torch.from_numpy(before))
    twins = [weights(train_encoder(chirps[:1], "doppler", 1, 0)) for _ in range(2)]
    assert all(torch.equal(a, b) for a, b in zip(*twins, strict=True))


def test_what_is_hidden_is_hidden_in_every_packet(chirps) -> None:
    full, seen, _ = Example.of(chirps[0], 0).draw(np.random.default_rng(0))
    assert full.packets is not None and seen.packets is not None
    hidden = (full.visible & ~seen.visible)[:, None].expand_as(full.packets)
    assert (seen.packets[hidden] == 0).all() and (full.packets[hidden] != 0).any()
    assert torch.equal(seen.packets[~hidden], full.packets[~hidden])


def test_a_collapsed_encoder_is_refused(frames, monkeypatch) -> None:
    monkeypatch.setattr(spread_module, "LEAST_RANK", 33.0)
    with pytest.raises(RfgsError, match=r"the features collapsed .* train on more frames"):
        train_encoder(frames, "csi", 1, 0)


def test_frames_without_change_are_refused(make_observations) -> None:
    with pytest.raises(RfgsError, match="nothing moves in these frames"):
        train_encoder([make_observations(num_subcarriers=16, rx_rows=2)], "csi", 1, 0)


def test_eq_6_lets_no_gradient_into_the_encoder(make_gaussians) -> None:
    features = torch.rand(20, 32, requires_grad=True)
    gaussians = make_gaussians(5)
    gaussians.features.requires_grad_(True)
    gaussians.means.requires_grad_(True)
    points = SamplePoints(gaussians.means.detach().repeat(4, 1), features)
    paper_loss(gaussians, points).backward()
    assert features.grad is None
    assert gaussians.features.grad is not None
    feature_loss(gaussians, points, torch.zeros(20, dtype=torch.int64)).backward()
    assert features.grad is None


def test_without_the_stop_both_sides_collapse_and_that_is_seen(make_gaussians) -> None:
    """Eq. 6 with a gradient into φ, and as it is here."""
    gaussians = make_gaussians(1)
    nearest = torch.zeros(40, dtype=torch.int64)
    for stopped in (False, True):
        features = torch.rand(40, 32, generator=torch.Generator().manual_seed(0))
        features.requires_grad_(True)
        learned = torch.zeros(1, 32, requires_grad=True)
        for _ in range(400):
            moved = replace(gaussians, features=learned)
            points = SamplePoints(torch.zeros(40, 3), features)
            loss = torch.sum((learned - features) ** 2)
            # A class of torch's would load its compiler for two lines.
            (feature_loss(moved, points, nearest) if stopped else loss).backward()
            for leaf in (features, learned):
                if leaf.grad is not None:
                    leaf.data.sub_(0.01 * leaf.grad)
                    leaf.grad = None
        spread = FeatureSpread.of(features.detach().numpy())
        assert spread.collapsed != stopped
        assert torch.allclose(learned, features.mean(dim=0), atol=1e-3)


def test_an_encoder_whose_weights_went_silent_has_collapsed(frames) -> None:
    points = np.random.default_rng(0).uniform([0.5, 0.5, 0.3], [3.5, 3.0, 2.0], (60, 3))
    encoder = LearnedEncoder.untrained("csi", frames[0], 0)
    assert FeatureSpread.of(encoder(frames[0], points)).deviation > 0.1
    with torch.no_grad():
        encoder.model.network.layers[-1].bias.sub_(40.0)
    assert FeatureSpread.of(encoder(frames[0], points)).collapsed


def test_correlation_is_that_of_numpy() -> None:
    values = np.random.default_rng(0).random((50, 32)) @ np.random.default_rng(1).random((32, 32))
    matrix = np.corrcoef(values, rowvar=False)
    expected = (matrix**2).sum() - 32
    got = float(correlation(torch.from_numpy(values)))
    assert got == pytest.approx(expected / (32 * 31), rel=1e-6)


def test_a_network_that_cannot_read_the_radio_is_told_before_the_frames_are_read(frames) -> None:
    """Nothing moves in these frames, which is found only by looking at their points."""
    still = [frame.with_delta(np.zeros_like(frame.delta)) for frame in frames]
    with pytest.raises(RfgsError, match="the doppler network expects"):
        train_encoder(still, "doppler", 1, 0)
