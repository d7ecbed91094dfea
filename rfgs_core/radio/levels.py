# SPDX-License-Identifier: Apache-2.0
"""Powers and amplitudes as levels in decibels, and back."""

from __future__ import annotations

from typing import overload

import numpy as np
from jaxtyping import Float

_Array = Float[np.ndarray, "..."]
#: Spelled out for checks at run time, for which an int is no float.
_Number = float | int | np.floating


@overload
def decibels(power: _Number, least: float = ...) -> float: ...
@overload
def decibels(power: _Array, least: float = ...) -> _Array: ...
def decibels(power: _Array | _Number, least: float = 1e-30) -> _Array | _Number:
    """Powers in dB, those below `least` as `least`: by default at least -300 dB."""
    return 10.0 * np.log10(np.maximum(power, least))


@overload
def amplitude_decibels(amplitude: _Number, least: float = ...) -> float: ...
@overload
def amplitude_decibels(amplitude: _Array, least: float = ...) -> _Array: ...
def amplitude_decibels(amplitude: _Array | _Number, least: float = 1e-15) -> _Array | _Number:
    """Amplitudes in dB, those below `least` as `least`: by default at least -300 dB."""
    return 20.0 * np.log10(np.maximum(amplitude, least))


@overload
def power_of(level_db: _Number) -> float: ...
@overload
def power_of(level_db: _Array) -> _Array: ...
def power_of(level_db: _Array | _Number) -> _Array | _Number:
    """Power of a level [dB]."""
    return 10.0 ** (level_db / 10.0)


@overload
def amplitude_of(level_db: _Number) -> float: ...
@overload
def amplitude_of(level_db: _Array) -> _Array: ...
def amplitude_of(level_db: _Array | _Number) -> _Array | _Number:
    """Amplitude of a level [dB]."""
    return 10.0 ** (level_db / 20.0)
