# SPDX-License-Identifier: Apache-2.0
"""AFRL's phase history: pulses that were never seen, and how sharp the picture is.

The aperture is a degree of a circle of ten kilometres, so a point of the scene is a slant range
and a cross range, and a pulse at angle α sees D(f, α) = Σ I(r, x) e^{−j4πf (r + x sin α)/c}.
Ours is the posterior mean of the picture under a prior whose variance is the picture's own power
of the step before (sparse Bayesian learning; Tipping 2001), by conjugate gradients.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Complex64, Float, Int64

from rfgs_core.capture import Capture, read_capture
from rfgs_core.errors import RfgsFormatError
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.real.bedroom import snr_db

#: Cells across, their extent either side [m], and cells of range.
_ACROSS, _HALF_WIDTH_M, _RANGES = 168, 75.0, 512
#: Scatterers of OMP; steps of reweighting and of conjugate gradients; noise over signal.
_SCATTERERS, _REWEIGHTINGS, _STEPS, _NOISE = 60, 3, 20, 0.1
#: Share of a picture's mean power that any cell keeps, lest it be lost for good.
_FLOOR = 1e-3


@dataclass(frozen=True)
class _Aperture:
    """The operator from pictures to pulses and its adjoint."""

    turn: Complex64[np.ndarray, "frequency pulse across"]

    @staticmethod
    def of(capture: Capture) -> _Aperture:
        """Angles of the pulses come from the antenna's places."""
        assert capture.tx_xyz is not None
        way = capture.tx_xyz / np.linalg.norm(capture.tx_xyz, axis=1, keepdims=True)
        _, _, axes = np.linalg.svd(way - way.mean(axis=0), full_matrices=False)
        sine = (way - way.mean(axis=0)) @ axes[0]
        across = np.linspace(-_HALF_WIDTH_M, _HALF_WIDTH_M, _ACROSS, endpoint=False)
        wavenumber = 4 * np.pi * capture.freq_hz / SPEED_OF_LIGHT
        phase = wavenumber[:, None, None] * sine[:, None] * across
        return _Aperture(np.exp(-1j * phase).astype(np.complex64))

    def see(self, picture: np.ndarray, pulses: np.ndarray) -> Complex64[np.ndarray, "pulse f"]:
        """Pulses of a picture."""
        spectrum = np.fft.fft(picture, axis=0)[: len(self.turn)].astype(np.complex64)
        return np.matmul(self.turn[:, pulses], spectrum[..., None])[..., 0].T

    def project(self, data: np.ndarray, pulses: np.ndarray) -> Complex64[np.ndarray, "r x"]:
        """Plain back-projection, the adjoint."""
        rows = np.conj(self.turn[:, pulses]).transpose(0, 2, 1)
        spectrum = np.zeros((_RANGES, _ACROSS), np.complex64)
        spectrum[: len(self.turn)] = np.matmul(rows, data.T[..., None])[..., 0]
        return (np.fft.ifft(spectrum, axis=0) * _RANGES).astype(np.complex64)


def judge_aperture(path: Path) -> dict[str, float | str]:
    """SNR of held-out pulses [dB], and entropy and contrast of pictures of all pulses.

    Held out are the last quarter (an angle nobody saw), the middle quarter, and every fourth.
    """
    capture = read_capture(path).largest
    if capture.tx_xyz is None or len(capture.bins) > _RANGES or len(capture) < 8:
        raise RfgsFormatError(f"{path}: expected a phase history of at most {_RANGES} frequencies")
    data = capture.values[:, 0, 0, 0]
    aperture, count = _Aperture.of(capture), len(data)
    everything, quarter = np.arange(count), count // 4
    held_out = {
        "last": everything[-quarter:],
        "middle": everything[3 * count // 8 : 3 * count // 8 + quarter],
        "every_fourth": everything[2::4],
    }
    result: dict[str, float | str] = {}
    for name, test in held_out.items():
        train = np.setdiff1d(everything, test)
        for method, solve in (("omp", _omp), ("ours", _ours)):
            seen = aperture.see(solve(aperture, data[train], train), test)
            result[f"{name}_{method}_snr_db"] = snr_db(data[test], seen)
    pictures = {
        "backprojection": aperture.project(data, everything),
        "ours": _ours(aperture, data, everything),
    }
    for name, picture in pictures.items():
        power = np.abs(picture.astype(np.complex128)) ** 2
        share = power / power.sum()
        result[f"{name}_entropy"] = float(-(share * np.log(share + 1e-300)).sum())
        result[f"{name}_contrast"] = float(power.std() / power.mean())
    return result


def _ours(
    aperture: _Aperture, data: np.ndarray, pulses: Int64[np.ndarray, "pulse"]
) -> Complex64[np.ndarray, "r x"]:
    noise = _NOISE * float(np.mean(np.abs(data) ** 2))
    cells = _RANGES * _ACROSS
    prior = np.full((_RANGES, _ACROSS), float(np.mean(np.abs(data) ** 2)) / cells)
    picture = np.zeros((_RANGES, _ACROSS), np.complex64)
    for _ in range(_REWEIGHTINGS):
        picture = _posterior(aperture, data, pulses, prior, noise)
        power = np.abs(picture) ** 2
        prior = power + _FLOOR * power.mean()
    return picture


def _posterior(
    aperture: _Aperture,
    data: np.ndarray,
    pulses: np.ndarray,
    prior: Float[np.ndarray, "r x"],
    noise: float,
) -> Complex64[np.ndarray, "r x"]:
    """Mean of the picture: (A W Aᴴ + σ²)-regularised least squares in y = W^{−½} I."""
    root = np.sqrt(prior).astype(np.float32)
    residual = root * aperture.project(data, pulses)
    found, step = np.zeros_like(residual), residual.copy()
    size = first = float(np.vdot(residual, residual).real)
    for _ in range(_STEPS):
        image = root * aperture.project(aperture.see(root * step, pulses), pulses) + noise * step
        length = size / float(np.vdot(step, image).real)
        found += length * step
        residual = residual - length * image
        size, before = float(np.vdot(residual, residual).real), size
        if size < 1e-6 * first:
            break
        step = residual + size / before * step
    return root * found


def _omp(
    aperture: _Aperture, data: np.ndarray, pulses: Int64[np.ndarray, "pulse"]
) -> Complex64[np.ndarray, "r x"]:
    """Orthogonal matching pursuit on the same cells; gains are refitted every ten scatterers."""
    residual, columns, cells = data, [], []
    gains = np.zeros(0, np.complex64)
    for number in range(1, _SCATTERERS + 1):
        match = aperture.project(residual, pulses)
        cell = np.unravel_index(int(np.abs(match).argmax()), match.shape)
        single = np.zeros_like(match)
        single[cell] = 1.0
        cells.append(cell)
        columns.append(aperture.see(single, pulses).ravel())
        if number % 10 and number != _SCATTERERS:
            residual = residual - match[cell] / data.size * columns[-1].reshape(data.shape)
            continue
        matrix = np.stack(columns, axis=1)
        gains = np.linalg.lstsq(matrix, data.ravel(), rcond=None)[0]
        residual = data - (matrix @ gains).reshape(data.shape)
    picture = np.zeros((_RANGES, _ACROSS), np.complex64)
    for cell, gain in zip(cells, gains, strict=True):
        picture[cell] += gain
    return picture
