# SPDX-License-Identifier: Apache-2.0
"""The paper's preprocessing (section 3.6): subcarrier power, Hamming window, unwrapped phase."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Complex, Float, Float64

#: Subcarriers whose power is below this share of the strongest are taken as silent.
_SILENT = 1e-24


def normalise_subcarriers(
    csi: Complex[np.ndarray, "tx rx subcarrier"], links: Bool[np.ndarray, "tx rx"]
) -> tuple[Complex[np.ndarray, "tx rx subcarrier"], Float64[np.ndarray, "subcarrier"]]:
    """Divides each subcarrier by its RMS amplitude over the links.

    Returns:
        The normalised channel, zero on other links and silent subcarriers, and the scale that gives
        the channel back: `csi[links] == normalised[links] * scale`.
    """
    scale = np.sqrt(np.mean(np.abs(csi[links].astype(np.complex128)) ** 2, axis=0))
    heard = scale > np.sqrt(_SILENT) * max(float(scale.max(initial=0.0)), 1e-150)
    gain = np.divide(1.0, scale, out=np.zeros_like(scale), where=heard)
    return np.where(links[..., None], csi * gain, 0).astype(csi.dtype), scale


def hamming(
    freq_hz: Float[np.ndarray, "subcarrier"], centre_hz: float, width_hz: float
) -> Float64[np.ndarray, "subcarrier"]:
    """Hamming window read at the subcarriers' own frequencies, zero outside of its width.

    Subcarriers next to a gap keep the value of their place in the band, which a window over
    subcarrier numbers would not give them. On a full grid it is `numpy.hamming`.

    Args:
        freq_hz: Subcarriers [Hz], in any order and with any gaps.
        centre_hz: Where the window is one [Hz].
        width_hz: Distance of its two ends, where it is 0.08 [Hz].
    """
    share = (np.asarray(freq_hz, dtype=np.float64) - centre_hz) / width_hz
    inside = np.abs(share) <= 0.5 + 1e-9
    return np.where(inside, 0.54 + 0.46 * np.cos(2.0 * np.pi * share), 0.0)


def bulk_slope(
    csi: Complex[np.ndarray, "*link subcarrier"], freq_hz: Float64[np.ndarray, "subcarrier"]
) -> Float64[np.ndarray, "*link"]:
    """Slope of the phase over frequency [rad/Hz]: −2π times the power-weighted mean delay.

    Only neighbouring subcarriers at the grid's own spacing are compared: across a gap the phase may
    have turned any number of times.
    """
    steps = np.diff(freq_hz)
    spacing_hz = steps.min()
    near = steps < 1.5 * spacing_hz
    turn = csi[..., 1:] * np.conj(csi[..., :-1])
    return np.angle(turn[..., near].sum(axis=-1)) / spacing_hz


def unwrap_phase(
    csi: Complex[np.ndarray, "*link subcarrier"], freq_hz: Float64[np.ndarray, "subcarrier"]
) -> tuple[Float64[np.ndarray, "*link subcarrier"], Float64[np.ndarray, "*link"]]:
    """Continuous phase over the true subcarrier grid, gaps between sub-bands included.

    The slope of the mean delay is taken out first, and the residual is unwrapped. It turns by
    less than half a cycle from subcarrier to subcarrier, gap or not, as long as delays spread by
    less than 1/(2 · gap) around their mean; unwrapping subcarrier by subcarrier fails at a gap of
    1/(2 · delay).

    Args:
        csi: Channel at ascending subcarriers without the hidden ones.
        freq_hz: Their frequencies [Hz], at least two.

    Returns:
        Phase [rad], the same as `numpy.angle` up to whole turns, and its bulk slope [rad/Hz].
    """
    slope = bulk_slope(csi, freq_hz)
    line = slope[..., None] * (freq_hz - freq_hz[0])
    rest = np.unwrap(np.angle(csi * np.exp(-1j * line)), axis=-1)
    return rest + line, slope
