# SPDX-License-Identifier: Apache-2.0
"""Levels of several covariances whose sum explains the entries of one device pair.

Bodies, their echoes by way of walls and noise each make a pair's entries a normal vector; together

    y ~ CN(0, R),   R = Σ_k s_k C_k

of levels s_k ≥ 0 that are not known. They are fitted by minorisation, every step of which raises
the likelihood (Zhou, Hu, Zhou and Lange, J. Comput. Graph. Stat. 28(2), 2019):

    s_k ← s_k √(yᴴ R⁻¹ C_k R⁻¹ y / tr(R⁻¹ C_k))
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np
from jaxtyping import Complex, Complex128, Float64

from rfgs_core.lapack import inverted
from rfgs_core.limbs.evidence.kernel import log_evidence
from rfgs_core.vector_math import FAST_REDUCTION

#: Steps of the fit, and the least level of the first covariance, which is noise: a share of the
#: entries' mean power.
STEPS, LEAST_NOISE = 15, 1e-3
#: Relative error of an entry of a covariance, which is computed in single precision.
_ROUNDING = float(np.finfo(np.float32).eps)


class Levels(NamedTuple):
    """Covariances at their likeliest levels."""

    change: Complex128[np.ndarray, "entry"]
    """What was heard, in units of its root mean square."""
    parts: Complex128[np.ndarray, "part entry entry"]
    """Covariances of mean power 1; the first is that of noise."""
    level: Float64[np.ndarray, "part"]
    """Power of each."""

    @staticmethod
    def fitted(
        change: Complex128[np.ndarray, "entry"],
        parts: list[Complex[np.ndarray, "entry entry"]],
        start: Float64[np.ndarray, "part"] | None = None,
    ) -> Levels:
        """The likeliest levels of some covariances and of white noise.

        Args:
            change: What was heard, in units of its root mean square.
            parts: Covariances of at least an upper triangle; one without power has no say.
            start: Levels to start from, noise first; None: equal ones.
        """
        whole = _whole([np.eye(len(change), dtype=np.complex64), *parts])
        if len(whole) == 1:
            # White noise alone has the mean power.
            power = float(np.vdot(change, change).real) / len(change)
            return Levels(change, whole, np.array([max(power, LEAST_NOISE)]))
        level = np.full(len(whole), 1.0 / len(whole)) if start is None else start.copy()
        level[~whole.any(axis=(1, 2))] = 0.0
        if not _climbed(change.astype(np.complex128), whole, level):
            raise np.linalg.LinAlgError("a covariance with noise is not positive definite")
        return Levels(change, whole, level)

    @property
    def covariance(self) -> Complex128[np.ndarray, "entry entry"]:
        """Of all together."""
        return np.tensordot(self.level, self.parts, 1)

    @property
    def log_likelihood(self) -> float:
        """Of what was heard, without the constant −N ln π [nat]."""
        root = np.linalg.cholesky(self.covariance)
        white = np.linalg.solve(root, self.change)
        spread = 2.0 * float(np.log(np.diagonal(root).real).sum())
        return -spread - float(np.vdot(white, white).real)

    def with_part(self, part: Complex[np.ndarray, "entry entry"]) -> Levels:
        """One covariance more, and the levels of all fitted anew."""
        start = np.append(0.9 * self.level, 0.1 * self.level.sum())
        parts = [*self.parts[1:], part]
        return Levels.fitted(self.change, parts, start)

    def expected_rise(self, level: float) -> float:
        """By how much the last covariance, at a level, raises the log-likelihood on average [nat].

        Against noise of its power in its place, for that is how it is explained without it:
        Σ (λ − 1 − ln λ) over the eigenvalues λ of R₀⁻¹ R₁, the divergence of the two normal
        distributions (Kullback and Leibler, Ann. Math. Stat. 22(1), 1951).
        """
        others = np.tensordot(self.level[:-1], self.parts[:-1], 1)
        whitener = np.linalg.inv(np.linalg.cholesky(others + level * self.parts[0]))
        there = whitener @ (others + level * self.parts[-1]) @ whitener.conj().T
        eigenvalues = np.maximum(np.linalg.eigvalsh(there), 1e-12)
        return float((eigenvalues - 1.0 - np.log(eigenvalues)).sum())

    def rises(self, parts: list[Complex[np.ndarray, "entry entry"]]) -> Float64[np.ndarray, "part"]:
        """By how much each covariance, added alone, raises the log-likelihood at least [nat].

        The levels here keep their ratios: without them, what is left is one covariance and noise.
        Zero where nothing was heard.
        """
        if not self.change.any():
            return np.zeros(len(parts))
        whitener = np.linalg.inv(np.linalg.cholesky(self.covariance))
        white = whitener @ self.change
        before = -len(white) * (math.log(np.vdot(white, white).real / len(white)) + 1.0)
        whitened = whitener @ _whole(parts) @ whitener.conj().T
        return np.maximum([log_evidence(white, part) - before for part in whitened], 0.0)


def mean_power(upper: Complex[np.ndarray, "entry entry"]) -> float:
    """Mean power of entries of a covariance."""
    return float(np.diagonal(upper).real.mean())


@numba.njit(cache=True, nogil=True)
def _climbed(change: np.ndarray, whole: np.ndarray, level: np.ndarray) -> bool:
    """`STEPS` steps of the fit, in place; false where a covariance is not positive definite."""
    size = len(change)
    covariance = np.zeros((size, size), np.complex128)
    level[0] = max(level[0], _least_noise(level, size))
    for _ in range(STEPS):
        covariance[:] = 0.0
        for k in range(len(level)):
            for n in range(size):
                for m in range(n + 1):
                    covariance[n, m] += level[k] * whole[k, n, m]
        if not inverted(covariance):
            return False
        _improve(change, whole, covariance, level)
        level[0] = max(level[0], _least_noise(level, size))
    return True


@numba.njit(forceinline=True, cache=True, nogil=True, fastmath=FAST_REDUCTION)
def _improve(change: np.ndarray, whole: np.ndarray, weights: np.ndarray, level: np.ndarray) -> None:
    """A step of the fit, in place, by the inverse covariance's lower triangle."""
    size = len(change)
    white = np.zeros(size, np.complex128)
    for n in range(size):
        for m in range(n):
            white[n] += weights[n, m] * change[m]
            white[m] += np.conj(weights[n, m]) * change[n]
        white[n] += weights[n, n].real * change[n]
    for k in range(len(level)):
        power, trace = 0.0, 0.0
        for n in range(size):
            echo = 0.0j
            for m in range(n):
                entry, weight = whole[k, n, m], weights[n, m]
                echo += entry * white[m]
                trace += 2.0 * (entry.real * weight.real + entry.imag * weight.imag)
            echo = 2.0 * echo + whole[k, n, n] * white[n]
            power += white[n].real * echo.real + white[n].imag * echo.imag
            trace += whole[k, n, n].real * weights[n, n].real
        # What a part has of the change rounds to less than nothing where it has no share.
        level[k] *= math.sqrt(max(power, 0.0) / max(trace, 1e-300))


@numba.njit(cache=True, nogil=True)
def _least_noise(level: np.ndarray, entries: int) -> float:
    """Least level of the noise beside other levels.

    Rounding takes no more than ε √(Σ |C|²) ≤ ε tr C from the smallest eigenvalue of a covariance,
    and its trace is the number of entries. A body that one direction of antennas explains may have
    a level of some hundred: then that is more than `LEAST_NOISE`, and makes R indefinite.
    """
    return max(LEAST_NOISE, _ROUNDING * entries * level[1:].sum())


def _whole(
    upper: list[Complex[np.ndarray, "entry entry"]],
) -> Complex128[np.ndarray, "part entry entry"]:
    """Both triangles of covariances, at mean power 1; of those without power nothing."""
    whole = np.zeros((len(upper), *upper[0].shape), dtype=np.complex128)
    for part, here in zip(upper, whole, strict=True):
        _fill(part, here)
    return whole


@numba.njit(cache=True, nogil=True)
def _fill(upper: np.ndarray, whole: np.ndarray) -> None:
    """Writes both triangles of a covariance at mean power 1 over zeros."""
    size, level = len(upper), 0.0
    for n in range(size):
        level += upper[n, n].real / size
    if level <= 0.0:
        return
    for n in range(size):
        whole[n, n] = upper[n, n].real / level
        for m in range(n + 1, size):
            entry = upper[n, m] / level
            whole[n, m], whole[m, n] = entry, entry.conjugate()
