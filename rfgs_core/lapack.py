# SPDX-License-Identifier: Apache-2.0
"""Routines of SciPy's BLAS and LAPACK for Hermitian matrices, which let other threads go on.

`scipy.linalg.blas` and `scipy.linalg.lapack` hold Python's lock while they work, so that many small
matrices in two threads take as long as in one. The same routines are called here by the addresses
that SciPy tells other compiled code, `scipy.linalg.cython_blas` and `cython_lapack`.

Of a Hermitian matrix one triangle is read and written.
"""

from __future__ import annotations

import ctypes
import functools
from ctypes import byref, c_float, c_int, c_void_p
from typing import Any

import numpy as np
from jaxtyping import Complex, Complex64, Complex128, Float

#: Columns that are reduced together.
_BLOCK = 32


def product_with_itself(
    rows: Complex64[np.ndarray, "entry term"],
) -> Complex64[np.ndarray, "entry entry"]:
    """Upper triangle of Σ_i a_i a_iᴴ of conjugate columns a_i*, in half the work of a product.

    Args:
        rows: The conjugates, in C's order.
    """
    size, terms = c_int(rows.shape[0]), c_int(rows.shape[1])
    rows = np.ascontiguousarray(rows, np.complex64)
    out = np.zeros((rows.shape[0],) * 2, np.complex64, order="F")
    if rows.size:
        # As Fortran sees them they are (term, entry): the sum is their Aᴴ A.
        _routine("blas", "cherk")(
            b"U", b"C", byref(size), byref(terms), byref(c_float(1.0)), _at(rows), byref(terms),
            byref(c_float(0.0)), _at(out), byref(size),
        )  # fmt: skip
    return out


def invert(matrix: Complex128[np.ndarray, "n n"]) -> None:
    """Puts the inverse in the place of a positive definite matrix: only the lower triangles count.

    Args:
        matrix: In C's order.

    Raises:
        numpy.linalg.LinAlgError: It is not positive definite.
    """
    size, info = c_int(len(matrix)), c_int(0)
    # As Fortran sees it the lower triangle is the upper one of the conjugate: Cholesky's factor,
    # and the inverse out of it.
    for name in ("zpotrf", "zpotri"):
        _routine("lapack", name)(b"U", byref(size), _at(matrix), byref(size), byref(info))
        if info.value:
            raise np.linalg.LinAlgError("a matrix to be inverted is not positive definite")


def tridiagonal(
    matrix: Complex[np.ndarray, "n n"], values: Complex[np.ndarray, "n"]
) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n-1"], Complex[np.ndarray, "n"]]:
    """Qᴴ A Q with two diagonals, and Qᴴ y, of some unitary Q, in the precision of A.

    Args:
        matrix: A, at least its upper triangle.
        values: y.

    Returns:
        The diagonal, the one beside it, and Qᴴ y.
    """
    single = matrix.dtype == np.complex64
    kind, real, letter = (
        (np.complex64, np.float32, "c") if single else (np.complex128, np.float64, "z")
    )
    count = len(matrix)
    work, turned = np.array(matrix, kind, order="F"), np.array(values, kind)
    diagonal, beside = np.zeros(count, real), np.zeros(max(count - 1, 0), real)
    tau, scratch = np.zeros(count, kind), np.zeros(_BLOCK * count, kind)
    size, space = c_int(count), c_int(len(scratch))
    one, info = c_int(1), c_int(0)
    _routine("lapack", f"{letter}hetrd")(
        b"U", byref(size), _at(work), byref(size), _at(diagonal), _at(beside), _at(tau),
        _at(scratch), byref(space), byref(info),
    )  # fmt: skip
    if count > 1:
        _routine("lapack", f"{letter}unmtr")(
            b"L", b"U", b"C", byref(size), byref(one), _at(work), byref(size), _at(tau),
            _at(turned), byref(size), _at(scratch), byref(space), byref(info),
        )  # fmt: skip
    return diagonal, beside, turned


def _at(array: np.ndarray) -> c_void_p:
    return c_void_p(array.ctypes.data)


@functools.cache
def _routine(library: str, name: str) -> Any:
    """A routine by its name; whoever calls it lets go of Python's lock."""
    import importlib

    capsule = importlib.import_module(f"scipy.linalg.cython_{library}").__pyx_capi__[name]
    signature, address = ctypes.pythonapi.PyCapsule_GetName, ctypes.pythonapi.PyCapsule_GetPointer
    signature.restype, signature.argtypes = ctypes.c_char_p, [ctypes.py_object]
    address.restype, address.argtypes = c_void_p, [ctypes.py_object, ctypes.c_char_p]
    return ctypes.CFUNCTYPE(None)(address(capsule, signature(capsule)))
