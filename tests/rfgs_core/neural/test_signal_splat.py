# SPDX-License-Identifier: Apache-2.0
"""Splatted signals: spectra of an empty room in closed form, and what the formula says."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from skimage.metrics import structural_similarity

from rfgs_core.neural.signal_fit import fit_channel, fit_spectra
from rfgs_core.neural.signal_splat import SignalSplat, SplatSettings, directions
from rfgs_core.real.bedroom import WALLS, snr_db

BOUNDS_M = np.array([[-2.28, -2.28, 0.0], [2.28, 2.28, 3.0]])
ARRAY_M = np.array([-2.0, -2.0, 1.5])
PIXEL_DEG = 12.0


def room_spectra(tx: np.ndarray) -> np.ndarray:
    """Line of sight and six images as round beams, the highest one."""
    pixels = directions(PIXEL_DEG).numpy().astype(float)
    total = np.zeros((len(tx), len(pixels)))
    for wall in (None, *WALLS):
        image = tx.copy()
        if wall is not None:
            image[:, wall[0]] = 2 * wall[1] - image[:, wall[0]]
        distance = np.linalg.norm(image - ARRAY_M, axis=1)[:, None]
        cosine = (image - ARRAY_M) / distance @ pixels.T
        gain = 1.0 if wall is None else 0.5
        total += (gain / distance) ** 2 * np.exp(-(1 - cosine) / np.radians(15.0) ** 2)
    return total / total.max(axis=1, keepdims=True)


@pytest.mark.slow
def test_spectra_of_an_empty_room_at_transmitters_that_were_never_seen() -> None:
    rng = np.random.default_rng(0)
    tx = rng.uniform(BOUNDS_M[0] + [1.2, 1.2, 0.2], BOUNDS_M[1] - [0.2, 0.2, 0.4], (90, 3))
    true, seen = room_spectra(tx), np.arange(90) < 60
    settings = SplatSettings(
        gaussians=200, pixel_deg=PIXEL_DEG, reach_deg=180.0, scale_m=0.4, steps=300,
        transmitters=16, rate=5e-3, place_rate_m=5e-3,
    )  # fmt: skip
    means = rng.uniform(*BOUNDS_M, (settings.gaussians, 3))
    splat = SignalSplat(means, ARRAY_M, BOUNDS_M, settings, 0)
    known = torch.from_numpy(true[seen]).float()
    fit_spectra(splat, torch.from_numpy(tx[seen]), known, rng)
    with torch.no_grad():
        found = splat.spectra(torch.from_numpy(tx[~seen])).numpy()
    nearest = np.linalg.norm(tx[~seen][:, None] - tx[seen], axis=2).argmin(axis=1)
    mean = np.broadcast_to(true[seen].mean(axis=0), found.shape)
    similar, error = similarity(true[~seen], found), relative(true[~seen], found)

    # Measured: 0.86 beside 0.66 of the mean picture and 0.96 of the nearest transmitter's; errors
    # of 0.25, 0.65 and 0.30.
    assert similar > 0.82
    assert similarity(true[~seen], mean) < 0.75
    assert error < relative(true[~seen], true[seen][nearest])


def test_an_array_and_a_band_tell_of_one_scatterer() -> None:
    rng = np.random.default_rng(2)
    array = ARRAY_M + 0.08 * (
        np.indices((4, 4)).reshape(2, -1).T @ np.array([[1, -1, 0], [0, 0, 1]])
    )
    tx, wavenumber = np.array([[2.0, -2.0, 1.0], [2.0, 2.0, 2.0]]), np.linspace(40.0, 42.0, 16)
    place, gain = np.array([0.3, 0.4, 1.2]), np.array([0.8 - 0.3j, 0.2 + 0.5j])
    sent = np.linalg.norm(tx - place, axis=1)[:, None, None]
    heard = np.linalg.norm(array - place, axis=1)[:, None]
    csi = gain[:, None, None] * np.exp(-1j * wavenumber * (sent + heard)) / (sent * heard)
    settings = SplatSettings(gaussians=12, pixel_deg=3.0, steps=150, rate=1e-2)
    splat = SignalSplat(
        place + 0.05 * rng.normal(size=(12, 3)), array.mean(axis=0), BOUNDS_M, settings, 0
    )
    places = [torch.from_numpy(part) for part in (tx, array, wavenumber)]
    # A column of the array and a quarter of the band are hidden.
    seen = np.array(csi, dtype=np.complex64)
    seen[:, 12:], seen[:, :, 6:10] = np.nan, np.nan
    fit_channel(splat, *places, torch.from_numpy(seen), rng)
    with torch.no_grad():
        found = splat.channel(*places, float(wavenumber.mean())).numpy()
    # Measured: 17 and 21 dB.
    for hidden in (np.s_[:, 12:], np.s_[:, :12, 6:10]):
        assert snr_db(csi[hidden], found[hidden]) > 15


def test_the_near_hide_the_far_and_nothing_is_heard_twice() -> None:
    settings = SplatSettings(pixel_deg=12.0, reach_deg=180.0, scale_m=2.0)
    toward = np.array([1.0, 0.0, 0.0])
    means = ARRAY_M + toward * np.array([[3.0], [1.0], [2.0]])
    splat = SignalSplat(means, ARRAY_M, BOUNDS_M, settings, 0)
    with torch.no_grad():
        splat.matter[-1].bias[0] = 20.0
        share = splat.weights()[0].numpy()
    ahead = int((splat.pixels.numpy() @ toward).argmax())
    # Opacities of all but one: what is second hears a hundredth through the first, and so on.
    assert share[ahead, 1] > 0.9 and share[ahead, 2] < 0.1 * share[ahead, 1]
    assert share[ahead, 0] < share[ahead, 2]
    assert (share >= 0).all() and share.sum(axis=1).max() <= 1 + 1e-6


def test_signals_turn_with_the_way_over_the_gaussian() -> None:
    place, tx, wavenumber = np.array([1.0, 0.5, 1.0]), np.array([[0.0, 2.0, 1.5]]), 1300.0
    splat = SignalSplat(place[None], ARRAY_M, BOUNDS_M, SplatSettings(), 0)
    with torch.no_grad():
        found = splat.ways(torch.from_numpy(tx), torch.tensor([wavenumber]).double()).item()
    sent, heard = np.linalg.norm(tx[0] - place), np.linalg.norm(ARRAY_M - place)
    expected = np.exp(-1j * wavenumber * (sent + heard)) / (sent * heard)
    assert abs(found - expected) < 1e-6


def similarity(true: np.ndarray, found: np.ndarray) -> float:
    """Median structural similarity of pictures."""
    rows = [part.reshape(len(part), -1, round(360 / PIXEL_DEG)) for part in (true, found)]
    each = [structural_similarity(a, b, data_range=1.0) for a, b in zip(*rows, strict=True)]
    return float(np.median(each))


def relative(true: np.ndarray, found: np.ndarray) -> float:
    """RMS error over RMS."""
    return float(np.linalg.norm(found - true) / np.linalg.norm(true))
