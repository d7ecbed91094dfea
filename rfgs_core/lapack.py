# SPDX-License-Identifier: Apache-2.0
"""Routines of SciPy's BLAS and LAPACK for Hermitian matrices, within compiled kernels.

`scipy.linalg.blas` and `scipy.linalg.lapack` hold Python's lock while they work, so that many small
matrices in two threads take as long as in one. The same routines are called here by the addresses
that SciPy tells other compiled code, `scipy.linalg.cython_blas` and `cython_lapack`, and other
threads go on. Of an array in C's order Fortran sees the transposed one.
"""

from __future__ import annotations

from typing import Any

import llvmlite.binding as llvm
import numba
import numpy as np
from numba import types
from numba.extending import get_cython_function_address

_OPTIONS: Any = {"cache": True, "nogil": True}
#: Columns that are reduced together.
_BLOCK = 32
_UPPER, _LEFT, _CONJUGATE = ord("U"), ord("L"), ord("C")


def _routine(library: str, name: str, arguments: int) -> Any:
    """A routine for kernels, under a name that their cached files find again."""
    symbol = f"rfgs_{name}"
    llvm.add_symbol(symbol, get_cython_function_address(f"scipy.linalg.cython_{library}", name))
    return types.ExternalFunction(symbol, types.void(*[types.uintp] * arguments))


_cherk = _routine("blas", "cherk", 10)
_zpotrf, _zpotri = _routine("lapack", "zpotrf", 5), _routine("lapack", "zpotri", 5)
_chetrd, _zhetrd = _routine("lapack", "chetrd", 10), _routine("lapack", "zhetrd", 10)
_cunmtr, _zunmtr = _routine("lapack", "cunmtr", 13), _routine("lapack", "zunmtr", 13)


@numba.njit(**_OPTIONS)
def _succeeded(sizes: np.ndarray, _used: tuple[np.ndarray, ...]) -> bool:
    """Whether a routine's report, the last of its sizes, is zero.

    The compiler gives an array back after its last use, and its address is none: so this is asked
    with all whose addresses the routine had.
    """
    return sizes[-1] == 0


@numba.njit(**_OPTIONS)
def product_with_itself(rows: np.ndarray) -> np.ndarray:
    """Upper triangle of Σ_i a_i a_iᴴ, in half the work of a product.

    Args:
        rows: Complex64 [entry, term], columns a_i*.

    Returns:
        Complex64 [entry, entry], zero below the diagonal.
    """
    rows = np.ascontiguousarray(rows)
    out = np.zeros((rows.shape[0], rows.shape[0]), np.complex64)
    if rows.size:
        letters = np.array([_UPPER, _CONJUGATE], np.uint8)
        sizes = np.array([rows.shape[0], rows.shape[1], 0], np.int32)
        factors = np.array([1.0, 0.0], np.float32)
        letter, size, factor = letters.ctypes.data, sizes.ctypes.data, factors.ctypes.data
        _cherk(
            letter, letter + 1, size, size + 4, factor, rows.ctypes.data, size + 4,
            factor + 4, out.ctypes.data, size,
        )  # fmt: skip
        if not _succeeded(sizes, (letters, factors, rows, out)):
            raise ValueError("cherk has no report")
    return out.T


@numba.njit(**_OPTIONS)
def inverted(matrix: np.ndarray) -> bool:
    """Puts the inverse in the place of a positive definite matrix; only lower triangles count.

    Args:
        matrix: Complex128 [n, n] in C's order.

    Returns:
        Whether it is positive definite; what is left of one that is not is of no use.
    """
    letters, sizes = np.array([_UPPER], np.uint8), np.array([len(matrix), 0], np.int32)
    letter, size, place = letters.ctypes.data, sizes.ctypes.data, matrix.ctypes.data
    # Cholesky's factor, and the inverse out of it.
    _zpotrf(letter, size, place, size, size + 4)
    if sizes[1] == 0:
        _zpotri(letter, size, place, size, size + 4)
    return _succeeded(sizes, (letters, matrix))


@numba.njit(**_OPTIONS)
def tridiagonal(
    matrix: np.ndarray, values: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Qᴴ A Q with two diagonals, and Qᴴ y, of some unitary Q, in the precision of A.

    Args:
        matrix: A, complex64 or complex128 [n, n], at least its upper triangle.
        values: y, of the same kind [n].

    Returns:
        The diagonal [n], the one beside it [n], the last of which is of no use, and Qᴴ y [n].
    """
    count = len(matrix)
    work, turned = matrix.T.copy(), values.copy()
    diagonal, beside = np.zeros_like(values.real), np.zeros_like(values.real)
    tau, scratch = np.zeros(count, matrix.dtype), np.zeros(_BLOCK * count, matrix.dtype)
    letters = np.array([_UPPER, _LEFT, _CONJUGATE], np.uint8)
    sizes = np.array([count, _BLOCK * count, 1, 0], np.int32)
    upper, size = letters.ctypes.data, sizes.ctypes.data
    left, conjugate = upper + 1, upper + 2
    space, one, failed = size + 4, size + 8, size + 12
    a, d, e, t = work.ctypes.data, diagonal.ctypes.data, beside.ctypes.data, tau.ctypes.data
    y, w = turned.ctypes.data, scratch.ctypes.data
    # Told at compile time.
    if matrix.itemsize == 8:
        _chetrd(upper, size, a, size, d, e, t, w, space, failed)
        _cunmtr(left, upper, conjugate, size, one, a, size, t, y, size, w, space, failed)
    else:
        _zhetrd(upper, size, a, size, d, e, t, w, space, failed)
        _zunmtr(left, upper, conjugate, size, one, a, size, t, y, size, w, space, failed)
    if not _succeeded(sizes, (letters, work, tau, scratch, diagonal, beside, turned)):
        raise ValueError("a matrix that cannot be reduced to two diagonals")
    return diagonal, beside, turned
