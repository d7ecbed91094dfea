# SPDX-License-Identifier: Apache-2.0
"""Levels of covariances: against the plain formula, closed forms and means over many draws."""

from __future__ import annotations

import numpy as np
import pytest

from rfgs_core.limbs.evidence.levels import LEAST_NOISE, Levels, mean_power

SIZE = 24


def covariance(seed: int, rank: int = 6) -> np.ndarray:
    """Of a few echoes, mean power 1."""
    rng = np.random.default_rng(seed)
    answers = rng.standard_normal((SIZE, rank)) + 1j * rng.standard_normal((SIZE, rank))
    matrix = answers @ answers.conj().T
    return matrix / mean_power(matrix)


def drawn(matrix: np.ndarray, count: int, seed: int) -> np.ndarray:
    """Entries of a covariance, shape (count, entry)."""
    rng = np.random.default_rng(seed)
    white = rng.standard_normal((count, SIZE)) + 1j * rng.standard_normal((count, SIZE))
    return (white / np.sqrt(2.0)) @ np.linalg.cholesky(matrix).T


@pytest.fixture(scope="module")
def two() -> Levels:
    parts = [covariance(0), covariance(1)]
    heard = drawn(0.6 * parts[0] + 0.3 * parts[1] + 0.1 * np.eye(SIZE), 1, seed=2)[0]
    return Levels.fitted(heard, parts)


def test_likelihood_is_that_of_a_normal_vector(two: Levels) -> None:
    matrix = two.covariance
    quadratic = np.vdot(two.change, np.linalg.inv(matrix) @ two.change).real
    expected = -np.linalg.slogdet(matrix)[1] - quadratic
    assert two.log_likelihood == pytest.approx(expected, rel=1e-9)


def test_noise_alone_has_the_level_of_its_power() -> None:
    heard = 1.7 * drawn(np.eye(SIZE), 1, seed=3)[0]
    fit = Levels.fitted(heard, [])
    assert fit.level[0] == pytest.approx(np.mean(np.abs(heard) ** 2), rel=1e-3)


def test_no_other_levels_are_likelier(two: Levels) -> None:
    found = two._replace(level=np.maximum(two.level, [LEAST_NOISE, 0.0, 0.0]))
    for part in range(3):
        for factor in (0.5, 2.0):
            level = two.level.copy()
            level[part] *= factor
            assert two._replace(level=level).log_likelihood < found.log_likelihood + 0.05


def test_levels_are_those_of_what_was_drawn() -> None:
    parts, true = [covariance(0), covariance(1)], np.array([0.1, 0.6, 0.3])
    matrix = true[1] * parts[0] + true[2] * parts[1] + true[0] * np.eye(SIZE)
    levels = [Levels.fitted(heard, parts).level for heard in drawn(matrix, 60, seed=4)]
    assert np.mean(levels, axis=0) == pytest.approx(true, rel=0.25)


def test_the_upper_triangle_is_enough_and_units_do_not_matter(two: Levels) -> None:
    again = Levels.fitted(two.change, [np.triu(7.0 * part) for part in two.parts[1:]])
    assert again.level == pytest.approx(two.level, rel=1e-9)


def test_what_has_no_power_has_no_say(two: Levels) -> None:
    more = Levels.fitted(two.change, [*two.parts[1:], np.zeros((SIZE, SIZE))])
    assert more.level[3] == 0.0
    assert more.log_likelihood == pytest.approx(two.log_likelihood, abs=0.2)


def test_what_is_there_raises_the_likelihood_and_nothing_else_does() -> None:
    known, missing, stranger = (covariance(seed) for seed in (0, 1, 5))
    matrix = 0.5 * known + 0.4 * missing + 0.1 * np.eye(SIZE)
    there, not_there = [], []
    for heard in drawn(matrix, 20, seed=6):
        fit = Levels.fitted(heard, [known])
        rises = fit.rises([missing, stranger])
        full = fit.with_part(missing).log_likelihood - fit.log_likelihood
        assert full > rises[0] - 1.0
        there.append(rises[0])
        not_there.append(rises[1])
    assert np.mean(there) > np.mean(not_there) + 3.0


def test_expected_rise_is_the_mean_over_draws() -> None:
    known, new, level = covariance(0), covariance(1), 0.5
    parts = np.array([np.eye(SIZE), known, new])
    there = Levels(np.zeros(SIZE, complex), parts, np.array([0.2, 0.8, level]))
    noise_instead = there._replace(level=np.array([0.2 + level, 0.8, 0.0]))
    rises = [
        there._replace(change=heard).log_likelihood
        - noise_instead._replace(change=heard).log_likelihood
        for heard in drawn(there.covariance, 4000, seed=7)
    ]
    assert there.expected_rise(level) == pytest.approx(np.mean(rises), rel=0.05)


def test_what_is_missing_is_expected_though_it_filled_the_noise() -> None:
    known, missing, level = covariance(0), covariance(1), 0.6
    matrix = 0.4 * known + level * missing + 0.01 * np.eye(SIZE)
    rises, expected = [], []
    for heard in drawn(matrix, 20, seed=8):
        fit = Levels.fitted(heard, [known])
        assert fit.level[0] > 0.1
        both = fit.with_part(missing)
        rises.append(both.log_likelihood - fit.log_likelihood)
        expected.append(both.expected_rise(level))
    assert np.mean(expected) == pytest.approx(np.mean(rises), rel=0.3)


def test_a_level_that_makes_rounding_louder_than_noise_is_fitted() -> None:
    """A covariance of two echoes, one 37 dB louder, of which the weak one was heard."""
    rng = np.random.default_rng(9)
    echoes = np.linalg.qr(rng.standard_normal((SIZE, 2)) + 1j * rng.standard_normal((SIZE, 2)))[0]
    part = ((echoes * [1.0, 2e-4]) @ echoes.conj().T).astype(np.complex64)
    heard = np.sqrt(SIZE) * echoes[:, 1]
    fit = Levels.fitted(heard, [part], start=np.array([LEAST_NOISE, 5e3]))
    assert fit.level[1] > 1e3
    assert fit.log_likelihood > Levels.fitted(heard, []).log_likelihood
