# SPDX-License-Identifier: Apache-2.0
"""What one frame's training may see: the channel less everything that is held out."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Bool, Complex64, Float64, Int64

from rfgs_core.dataset.observed import Observed, observed_csi
from rfgs_core.encode.matched_filter import device_pairs
from rfgs_core.errors import RfgsError
from rfgs_core.radio import Layout

if TYPE_CHECKING:
    from rfgs_core.dataset import Sequence


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
    layout: Layout
    """Antenna elements, and the links that the radio has at all, held out or not."""
    freq_hz: Float64[np.ndarray, "subcarrier"]
    """Tone frequencies [Hz], equally spaced."""
    bounds_m: Float64[np.ndarray, "2 3"]
    """Scene bounds [m]."""
    time_s: float = 0.0
    """When the frame was taken [s]."""

    @property
    def centre_hz(self) -> float:
        """Centre of the band [Hz]."""
        return float(self.freq_hz.mean())

    @property
    def monostatic(self) -> bool:
        """Whether every visible link stays within one device (a radar)."""
        tx, rx = np.nonzero(self.links)
        return bool((self.layout.tx_device[tx] == self.layout.rx_device[rx]).all())

    @property
    def pairs(self) -> tuple[Int64[np.ndarray, "tx rx"], list[tuple[int, int]]]:
        """Device pair of each visible link (−1 elsewhere) and the list of pairs."""
        return device_pairs(self.layout.tx_device, self.layout.rx_device, self.links)

    def with_delta(self, delta: Complex64[np.ndarray, "tx rx subcarrier"]) -> Observations:
        """The same observations with another channel change, for example a residual."""
        return replace(self, delta=delta.astype(np.complex64))


def _visible(
    split: dict[str, Any], elements: Layout, num_subcarriers: int
) -> tuple[Bool[np.ndarray, "tx rx"], Bool[np.ndarray, "subcarrier"]]:
    """Links and tones that training may see."""
    links = elements.measured.copy()
    links[:, split["rx_elements"]] = False
    for a, b in split["device_pairs"]:
        for first, second in ((a, b), (b, a)):
            links[(elements.tx_device[:, None] == first) & (elements.rx_device == second)] = False
    tones = np.ones(num_subcarriers, dtype=bool)
    tones[split["subcarriers"]] = False
    return links, tones


def need_still_antennas(sequence: Sequence, radio: str) -> None:
    """Refuses radios that training cannot use.

    Raises:
        RfgsError: The radio's antennas move within a frame.
    """
    data = sequence.radio(radio)
    if data["tx_xyz"].ndim != 2 or data["rx_xyz"].ndim != 2:
        raise RfgsError(
            f"{sequence.name}, {radio}: the antennas move within a frame, and training takes one "
            "sample per frame; choose a radio whose antennas stand still"
        )


def observe(
    sequence: Sequence, radio: str, frame: int, channel: Observed = "clean"
) -> Observations:
    """Reads one frame at its own time and hides what is held out, and links that lost a packet.

    Raises:
        RfgsError: The channel holds values that are not finite, or its antennas move within a
            frame.
    """
    need_still_antennas(sequence, radio)
    data = sequence.radio(radio)
    # The links that exist are those the channels were stored with.
    elements = replace(sequence.layout(radio), measured=data["measured"].values)
    links, tones = _visible(sequence.splits["rf"][radio], elements, data.sizes["subcarrier"])
    csi, static = observed_csi(sequence, radio, frame, channel), sequence.csi_static(radio)
    if channel == "impaired":
        links &= ~np.isnan(csi).all(axis=2)
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
        layout=elements,
        freq_hz=np.asarray(data["freq_hz"].values, dtype=np.float64),
        bounds_m=np.asarray(sequence.bounds_m, dtype=np.float64),
        time_s=sequence.time_s(frame),
    )
