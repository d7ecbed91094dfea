# SPDX-License-Identifier: Apache-2.0
"""The direct sum on channels in closed form: sources are recovered, and hidden places predicted."""

from __future__ import annotations

import numpy as np
import torch

from rfgs_core.neural.direct_sum import DirectSum, Links, SumSettings, fit_direct_sum
from rfgs_core.real.bedroom import WALLS, snr_db

#: A place of the transmitter in an empty room of 4.56 × 4.56 × 3 m [m].
TX_M = np.array([-1.5, 0.2, 2.6])
#: At 0.8 GHz, so that few receivers and places are enough [rad/m].
WAVENUMBER = 2 * np.pi * 0.8e9 / 299_792_458.0


def links_at(rx: np.ndarray) -> Links:
    """Links of one group at one frequency."""
    group = torch.zeros(len(rx), dtype=torch.int64)
    return Links(torch.from_numpy(rx), None, group, torch.tensor([WAVENUMBER]).double())


def images() -> np.ndarray:
    """The transmitter and its images in six walls."""
    places = [TX_M]
    for axis, offset in WALLS:
        image = TX_M.copy()
        image[axis] = 2 * offset - image[axis]
        places.append(image)
    return np.array(places)


def room_channel(rx: np.ndarray) -> np.ndarray:
    """Line of sight and six images whose walls turn the field and keep 0.6 of it."""
    distance = np.linalg.norm(rx[:, None] - images(), axis=2)
    gain = np.array([1.0] + [-0.6] * 6)
    return (gain * np.exp(-1j * WAVENUMBER * distance) / distance).sum(axis=1)


def test_an_empty_room_is_known_where_nobody_listened() -> None:
    rng = np.random.default_rng(0)
    rx = rng.uniform([-2.2, -2.2, 0.1], [2.2, 2.2, 2.9], (220, 3))
    csi, hidden = room_channel(rx), (rx[:, 0] > 0.4) & (rx[:, 0] < 1.3)
    low, high = np.array([-6.8, -6.8, -3.0]), np.array([6.8, 6.8, 6.0])
    settings = SumSettings(per_round=2, places=12_000, steps=100, extent_m=20.0, ridge=1e-3)
    fitted = fit_direct_sum(
        links_at(rx[~hidden]),
        torch.from_numpy(csi[~hidden])[:, None],
        lambda count, draws: draws.uniform(low, high, (count, 3)),
        settings,
        rng,
        TX_M[None],
    )
    predicted = fitted.at(links_at(rx)).numpy()[:, 0]
    sight = np.exp(-1j * WAVENUMBER * np.linalg.norm(rx - TX_M, axis=1))
    sight = sight / np.linalg.norm(rx - TX_M, axis=1)
    # Measured: 39 dB, and sources 0.1 to 1.8 cm from where they are, at a wavelength of 37 cm.
    assert snr_db(csi[hidden], sight[hidden]) < 6
    assert snr_db(csi[hidden], predicted[hidden]) > 35
    assert distances(images(), fitted.means.numpy()).min(axis=1).max() < 0.03


def test_a_scatterer_is_found_by_arrays_of_several_devices() -> None:
    rng = np.random.default_rng(1)
    tx, corners = np.array([[0.0, 0.0, 1.0]]), np.array([[3.0, 0.0, 1.0], [0.0, 3.0, 2.0]])
    place, gain = np.array([1.3, 1.1, 1.4]), np.array([0.5 + 0.2j, -0.1 + 0.7j])
    rx = (corners[:, None] + 0.05 * rng.normal(size=(2, 12, 3))).reshape(-1, 3)
    device, wavenumber = np.repeat([0, 1], 12), np.linspace(100.0, 110.0, 16)
    sent, heard = np.linalg.norm(tx - place, axis=1), np.linalg.norm(rx - place, axis=1)
    turn = np.exp(-1j * wavenumber * (sent + heard)[:, None])
    csi = gain[device][:, None] * turn / (sent * heard)[:, None]
    links = Links(
        torch.from_numpy(rx),
        torch.from_numpy(np.repeat(tx, len(rx), axis=0)),
        torch.from_numpy(device),
        torch.from_numpy(wavenumber),
    )
    settings = SumSettings(rounds=1, per_round=1, places=4000, extent_m=50.0, ridge=1e-6)
    fitted = fit_direct_sum(
        links, torch.from_numpy(csi), lambda n, draws: draws.uniform(0, 3, (n, 3)), settings, rng
    )
    assert distances(fitted.means.numpy(), place[None]).max() < 0.01
    assert np.abs(fitted.contributions.numpy()[:, 0] - gain).max() < 0.1
    assert snr_db(csi, fitted.at(links).numpy()) > 30
    # A device that hears nothing of it any more changes its own contributions alone.
    silent = csi * (device == 0)[:, None]
    again = fitted.solved(links, torch.from_numpy(silent), settings).contributions
    assert torch.allclose(again[0], fitted.contributions[0]) and again[1].abs().max() < 1e-9


def test_one_gaussian_adds_what_the_formula_says() -> None:
    mean, scale, far = np.array([0.2, -0.1, 0.3]), np.array([0.5, 1.0, 2.0]), np.array([1.0, 2, 3])
    alone = DirectSum(
        torch.from_numpy(mean)[None],
        torch.from_numpy(np.log(scale))[None],
        torch.tensor([[2.0 - 1.0j]]).to(torch.complex128),
    )
    way = far - mean
    bell, path = np.exp(-0.5 * np.sum((way / scale) ** 2)), np.linalg.norm(way)
    expected = (2.0 - 1.0j) * bell * np.exp(-1j * WAVENUMBER * path) / path
    assert abs(alone.at(links_at(far[None])).item() - expected) < 1e-6
    power = alone.heard(links_at(far[None])).item()
    assert abs(power - abs((2.0 - 1.0j) * bell) ** 2) < 1e-9


def distances(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Distance of each place of one set to each of the other [m]."""
    return np.linalg.norm(one[:, None] - other, axis=2)
