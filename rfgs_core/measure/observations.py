# SPDX-License-Identifier: Apache-2.0
"""What one frame's training may see: the channel less everything that is held out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Bool, Complex, Complex64, Complex128, Float32, Float64, Int64

from rfgs_core.dataset.aperture import whole_layout, whole_packets, whole_static
from rfgs_core.dataset.observed import Observed
from rfgs_core.dataset.splits import HeldOut
from rfgs_core.errors import RfgsError
from rfgs_core.measure.kinds import KINDS, Reported, Visible
from rfgs_core.radio import Layout
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.settings import Observe, Packets, TrainConfig

if TYPE_CHECKING:
    from rfgs_core.dataset import Sequence

#: Links and subcarriers that are left when more is hidden than what is held out.
Kept = tuple[Bool[np.ndarray, "tx rx"], Bool[np.ndarray, "subcarrier"]]


@dataclass(frozen=True)
class Observations:
    """Channel change of one frame on the links and subcarriers that training may use."""

    delta: Complex64[np.ndarray, "tx rx subcarrier"]
    """csi − csi_static where visible, zero elsewhere; of powers per subcarrier the hologram of
    `phase_free`, of powers per delay nothing, else δ of `relative`."""
    static: Complex64[np.ndarray, "tx rx subcarrier"]
    """csi_static where visible, zero elsewhere; without phases its amplitude (of powers per
    delay: that of the direct path) on the phase of the direct path."""
    links: Bool[np.ndarray, "tx rx"]
    """Links that training may use."""
    subcarriers: Bool[np.ndarray, "subcarrier"]
    """Subcarriers that training may use."""
    layout: Layout
    """Antenna elements, and the links that the radio has at all, held out or not."""
    freq_hz: Float64[np.ndarray, "subcarrier"]
    """Subcarrier frequencies [Hz], equally spaced."""
    bounds_m: Float64[np.ndarray, "2 3"]
    """Scene bounds [m]."""
    time_s: float = 0.0
    """When the frame was taken [s]."""
    kind: Observe = "complex"
    """What the radio reports."""
    delay_change: Float32[np.ndarray, "tx rx delay"] | None = None
    """||h(τ)| − |h₀(τ)|| of each visible link, zero elsewhere; only of powers per delay."""
    packets: Complex64[np.ndarray, "packet tx rx subcarrier"] | None = None
    """Change at each packet, estimated from all, zero where hidden; None where one was read."""
    packet_interval_s: float = 0.0
    """Time between packets [s]; zero where one was read."""

    @property
    def changed(self) -> bool:
        """Whether the frame differs from the empty room at all."""
        return bool(self.delta.any() if self.delay_change is None else self.delay_change.any())

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
        return self.layout.pairs_of(self.links)

    def with_delta(self, delta: Complex64[np.ndarray, "tx rx subcarrier"]) -> Observations:
        """The same observations with another channel change, for example a residual."""
        return replace(self, delta=delta.astype(np.complex64), packets=None, packet_interval_s=0.0)

    def lengthened(self, path_m: float) -> Observations:
        """As if waves had travelled so much further to what changed and back [m]; of phases."""
        if path_m == 0.0:
            return self
        turn = excess_turn(self.freq_hz, path_m)
        packets = None if self.packets is None else (self.packets * turn).astype(np.complex64)
        return replace(self, delta=(self.delta * turn).astype(np.complex64), packets=packets)

    def with_entries(self, entries: Complex[np.ndarray, "link subcarrier"]) -> Observations:
        """The same observations with other visible entries of the change, zero where hidden."""
        delta = np.zeros_like(self.delta)
        tx, rx = np.nonzero(self.links)
        delta[tx[:, None], rx[:, None], np.flatnonzero(self.subcarriers)] = entries
        return self.with_delta(delta)


def excess_turn(
    freq_hz: Float64[np.ndarray, "subcarrier"], path_m: float
) -> Complex128[np.ndarray, "subcarrier"]:
    """Factor of modulus one by which a longer path turns every subcarrier, e^{−j2πf Δ/c}."""
    return np.exp(-2j * np.pi * freq_hz * path_m / SPEED_OF_LIGHT)


def packets_to_read(
    asked: Packets | None, sequence: Sequence, radio: str, config: TrainConfig
) -> Packets:
    """Which packets of a frame a run reads; None asks for all where that makes sense.

    Raises:
        RfgsError: All are asked for where there is one, or where their phases are not known.
    """
    spec = sequence.radio_spec(radio)
    if spec.antennas_move:
        why_not = f"{radio} sends one packet from each of its places"
    elif spec.samples_per_frame == 1:
        why_not = (
            f"{sequence.name} holds one packet of {radio} per frame; generate it with "
            "--packets-per-frame"
        )
    elif config.observe != "complex":
        why_not = f"--observe {config.observe} has no phases to follow from packet to packet"
    elif config.calibrate != "none":
        why_not = f"--calibrate {config.calibrate} finds offsets of a frame, not of its packets"
    else:
        return asked or "all"
    if asked == "all":
        raise RfgsError(f"--packets all: {why_not}; leave --packets out")
    return "first"


def visible_channel(
    sequence: Sequence,
    radio: str,
    frame: int,
    channel: Observed,
    packets: Packets = "first",
    *,
    everything: bool = False,
) -> tuple[Layout, Bool[np.ndarray, "tx rx"], Bool[np.ndarray, "subcarrier"], np.ndarray]:
    """Elements, visible links and subcarriers, and the channels of a frame with everything in them.

    Returns:
        The channels are (packet, tx, rx, subcarrier), NaN where a packet was lost; links that
        lost all of them are not visible.

    Raises:
        RfgsError: What is visible is not finite, or the antennas' places are not the radio's.
    """
    data = sequence.coordinates(radio)
    elements = whole_layout(sequence, radio)
    if not sequence.radio_spec(radio).antennas_move:
        if data["tx_xyz"].ndim != 2 or data["rx_xyz"].ndim != 2:
            raise RfgsError(
                f"{sequence.name}, {radio}: the antennas move within a frame, but the radio in "
                "sequence.json does not say so (antennas_move); make the dataset again"
            )
        # The links that exist are those the channels were stored with.
        elements = replace(elements, measured=data["measured"].values.copy())
    hidden = _nothing_hidden(sequence.held_out(radio)) if everything else sequence.held_out(radio)
    split = HeldOut.of(hidden, elements, data.sizes["subcarrier"])
    links, subcarriers = split.links, split.subcarriers
    count = 1 if packets == "first" else None
    csi = whole_packets(sequence, radio, frame, channel, count)
    received = np.broadcast_to(links, csi.shape[:3])
    if channel == "impaired":
        received = received & ~np.isnan(csi).all(axis=3)
    _need_finite(csi, received, subcarriers, f"csi of frame {frame} ({sequence.name}, {radio})")
    return elements, received.any(axis=0), subcarriers, csi


def _nothing_hidden(split: Mapping[str, Any]) -> dict[str, Any]:
    """A split that holds out nothing; what a real radio did not report stays unknown."""
    nothing = dict.fromkeys(("rx_elements", "subcarriers", "device_pairs"), ())
    return {**split, **nothing}


def _need_finite(csi: np.ndarray, links: np.ndarray, subcarriers: np.ndarray, what: str) -> None:
    if not np.isfinite(csi[links[..., None] & subcarriers]).all():
        raise RfgsError(f"{what} holds NaN or infinity; run `rfgs-factory validate` on the dataset")


def observe(
    sequence: Sequence,
    radio: str,
    frame: int,
    channel: Observed = "clean",
    kind: Observe = "complex",
    empty: Reported | None = None,
    packets: Packets = "first",
    kept: Kept | None = None,
    *,
    everything: bool = False,
) -> Observations:
    """Reads one frame at its own time and hides what is held out, and links that heard nothing.

    Args:
        sequence: The data.
        radio: Which radio.
        frame: Which frame.
        channel: The traced channel, or what imperfect radios make of it.
        kind: What the radio reports of it; nothing else reaches the result.
        empty: What it reports of the empty room; None takes the empty-room capture.
        packets: Whether the frame's other packets help to tell the change from noise; only of
            the channel itself.
        kept: Hides all other links and subcarriers as well, before anything is made of the channel.
        everything: Hides nothing: for poses and geometry, whose truth is no channel.

    Raises:
        RfgsError: The channel holds values that are not finite, or `empty` is another radio's.
    """
    elements, links, subcarriers, csi = visible_channel(
        sequence, radio, frame, channel, packets, everything=everything
    )
    if kept is not None:
        links, subcarriers = links & kept[0], subcarriers & kept[1]
    freq_hz = np.array(sequence.coordinates(radio)["freq_hz"].values, dtype=np.float64)
    seen = Visible(links, subcarriers, elements, freq_hz)
    if empty is None:
        static = whole_static(sequence, radio)
        _need_finite(
            static, links, subcarriers, f"csi_static of frame {frame} ({sequence.name}, {radio})"
        )
        empty = KINDS[kind].report(static, seen)
    elif empty.shape != (own := KINDS[kind].report(csi[0], seen).shape):
        raise RfgsError(
            f"the background of {sequence.name}, {radio}: expected shape {own}, as each packet "
            f"has, got {empty.shape}; train again into a new folder"
        )
    change, interval_s = KINDS[kind].change(csi, empty, seen), 0.0
    if change.packets is not None:
        interval_s = float(np.diff(sequence.sample_times_s(radio, frame)[:2])[0])
    return Observations(
        delta=np.where(seen.entries, change.delta, 0).astype(np.complex64),
        static=np.where(seen.entries, change.static, 0).astype(np.complex64),
        links=links,
        subcarriers=subcarriers,
        layout=elements,
        freq_hz=freq_hz,
        bounds_m=np.asarray(sequence.bounds_m, dtype=np.float64),
        time_s=sequence.time_s(frame),
        kind=kind,
        delay_change=change.delay_change,
        packets=change.packets,
        packet_interval_s=interval_s,
    )
