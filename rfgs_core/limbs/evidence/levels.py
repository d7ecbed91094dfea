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

import numpy as np
from jaxtyping import Complex, Complex128, Float64

from rfgs_core.lapack import inverse
from rfgs_core.limbs.evidence.kernel import log_evidence

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
        whole = np.array([np.eye(len(change)), *map(_whole, parts)], dtype=np.complex128)
        if len(whole) == 1:
            # White noise alone has the mean power.
            power = float(np.vdot(change, change).real) / len(change)
            return Levels(change, whole, np.array([max(power, LEAST_NOISE)]))
        level = np.full(len(whole), 1.0 / len(whole)) if start is None else start.copy()
        level[~whole.any(axis=(1, 2))] = 0.0
        level[0] = max(level[0], _least_noise(level, len(change)))
        for _ in range(STEPS):
            # The least noise makes every covariance positive definite.
            weights = inverse(np.tensordot(level, whole, 1))
            white = weights @ change
            # What a part has of the change rounds to less than nothing where it has no share.
            power = np.maximum(np.einsum("n,kn->k", white.conj(), whole @ white).real, 0.0)
            trace = np.einsum("knm,mn->k", whole, weights).real
            level = level * np.sqrt(power / np.maximum(trace, 1e-300))
            level[0] = max(level[0], _least_noise(level, len(change)))
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
        whitened = whitener @ _whole(np.array(parts)) @ whitener.conj().T
        return np.maximum([log_evidence(white, part) - before for part in whitened], 0.0)


def mean_power(upper: Complex[np.ndarray, "entry entry"]) -> float:
    """Mean power of entries of a covariance."""
    return float(np.diagonal(upper).real.mean())


def _least_noise(level: Float64[np.ndarray, "part"], entries: int) -> float:
    """Least level of the noise beside other levels.

    Rounding takes no more than ε √(Σ |C|²) ≤ ε tr C from the smallest eigenvalue of a covariance,
    and its trace is the number of entries. A body that one direction of antennas explains may have
    a level of some hundred: then that is more than `LEAST_NOISE`, and makes R indefinite.
    """
    return max(LEAST_NOISE, _ROUNDING * entries * float(level[1:].sum()))


def _whole(
    upper: Complex[np.ndarray, "*part entry entry"],
) -> Complex128[np.ndarray, "*part entry entry"]:
    """Both triangles of covariances, at mean power 1."""
    level = np.diagonal(upper, axis1=-2, axis2=-1).real.mean(axis=-1)[..., None, None]
    matrix = np.triu(upper) + np.triu(upper, 1).conj().swapaxes(-2, -1)
    return (matrix / np.where(level > 0.0, level, 1.0)).astype(np.complex128)
