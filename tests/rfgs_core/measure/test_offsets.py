# SPDX-License-Identifier: Apache-2.0
"""Device offsets from cross spectra: exact without noise, at the Cramér–Rao bound with it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rfgs_core.errors import RfgsError
from rfgs_core.fit.calibrate import Calibration
from rfgs_core.measure.direct_path import direct_channel
from rfgs_core.measure.observations import Observations
from rfgs_core.measure.offsets import CrossSpectra, Offsets, estimate_offsets
from rfgs_core.radio import preset
from rfgs_core.radio.impairments import Draw
from rfgs_core.radio.impairments.apply import oscillator_turn

PHASE_RAD = np.array([0.0, 2.5, -1.2, 0.7])
DELAY_S = np.array([0.0, 4e-9, -7e-9, 1.5e-9])
KNOWN = Offsets(PHASE_RAD, DELAY_S)


def turned(observations: Observations, offsets: Offsets = KNOWN) -> np.ndarray:
    """The direct channel as devices with offsets make it."""
    turn = offsets.turn(observations.layout, observations.freq_hz)
    return direct_channel(observations) * turn


def test_the_turn_is_that_of_the_factory(make_observations) -> None:
    """Twin: what impaired channels are made with."""
    radio = preset("wifi")
    observations = make_observations(radio=radio)
    elements = observations.layout
    draw = Draw(
        time_s=np.zeros(1),
        cfo_hz=np.zeros(4),
        sfo_ppm=np.zeros(4),
        sto_s=DELAY_S[None],
        phase_noise_rad=PHASE_RAD[None],
        rx_order=np.arange(len(elements.rx_xyz))[None],
        packet_received=np.ones((1, 4, 4), bool),
        timestamp_s=np.zeros((1, 4)),
    )
    expected = oscillator_turn(draw, radio, elements, slice(0, 1))[0]
    np.testing.assert_allclose(KNOWN.turn(elements, radio.freq_hz), expected, atol=1e-9)
    own = elements.tx_device[:, None] == elements.rx_device
    np.testing.assert_allclose(KNOWN.turn(elements, radio.freq_hz)[own], 1)


def test_offsets_are_found_exactly_without_noise(make_observations) -> None:
    subcarriers = np.ones(32, bool)
    subcarriers[4:8] = False
    observations = make_observations(subcarriers=subcarriers)
    spectra = CrossSpectra.of(observations, turned(observations), direct_channel(observations))
    found = estimate_offsets(spectra)
    np.testing.assert_allclose(np.rad2deg(found.phase_rad - PHASE_RAD), 0, atol=0.01)
    np.testing.assert_allclose(found.delay_s, DELAY_S, atol=1e-13)
    assert found.phase_rad[0] == found.delay_s[0] == 0


def test_each_kind_alone(make_observations) -> None:
    observations = make_observations()
    model = direct_channel(observations)
    phases = Offsets(PHASE_RAD, np.zeros(4))
    spectra = CrossSpectra.of(observations, turned(observations, phases), model)
    found = estimate_offsets(spectra, timing=False)
    np.testing.assert_allclose(found.phase_rad, PHASE_RAD, atol=2e-4)
    assert not found.delay_s.any()
    spectra = CrossSpectra.of(observations, turned(observations), model)
    found = estimate_offsets(spectra, phase=False)
    np.testing.assert_allclose(found.delay_s, DELAY_S, atol=1e-13)
    assert not found.phase_rad.any()


def test_errors_under_noise_meet_the_cramer_rao_bound(make_observations) -> None:
    """N devices, all ordered pairs alike with E = links · subcarriers · SNR each.

    The information on φ_a − φ_b from both directions is w = 4E, and a complete graph of N gives
    φ_d − φ_0 the variance 2/(N w); for delays E is weighted by (2π(f − f_c))².
    """
    observations = make_observations()
    model = direct_channel(observations)
    model = model / np.abs(model)
    turn = KNOWN.turn(observations.layout, observations.freq_hz)
    noise, rng = 4.0, np.random.default_rng(0)
    errors = []
    for _ in range(60):
        added = rng.standard_normal((*model.shape, 2)) @ [1, 1j] * np.sqrt(noise / 2)
        found = estimate_offsets(CrossSpectra.of(observations, model * turn + added, model))
        wrapped = np.angle(np.exp(1j * (found.phase_rad - PHASE_RAD)))
        errors.append([wrapped[1:], (found.delay_s - DELAY_S)[1:]])
    rms = np.sqrt(np.mean(np.square(errors), axis=(0, 2)))
    baseband = 2 * np.pi * (observations.freq_hz - observations.centre_hz)
    per_pair = 16 / noise * np.array([32, np.sum(baseband**2)])
    bound = np.sqrt(2 / (4 * 4 * per_pair))
    assert np.rad2deg(bound[0]) < 2 and bound[1] < 150e-12
    assert (rms > 0.8 * bound).all() and (rms < 1.2 * bound).all()


def test_a_pair_without_a_straight_way_does_not_mislead(make_observations) -> None:
    """One pair whose only path is a late reflection, both ways."""
    observations = make_observations()
    late = np.exp(-2j * np.pi * (observations.freq_hz - observations.centre_hz) * 27e-9)
    a, b = observations.layout.tx_device[:, None], observations.layout.rx_device
    blocked = ((a == 0) & (b == 3)) | ((a == 3) & (b == 0))
    measured = turned(observations) * np.where(blocked[..., None], late, 1)
    spectra = CrossSpectra.of(observations, measured, direct_channel(observations))
    found = estimate_offsets(spectra)
    np.testing.assert_allclose(found.delay_s, DELAY_S, atol=30e-12)


def test_models_count_by_what_all_their_pairs_leave_unexplained(make_observations) -> None:
    """Two models that contradict each other by a small phase meet at the mean of weight ρ/(1 − ρ²).

    A pair that follows its model exactly has no more weight than the others of that model.
    """
    observations = make_observations()
    layout, model = observations.layout, direct_channel(observations)
    model = model / np.abs(model)
    between = layout.tx_device[:, None] != layout.rx_device
    exact = (layout.tx_device[:, None] + layout.rx_device == 3)[..., None]
    apart = np.deg2rad(3.0) * np.array([0.0, 1.0, -1.0, 0.5])
    coherences, spectra = (0.9, 0.6), []
    for ahead, coherence in zip((0 * apart, apart), coherences, strict=True):
        turn = Offsets(PHASE_RAD + ahead, np.zeros(4)).turn(layout, observations.freq_hz)
        # Signs that alternate from subcarrier to subcarrier are orthogonal to the model.
        other = np.sqrt(1 - coherence**2) * (-1.0) ** np.arange(turn.shape[2])
        share = np.where(exact, 1.0, coherence + other) * between[..., None]
        spectra.append(CrossSpectra.of(observations, model * turn * share, model))
    found = estimate_offsets(*spectra, timing=False, pooled=True)
    # Of the twelve pairs of four devices, (0, 3), (1, 2) and their reverses are exact.
    noise = [(1 - value**2) * 8 / 12 for value in coherences]
    pairs = {True: [1 / n for n in noise]}
    pairs[False] = [value / n for value, n in zip(coherences, noise, strict=True)]
    laplacian, wanted = np.zeros((4, 4)), np.zeros(4)
    for a in range(4):
        for b in set(range(4)) - {a}:
            first, second = pairs[a + b == 3]
            laplacian[a, a] += first + second
            laplacian[a, b] -= first + second
            wanted[a] += second * (apart[a] - apart[b])
    expected = np.linalg.lstsq(laplacian[1:, 1:], wanted[1:], rcond=None)[0]
    got = np.angle(np.exp(1j * (found.phase_rad - PHASE_RAD)))[1:]
    np.testing.assert_allclose(got, expected, atol=np.deg2rad(0.01))
    assert np.abs(expected).max() > np.deg2rad(0.3)


def test_undoing_gives_the_clean_observations_back(make_observations) -> None:
    clean = make_observations()
    rng = np.random.default_rng(1)
    delta = 1e-4 * (rng.standard_normal((*clean.static.shape, 2)) @ [1, 1j])
    clean = clean.with_delta(delta)
    drift = Offsets(-0.5 * PHASE_RAD, 0.3 * DELAY_S)
    turn = KNOWN.turn(clean.layout, clean.freq_hz)
    static = clean.static * turn
    frame = (clean.static + clean.delta) * turn * drift.turn(clean.layout, clean.freq_hz)
    observed = replace(
        clean, static=static.astype(np.complex64), delta=(frame - static).astype(np.complex64)
    )
    back = Calibration(KNOWN, drift).undone(observed)
    np.testing.assert_allclose(back.static, clean.static, atol=1e-8)
    np.testing.assert_allclose(back.delta, clean.delta, atol=1e-8)


def test_devices_that_hear_only_themselves_are_refused(make_observations) -> None:
    radar = make_observations(radio=preset("mmwave"))
    with pytest.raises(RfgsError, match="--calibrate: no visible link connects device 1, 2, 3"):
        CrossSpectra.of(radar, radar.static, radar.static)
