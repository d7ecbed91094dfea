# SPDX-License-Identifier: Apache-2.0
"""Elementary functions that the compiler can turn into vector code.

numba calls the C library for `exp`, `sin` and `cos`, one value at a time. The float32 versions
here are short polynomials without branches, so that loops over Gaussians become SIMD code. The
float64 versions are the library's: they serve gradient checks, not speed. They are inlined
before compilation (`inline="always"`), as LLVM leaves a loop scalar when it still finds a call;
numba's `max` of two numbers is such a call.

A function with such freedom that another compiled one calls has `forceinline=True`: otherwise its
caller's cached file holds a second copy, optimised once more and so of other last bits, and which
of the two serves depends on what the process has compiled or loaded before.

numba's cache looks at the file of a kernel only: after editing this module, remove the cached
kernels of its neighbours (`__pycache__/*.nbi`).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit, types
from numba.extending import overload

#: Compiler freedom of all kernels. Signed zeros, infinities and NaN are of no use here.
FAST_MATH = {"nnan", "ninf", "nsz", "arcp", "contract"}
#: Where a sum over Gaussians shall become a vector sum, in an order fixed at compile time.
FAST_REDUCTION = FAST_MATH | {"reassoc"}

#: Gaussians per block: about thirty rows of this many float32 numbers stay in the L1 cache.
BLOCK = 128

#: Rows kept free on both sides of a block's scratch. Vector code asks at run time whether what it
#: writes lies near what it reads, and takes the scalar way (other last bits) where it does: the
#: heap's layout would show in the result.
_SPARE_ROWS = 32

_OPTIONS: Any = {"fastmath": FAST_MATH, "error_model": "numpy"}
_F = np.float32
_LOG2_E = _F(1.4426950408889634)
_LN_2 = _F(0.6931471805599453)
_LOWEST = _F(-87.0)


@njit(forceinline=True, **_OPTIONS)
def scratch(rows: int, like: np.ndarray) -> np.ndarray:
    """Zeroed [rows, BLOCK] for one block in the precision of `like`, apart from other arrays."""
    return np.zeros((rows + 2 * _SPARE_ROWS, BLOCK), dtype=like.dtype)[_SPARE_ROWS:-_SPARE_ROWS]


@njit(inline="always", **_OPTIONS)
def three_rows(table: np.ndarray, first: int, n: int) -> tuple[np.ndarray, ...]:
    """Views of n columns of a table's three rows.

    An index that is a sum may be negative for all the compiler knows, and then counts from the
    end: vector code fetches such values one by one. Within a view it loads them in one go.
    """
    end = first + n
    return table[0, first:end], table[1, first:end], table[2, first:end]


@njit(inline="always", **_OPTIONS)
def four_rows(table: np.ndarray, first: int, n: int) -> tuple[np.ndarray, ...]:
    """Views of n columns of a table's four rows, as `three_rows`."""
    end = first + n
    return table[0, first:end], table[1, first:end], table[2, first:end], table[3, first:end]


@njit(inline="always", **_OPTIONS)
def six_rows(table: np.ndarray, first: int, n: int) -> tuple[np.ndarray, ...]:
    """Views of n columns of a table's six rows, as `three_rows`."""
    end = first + n
    return (
        *(table[0, first:end], table[1, first:end], table[2, first:end]),
        *(table[3, first:end], table[4, first:end], table[5, first:end]),
    )


def exponential(x: float | np.float32) -> float:
    """exp(x) in the precision of x; in float32 within |x| 1e-7, and exp(-87) below -87."""
    return math.exp(x)


def sine_cosine_of_turns(turns: float | np.float32) -> tuple[float, float]:
    """Sine and cosine of 2 pi `turns`, for `turns` in [-0.5, 0.5]."""
    return math.sin(2 * math.pi * turns), math.cos(2 * math.pi * turns)


@overload(exponential, inline="always", jit_options=_OPTIONS)
def _exponential(x: Any) -> Any:
    """Chooses the implementation of `exponential` by type."""

    def double(x: Any) -> Any:
        return math.exp(x)

    def single(x: Any) -> Any:
        x = max(x, _LOWEST)
        n = np.floor(x * _LOG2_E + _F(0.5))
        r = x - n * _LN_2
        # Taylor series on |r| <= ln 2 / 2: the first term left out is below 2e-7.
        p = _F(1 / 720) * r + _F(1 / 120)
        p = p * r + _F(1 / 24)
        p = p * r + _F(1 / 6)
        p = p * r + _F(0.5)
        p = p * r + _F(1.0)
        p = p * r + _F(1.0)
        # 2^n: n goes into the exponent bits of an IEEE 754 number.
        power = np.int32((np.int32(n) + np.int32(127)) << np.int32(23))
        return p * power.view(np.float32)

    return single if x == types.float32 else double


@overload(sine_cosine_of_turns, inline="always", jit_options=_OPTIONS)
def _sine_cosine_of_turns(turns: Any) -> Any:
    """Chooses the implementation of `sine_cosine_of_turns` by type."""

    def double(turns: Any) -> Any:
        return math.sin(2 * math.pi * turns), math.cos(2 * math.pi * turns)

    def single(turns: Any) -> Any:
        # sin and cos of pi t by Chebyshev interpolation in t^2 (errors below 1e-9), then the
        # double-angle formulas: no quadrant has to be chosen.
        x = turns * turns
        s = _F(-0.0070283) * x + _F(0.08205035)
        s = s * x + _F(-0.59925219)
        s = s * x + _F(2.55016332)
        s = s * x + _F(-5.16771276)
        s = (s * x + _F(3.14159265)) * turns
        c = _F(1.83999059e-3) * x + _F(-2.57763173e-2)
        c = c * x + _F(0.235325437)
        c = c * x + _F(-1.33526232)
        c = c * x + _F(4.05871211)
        c = c * x + _F(-4.93480220)
        c = c * x + _F(1.0)
        return (s + s) * c, _F(1.0) - (s + s) * s

    return single if turns == types.float32 else double
