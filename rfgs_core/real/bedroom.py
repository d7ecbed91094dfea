# SPDX-License-Identifier: Apache-2.0
"""NeWRF's bedroom: channels at receivers that were never seen, from those at others.

What is known is the place of every antenna and the channels of the training receivers: no plan of
the room. A room's surfaces are level or upright and at right angles to the axes, so each is an
offset along an axis; mirrored in it, the transmitter is a virtual source. Offsets are found one
after the other by what they explain. A source's gain is not one number: it follows the angle and
the material at the point of reflection, and ends where the surface does. So it is a Gaussian
process over that point, and the channel, a sum of sources, is one too:

H(r) = Σ_i g_i(b_i(r)) λ/(4π d_i) e^{−jk d_i}, cov(g_i(b), g_i(b')) = s² (½ + ½ e^{−|b−b'|²/2ℓ²}).

ℓ and the noise are those of the largest likelihood of the training channels.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Complex, Complex128, Float, Int64

from rfgs_core.capture import read_capture
from rfgs_core.errors import RfgsFormatError
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.levels import decibels

#: Cells of the floor plan along each side; every fifth, in a pattern of five, is held out.
CELLS = 5
#: What is known of the room by the baseline alone: axis and offset of floor, ceiling, walls [m].
WALLS = ((0, -2.28), (0, 2.28), (1, -2.28), (1, 2.28), (2, 0.0), (2, 3.0))
#: Surfaces that are looked for, step of the search and how far around the receivers [m].
_SURFACES, _STEP_M, _MARGIN_M = 10, 0.01, 1.0
#: Least receivers that a surface must serve.
_FEWEST = 60
_LENGTHS_M, _NOISES = (0.25, 0.4, 0.6, 0.9), (0.01, 0.03, 0.1)
#: Prior power of a reflection's gain, and of the direct path's, which is nearly known.
_REFLECTED, _DIRECT = 0.6, 100.0

_Surface = tuple[int, float]


@dataclass(frozen=True)
class Bedroom:
    """What such a table holds."""

    tx: Float[np.ndarray, "3"]
    """The transmitter [m]."""
    rx: Float[np.ndarray, "receiver 3"]
    """Receivers [m]."""
    wavenumber: float
    """2πf/c [rad/m]."""
    csi: Complex128[np.ndarray, "receiver"]
    """Channel of each receiver."""

    @staticmethod
    def read(path: Path) -> Bedroom:
        """The largest table of a file.

        Raises:
            RfgsFormatError: It has no places or no frequency.
        """
        capture = read_capture(path).largest
        if capture.tx_xyz is None or capture.rx_xyz is None or capture.centre_hz is None:
            raise RfgsFormatError(f"{path}: expected a table of receivers with places")
        wavenumber = 2 * np.pi * capture.centre_hz / SPEED_OF_LIGHT
        csi = capture.values.ravel().astype(np.complex128)
        return Bedroom(capture.tx_xyz[0], capture.rx_xyz, wavenumber, csi)


@dataclass(frozen=True)
class _Room:
    """Places and the wave number."""

    tx: Float[np.ndarray, "3"]
    rx: Float[np.ndarray, "receiver 3"]
    wavenumber: float

    def source(self, surface: _Surface | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Free-space channel, point of reflection and its cosine for each receiver."""
        image = self.tx.copy()
        if surface is None:
            return self._free_space(image), self.rx, np.ones(len(self.rx))
        axis, offset = surface
        image[axis] = 2.0 * offset - image[axis]
        way = self.rx - image
        share = (offset - image[axis]) / np.where(way[:, axis] == 0, np.inf, way[:, axis])
        cosine = np.abs(way[:, axis]) / np.linalg.norm(way, axis=1)
        seen = (share > 0) & (share < 1)
        return self._free_space(image) * seen, image + share[:, None] * way, cosine

    def _free_space(self, source: np.ndarray) -> Complex[np.ndarray, "receiver"]:
        distance = np.linalg.norm(self.rx - source, axis=1)
        return np.exp(-1j * self.wavenumber * distance) / (2 * self.wavenumber * distance)


def judge_bedroom(path: Path) -> dict[str, float | str]:
    """Complex SNR at held-out blocks of receivers, pooled over five folds [dB].

    Returns:
        `walls_snr_db`: line of sight and six wall images with fitted gains, walls known;
        `line_of_sight_snr_db`; `ours_snr_db`; and how ours is worst.
    """
    read = Bedroom.read(path)
    room, csi = _Room(read.tx, read.rx, read.wavenumber), read.csi
    fold = folds(room.rx)
    answers = {"line_of_sight": 0 * csi, "walls": 0 * csi, "ours": 0 * csi}
    for number in range(CELLS):
        train = fold != number
        answers["line_of_sight"][~train] = _images(room, csi, train, ())[~train]
        answers["walls"][~train] = _images(room, csi, train, WALLS)[~train]
        answers["ours"][~train] = predict(room, csi, train)[~train]
    each = [snr_db(csi[fold == n], answers["ours"][fold == n]) for n in range(CELLS)]
    return {
        **{f"{name}_snr_db": snr_db(csi, answer) for name, answer in answers.items()},
        "ours_worst_fold_db": min(each),
        "receivers": float(len(csi)),
    }


def folds(rx: Float[np.ndarray, "receiver 3"]) -> Int64[np.ndarray, "receiver"]:
    """Number of the fold that holds each receiver out: whole columns of the room at a time."""
    low, high = rx.min(axis=0)[:2], rx.max(axis=0)[:2]
    cell = np.clip(((rx[:, :2] - low) / (high - low) * CELLS).astype(np.int64), 0, CELLS - 1)
    return (cell[:, 0] + 2 * cell[:, 1]) % CELLS


def snr_db(true: np.ndarray, predicted: np.ndarray) -> float:
    """Power of what is true over that of the error [dB]."""
    error = float((np.abs(true - predicted) ** 2).sum())
    return float(decibels(float((np.abs(true) ** 2).sum()) / max(error, 1e-300)))


def _images(
    room: _Room, csi: np.ndarray, train: Bool[np.ndarray, "receiver"], walls: tuple[_Surface, ...]
) -> Complex[np.ndarray, "receiver"]:
    """The direct path and images in known walls, one fitted gain each."""
    columns = np.stack([room.source(wall)[0] for wall in (None, *walls)], axis=1)
    gain = np.linalg.lstsq(columns[train], csi[train], rcond=None)[0]
    return columns @ gain


def predict(
    room: _Room, csi: np.ndarray, train: Bool[np.ndarray, "receiver"]
) -> Complex[np.ndarray, "receiver"]:
    """Channel everywhere, from those of the training receivers."""
    sources = [room.source(None), *map(room.source, surfaces(room, csi, train))]
    level = float(np.mean(np.abs(csi[train]) ** 2))
    best, found = -np.inf, np.zeros_like(csi)
    for length_m in _LENGTHS_M:
        covariance = np.zeros((len(csi), len(csi)), np.complex128)
        for number, row in enumerate(sources):
            covariance += _covariance(row, number, length_m)
        seen = covariance[np.ix_(train, train)]
        for noise in _NOISES:
            factor = np.linalg.cholesky(seen + noise * level * np.eye(len(seen)))
            white = np.linalg.solve(factor, csi[train])
            likelihood = -np.vdot(white, white).real - 2 * np.log(np.diag(factor).real).sum()
            if likelihood > best:
                weight = np.linalg.solve(factor.conj().T, white)
                best, found = likelihood, covariance[:, train] @ weight
    return found


def _covariance(
    source: tuple[np.ndarray, np.ndarray, np.ndarray], number: int, length_m: float
) -> Complex[np.ndarray, "receiver receiver"]:
    """Covariance of the channels by one source."""
    channel, point, _ = source
    outer = channel[:, None] * np.conj(channel)
    if number == 0:
        return _DIRECT * outer
    square = (point**2).sum(axis=1)
    squared = np.maximum(square[:, None] + square - 2 * point @ point.T, 0.0)
    return _REFLECTED * outer * (0.5 + 0.5 * np.exp(-0.5 * squared / length_m**2))


def surfaces(room: _Room, csi: np.ndarray, train: Bool[np.ndarray, "receiver"]) -> list[_Surface]:
    """Surfaces that explain most of the training channels, found one after the other.

    While they are looked for, a surface's gain is a parabola of the cosine of incidence.
    """
    rx = room.rx[train]
    inside = _Room(room.tx, rx, room.wavenumber)
    low, high = rx.min(axis=0) - _MARGIN_M, rx.max(axis=0) + _MARGIN_M
    candidates = [(a, float(o)) for a in range(3) for o in np.arange(low[a], high[a], _STEP_M)]
    columns = {surface: _columns(inside, surface) for surface in candidates}
    columns = {
        surface: rows
        for surface, rows in columns.items()
        if np.count_nonzero(rows[:, 0]) >= _FEWEST
    }
    basis = inside.source(None)[0][:, None]
    chosen: list[_Surface] = []
    for _ in range(_SURFACES):
        own, _ = np.linalg.qr(basis)
        residual = csi[train] - own @ (own.conj().T @ csi[train])
        gained = {s: _explained(rows, own, residual) for s, rows in columns.items()}
        chosen.append(max(gained, key=lambda surface: gained[surface]))
        basis = np.concatenate([basis, columns[chosen[-1]]], axis=1)
    return chosen


def _columns(room: _Room, surface: _Surface) -> Complex[np.ndarray, "receiver 3"]:
    channel, _, cosine = room.source(surface)
    return channel[:, None] * np.stack([np.ones_like(cosine), cosine, cosine**2], axis=1)


def _explained(rows: np.ndarray, own: np.ndarray, residual: np.ndarray) -> float:
    """Power of a residual that some columns explain beyond others."""
    new, _ = np.linalg.qr(rows - own @ (own.conj().T @ rows))
    return float((np.abs(new.conj().T @ residual) ** 2).sum())
