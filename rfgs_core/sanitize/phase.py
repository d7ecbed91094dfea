# SPDX-License-Identifier: Apache-2.0
"""Phases that the standard, the receiver's timing and its oscillator put on a channel."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Complex, Float, Int

from rfgs_core.sanitize.gaps import phase_step


def undo_rotations(
    values: Complex[np.ndarray, "*link bin"],
    index: Int[np.ndarray, "bin"],
    form: str,
    bandwidth_mhz: int,
) -> Complex[np.ndarray, "*link bin"]:
    """Takes back the rotations that wide packets carry.

    HT: subcarriers from 0 up of 40 MHz are turned by +90° (IEEE 802.11-2020, 19.3.9.3.4,
    equation 19-15). VHT of 80 MHz: those from −64 up are negated (21.3.7.5, equation 21-16),
    of 160 MHz both halves alike, counted from their own middle. 20 MHz is not turned, and HE
    rotates only its legacy part. Source of the trap: nexmon_csi issue 117.

    Args:
        values: Channels.
        index: Number of each subcarrier.
        form: Packet format: non-HT, HT, VHT or HE.
        bandwidth_mhz: Width [MHz].
    """
    return values * np.conj(rotations(index, form, bandwidth_mhz)).astype(values.dtype)


def rotations(
    index: Int[np.ndarray, "bin"], form: str, bandwidth_mhz: int
) -> Complex[np.ndarray, "bin"]:
    """Factor that the standard puts on each subcarrier."""
    turned = np.ones(len(index), np.complex128)
    if form not in ("HT", "VHT", "non-HT"):
        return turned
    if bandwidth_mhz == 40:
        turned[index >= 0] = 1j
    elif bandwidth_mhz == 80:
        turned[index >= -64] = -1.0
    elif bandwidth_mhz == 160:
        turned[np.where(index < 0, index + 128, index - 128) >= -64] = -1.0
    return turned


def unwrap(
    values: Complex[np.ndarray, "*link bin"], index: Int[np.ndarray, "bin"]
) -> tuple[Float[np.ndarray, "*link bin"], Bool[np.ndarray, "*link bin"]]:
    """Phases without jumps of 2π along subcarriers, against their true numbers.

    The mean step per index is taken out before unwrapping and put back after it, so that holes in
    the grid, over which phases turn further, are no jumps.

    Returns:
        Phases [rad], and where they cannot be trusted: after a step of over 2π/3 that is left.
    """
    step = phase_step(values, index)[..., None]
    still = np.unwrap(np.angle(values * np.exp(-1j * step * index)), axis=-1)
    doubtful = np.zeros(values.shape, bool)
    doubtful[..., 1:] = np.abs(np.diff(still, axis=-1)) > 2.0 * np.pi / 3.0
    return still + step * index, np.logical_or.accumulate(doubtful, axis=-1)


def remove_linear_phase(
    values: Complex[np.ndarray, "time *link bin"],
    index: Int[np.ndarray, "bin"],
    valid: Bool[np.ndarray, "bin"] | None = None,
    *,
    offset: bool = True,
) -> Complex[np.ndarray, "time *link bin"]:
    """Removes timing offset and common phase of each packet, one slope for all its antennas.

    SpotFi, algorithm 1 (Kotaru et al. 2015): minimises Σ (ψ_a(k) − s k − b)² over slope s and
    offset b of all antennas a and true subcarrier numbers k at once, then takes s k (and b) off.
    A slope of each antenna's own would take the angle of arrival with it. Here the two are fitted
    without unwrapping: s maximises |Σ_a Σ_k H̄_a(k) H_a(k + n) e^{−jsn}| and is refined by the
    phases that are left, so that a fade on one antenna cannot shift the others.

    Args:
        values: Channels of packets.
        index: True number of each subcarrier.
        valid: Subcarriers to fit to; all if None.
        offset: Also take the common phase off, that of Σ_k H of the link where it is largest.

    Returns:
        Channels; the relative phases of antennas are untouched.
    """
    use = np.ones(len(index), bool) if valid is None else valid
    rows = values.reshape(len(values), -1, values.shape[-1])[..., use]
    known = index[use]
    slope = phase_step(rows, known, shared=True)
    for _ in range(2):
        slope = slope + _left_slope(rows * np.exp(-1j * slope[:, None, None] * known), known)
    turn = np.exp(-1j * slope[:, None] * index)
    if offset:
        still = rows * np.exp(-1j * slope[:, None, None] * known)
        # One link tells the phase of all: sums over antennas cancel where these point apart.
        combined = still.sum(axis=2)
        clearest = int(np.abs(combined).mean(axis=0).argmax())
        turn = turn * np.exp(-1j * np.angle(combined[:, clearest]))[:, None]
    shaped = turn.reshape(len(values), *[1] * (values.ndim - 2), -1)
    return (values * shaped).astype(values.dtype)


def undo_quarter_turns(
    values: Complex[np.ndarray, "time rx *any"], memory: float = 0.9
) -> tuple[Complex[np.ndarray, "time rx *any"], Int[np.ndarray, "time rx"]]:
    """Takes back multiples of 90° by which antennas turn against each other from packet to packet.

    At 2.4 GHz each RX chain of an Intel 5300 locks at one of four phases per packet
    (dhalperi/linux-80211n-csitool-supplementary, issue 6). With p = H_a H̄_0 and m its running mean,
    n = round(arg Σ p m̄ / 90°) and H_a ← H_a e^{−j90°n}: what changes slowly stays. Antennas
    whose phases hold anyway are not turned.

    Args:
        values: Channels of packets, in the order of time.
        memory: Weight of the past in the running mean.

    Returns:
        Channels, and the number of quarter turns taken back, 0 to 3.
    """
    rows = values.reshape(*values.shape[:2], -1)
    products = rows * np.conj(rows[:, :1])
    turns = np.zeros(values.shape[:2], np.int64)
    mean = products[0].astype(np.complex128)
    for time in range(1, len(values)):
        against = (products[time] * np.conj(mean)).sum(axis=-1)
        turns[time] = np.rint(np.angle(against) / (0.5 * np.pi)).astype(np.int64) % 4
        turned = products[time] * (-1j) ** turns[time][:, None]
        mean = memory * mean + (1.0 - memory) * turned
    factor = ((-1j) ** turns).reshape(*turns.shape, *[1] * (values.ndim - 2))
    return (values * factor).astype(values.dtype), turns


def _left_slope(
    rows: Complex[np.ndarray, "time link bin"], index: Int[np.ndarray, "bin"]
) -> Float[np.ndarray, "time"]:
    """Slope that is left [rad per index]: least squares on phases towards each antenna's mean."""
    reference = rows.sum(axis=-1, keepdims=True)
    phase = np.angle(rows * np.conj(reference))
    weight = np.abs(rows) ** 2
    total = np.maximum(weight.sum(axis=-1, keepdims=True), 1e-300)
    centred = index - (weight * index).sum(axis=-1, keepdims=True) / total
    spread = np.maximum((weight * centred**2).sum(axis=(1, 2)), 1e-300)
    return (weight * centred * phase).sum(axis=(1, 2)) / spread
