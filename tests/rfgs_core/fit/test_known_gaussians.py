# SPDX-License-Identifier: Apache-2.0
"""Gaussians that made a channel are found again from it."""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np
import pytest
import torch

from rfgs_core.bodies.tracks import Tracks
from rfgs_core.fit import refine as refine_module
from rfgs_core.fit.frame import FrameState, solve_reflectivity
from rfgs_core.fit.parameters import LearningRates
from rfgs_core.fit.refine import refine
from rfgs_core.gaussians import Gaussians
from rfgs_core.model.channel import Channel
from rfgs_core.model.head import RadioHead
from rfgs_core.radio import preset
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.settings import TrainConfig

COUNT = 50


def scatterers(head: RadioHead, rng: np.random.Generator) -> Gaussians:
    """Gaussians of 2 cm in the middle of the room, at least 10 cm apart, seen from all sides."""
    places = [rng.uniform([1.2, 1.0, 0.5], [2.8, 2.4, 1.9])]
    while len(places) < COUNT:
        place = rng.uniform([1.2, 1.0, 0.5], [2.8, 2.4, 1.9])
        if min(np.linalg.norm(place - other) for other in places) > 0.1:
            places.append(place)
    # Upwards: every antenna is at a level where its cosine with the normal is small.
    quats = np.tile([1.0, 0.0, 0.0, 0.0], (COUNT, 1))
    gamma = 0.05 * np.exp(2j * np.pi * rng.uniform(size=COUNT)) * rng.uniform(0.7, 1.3, COUNT)
    features = head.with_gamma(torch.zeros(COUNT, 32), torch.from_numpy(gamma).to(torch.complex64))
    return Gaussians(
        means=torch.tensor(np.array(places), dtype=torch.float32),
        quats=torch.tensor(quats, dtype=torch.float32),
        log_scales=torch.full((COUNT, 3), float(np.log(0.02))),
        # Transparent: shadows play no part here.
        logit_opacities=torch.full((COUNT,), -12.0),
        features=features,
    )


@pytest.mark.slow
def test_fifty_known_gaussians_are_recovered(
    make_observations, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Started within a quarter wavelength, with wrong amplitudes and phases, of known shapes.

    Shapes stay fixed, as how much a wide Gaussian reflects and how wide it is go together.
    """
    known = replace(refine_module.CHANNEL_RATES, log_scales=0.0, quats=0.0, logit_opacities=0.0)
    radio = replace(preset("uwb"), num_subcarriers=304)
    wavelength_m = SPEED_OF_LIGHT / radio.centre_hz
    rng = np.random.default_rng(0)
    head = RadioHead.create(0, wavelength_m, 0.02, 0.05)
    truth = scatterers(head, rng)
    empty = make_observations(radio=radio)
    channel = Channel.of(empty, empty.links, empty.subcarriers)
    delta = np.zeros_like(empty.delta)
    delta[channel.tx, channel.rx] = channel.change(head, truth).numpy()
    observations = empty.with_delta(delta)

    away = rng.normal(size=(COUNT, 3))
    away *= (
        0.25
        * wavelength_m
        * rng.uniform(0.3, 1.0, (COUNT, 1))
        / np.linalg.norm(away, axis=1, keepdims=True)
    )
    start = replace(
        truth,
        means=truth.means + torch.from_numpy(away).float(),
        features=torch.zeros_like(truth.features),
    )
    tracks = Tracks.begun(np.array([[2.0, 1.7]]), time_s=0.0)
    state = FrameState(start, torch.full((COUNT,), 2.5e-3), head, tracks, np.arange(COUNT))
    # As a frame is fitted, but more than once: amplitudes, then everything. Adam's steps do not
    # shrink by themselves, so that the last turns have lower rates.
    config = TrainConfig(iterations=60, batch_entries=10**9, unexplained=0.05)
    for slower in (1, 1, 1, 1, 3, 10):
        rates = {name: rate / slower for name, rate in asdict(known).items()}
        monkeypatch.setattr(refine_module, "CHANNEL_RATES", LearningRates(**rates))
        if slower == 1:
            state = solve_reflectivity(observations, state, config)
        state = refine(observations, state, config, seed=0)
    found = state.gaussians

    off_m = torch.linalg.norm(found.means - truth.means, dim=1)
    assert float(off_m.max()) < 0.1 * wavelength_m
    wanted = head.gamma(truth.features).abs()
    error = (head.gamma(found.features).abs() - wanted).abs() / wanted
    assert float(error.max()) < 0.01
