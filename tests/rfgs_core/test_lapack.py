# SPDX-License-Identifier: Apache-2.0
"""Routines called by their addresses give what plain products and numpy's solvers do."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor

import numba
import numpy as np
import pytest

from rfgs_core.lapack import inverted, product_with_itself, tridiagonal
from rfgs_core.threads import in_threads

SIZES = [1, 2, 3, 31, 33, 96]


def complex_normal(shape: tuple[int, ...], seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)


def positive(size: int) -> np.ndarray:
    rows = complex_normal((size, size + 5), size)
    return rows @ rows.conj().T


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("terms", [0, 1, 70])
def test_the_upper_triangle_of_a_product(size: int, terms: int) -> None:
    rows = complex_normal((size, terms), 1).astype(np.complex64)
    got, expected = product_with_itself(rows), rows.conj() @ rows.T
    np.testing.assert_allclose(np.triu(got), np.triu(expected), rtol=1e-5, atol=1e-5 * terms)
    # Another order in memory makes no difference.
    turned = np.asfortranarray(rows)
    np.testing.assert_array_equal(product_with_itself(turned), got)


@pytest.mark.parametrize("size", SIZES)
def test_an_inverse_takes_the_lower_triangle_s_place(size: int) -> None:
    matrix = positive(size)
    expected, work = np.linalg.inv(matrix), np.tril(matrix)
    assert inverted(work)
    np.testing.assert_allclose(np.tril(work), np.tril(expected), rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(np.triu(work, 1), 0.0)


def test_what_has_no_factor_is_said() -> None:
    assert not inverted(np.diag([1.0, -1.0, 1.0]).astype(np.complex128))


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize(("kind", "rtol"), [(np.complex64, 2e-4), (np.complex128, 1e-11)])
def test_two_diagonals_keep_volume_and_length(size: int, kind: type, rtol: float) -> None:
    """Qᴴ (A + n I) Q has A + n I's determinant, and Qᴴ y the same yᴴ (A + n I)⁻¹ y."""
    matrix, y = positive(size) / size, complex_normal((size,), 7)
    before = matrix.copy()
    diagonal, beside, turned = tridiagonal(np.triu(matrix).astype(kind), y.astype(kind))
    assert diagonal.dtype == beside.dtype == np.dtype(kind).type(0).real.dtype
    np.testing.assert_array_equal(matrix, before)
    banded = np.diag(diagonal) + np.diag(beside[:-1], 1) + np.diag(beside[:-1], -1)
    for noise in (0.03, 2.0):
        plain, two = matrix + noise * np.eye(size), banded + noise * np.eye(size)
        assert np.linalg.slogdet(two)[1] == pytest.approx(
            np.linalg.slogdet(plain)[1], rel=rtol, abs=rtol * size
        )
        lengths = [np.vdot(v, np.linalg.solve(m, v)).real for v, m in ((y, plain), (turned, two))]
        assert lengths[1] == pytest.approx(lengths[0], rel=rtol)


def test_threads_do_not_share_what_they_work_with() -> None:
    """Two threads at once, many times: as each alone."""
    matrices = [positive(48), positive(49)]
    alone = [tridiagonal(matrix, matrix[0]) for matrix in matrices]
    with ThreadPoolExecutor(2) as pool:
        for _ in range(50):
            both = list(pool.map(lambda matrix: tridiagonal(matrix, matrix[0]), matrices))
            for got, expected in zip(both, alone, strict=True):
                for one, other in zip(got, expected, strict=True):
                    np.testing.assert_array_equal(one, other)


@pytest.fixture(params=[1, 2])
def threads(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> int:
    monkeypatch.setattr(numba, "get_num_threads", lambda: request.param)
    return request.param


@pytest.mark.usefixtures("threads")
def test_threads_keep_the_order_and_raise() -> None:
    assert in_threads(lambda x: x * x, range(7)) == [x * x for x in range(7)]
    with pytest.raises(ZeroDivisionError):
        in_threads(lambda x: 1 / x, [1, 0])


def test_of_one_thread_the_work_is_the_caller_s(threads: int) -> None:
    by = set(in_threads(lambda _: threading.get_ident(), range(3)))
    assert (by == {threading.get_ident()}) == (threads == 1)
