# SPDX-License-Identifier: Apache-2.0
"""What one frame's training may see: the channel less everything that is held out."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Bool, Complex64, Float64, Int64

from rfgs_core.encode.matched_filter import device_pairs
from rfgs_core.errors import RfgsError


@dataclass(frozen=True)
class Observations:
    """Channel change of one frame on the links and tones that training may use."""

    delta: Complex64[np.ndarray, "tx rx subcarrier"]
    """csi − csi_static where visible, zero elsewhere."""
    static: Complex64[np.ndarray, "tx rx subcarrier"]
    """csi_static where visible, zero elsewhere."""
    links: Bool[np.ndarray, "tx rx"]
    """Links that training may use."""
    tones: Bool[np.ndarray, "subcarrier"]
    """Tones that training may use."""
    measured: Bool[np.ndarray, "tx rx"]
    """Links that the radio has at all, held out or not."""
    tx_xyz: Float64[np.ndarray, "tx 3"]
    """Transmitting elements [m]."""
    rx_xyz: Float64[np.ndarray, "rx 3"]
    """Receiving elements [m]."""
    tx_device: Int64[np.ndarray, "tx"]
    """Device of each transmitting element."""
    rx_device: Int64[np.ndarray, "rx"]
    """Device of each receiving element."""
    freq_hz: Float64[np.ndarray, "subcarrier"]
    """Tone frequencies [Hz], equally spaced."""
    bounds_m: Float64[np.ndarray, "2 3"]
    """Scene bounds [m]."""

    @property
    def centre_hz(self) -> float:
        """Centre of the band [Hz]."""
        return float(self.freq_hz.mean())

    @property
    def monostatic(self) -> bool:
        """Whether every visible link stays within one device (a radar)."""
        tx, rx = np.nonzero(self.links)
        return bool((self.tx_device[tx] == self.rx_device[rx]).all())

    @property
    def pairs(self) -> tuple[Int64[np.ndarray, "tx rx"], list[tuple[int, int]]]:
        """Device pair of each visible link (−1 elsewhere) and the list of pairs."""
        return device_pairs(self.tx_device, self.rx_device, self.links)

    def with_delta(self, delta: Complex64[np.ndarray, "tx rx subcarrier"]) -> Observations:
        """The same observations with another channel change, for example a residual."""
        return replace(self, delta=delta.astype(np.complex64))


def visible_links(sequence: Any, radio: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Masks of what training may see.

    Args:
        sequence: A `rfgs_core.dataset.Sequence`.
        radio: Name of the radio.

    Returns:
        Visible links (tx, rx), visible tones (subcarrier), measured links (tx, rx).
    """
    data = sequence.radio(radio)
    split = sequence.splits["rf"][radio]
    measured = np.asarray(data["measured"].values, dtype=bool)
    links = measured.copy()
    links[:, split["rx_elements"]] = False
    tx_device, rx_device = data["tx_device"].values, data["rx_device"].values
    for a, b in split["device_pairs"]:
        for first, second in ((a, b), (b, a)):
            links[(tx_device[:, None] == first) & (rx_device[None, :] == second)] = False
    tones = np.ones(data.sizes["subcarrier"], dtype=bool)
    tones[split["subcarriers"]] = False
    return links, tones, measured


def observe(sequence: Any, radio: str, frame: int) -> Observations:
    """Reads one frame at its own time and hides what is held out.

    Raises:
        RfgsError: The channel holds values that are not finite, or its antennas move within a
            frame.
    """
    data = sequence.radio(radio)
    if data["tx_xyz"].ndim != 2 or data["rx_xyz"].ndim != 2:
        raise RfgsError(
            f"{sequence.name}, {radio}: the antennas move within a frame, and training takes one "
            "sample per frame; choose a radio whose antennas stand still"
        )
    links, tones, measured = visible_links(sequence, radio)
    csi, static = sequence.csi(radio, frame), sequence.csi_static(radio)
    seen = links[:, :, None] & tones
    for name, values in (("csi", csi), ("csi_static", static)):
        if not np.isfinite(values[seen]).all():
            raise RfgsError(
                f"{name} of frame {frame} ({sequence.name}, {radio}) holds NaN or infinity; "
                "run `rfgs-factory validate` on the dataset"
            )
    return Observations(
        delta=np.where(seen, csi - static, 0).astype(np.complex64),
        static=np.where(seen, static, 0).astype(np.complex64),
        links=links,
        tones=tones,
        measured=measured,
        tx_xyz=np.asarray(data["tx_xyz"].values, dtype=np.float64),
        rx_xyz=np.asarray(data["rx_xyz"].values, dtype=np.float64),
        tx_device=np.asarray(data["tx_device"].values, dtype=np.int64),
        rx_device=np.asarray(data["rx_device"].values, dtype=np.int64),
        freq_hz=np.asarray(data["freq_hz"].values, dtype=np.float64),
        bounds_m=np.asarray(sequence.bounds_m, dtype=np.float64),
    )
