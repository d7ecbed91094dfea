# SPDX-License-Identifier: Apache-2.0
"""The paths behind a channel, one row each, and the channel that they add up to."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Complex64, Complex128, Float32, Float64, Int32, UInt8

from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.images import directions, images
from rfgs_core.radio.layout import Layout

#: Values that are computed at once: 64 MB.
_AT_ONCE = 4_000_000


@dataclass(frozen=True)
class PathTable:
    """Paths between centres of sites, sorted by pair and delay.

    A site is what shares its rays: the array of a device, or an element of its own where
    elements are more than a wavelength apart (`Layout.tx_site`). Angles are those of world axes:
    zenith from +Z, azimuth from +X towards +Y.

    H(f) = Σ_p a_p(f) e^{−j2πfτ_p}, a_p linear between `node_hz`.
    """

    tx_site: Int32[np.ndarray, "path"]
    """Transmitting site."""
    rx_site: Int32[np.ndarray, "path"]
    """Receiving site."""
    tx_device: Int32[np.ndarray, "path"]
    """Device of the transmitting site."""
    rx_device: Int32[np.ndarray, "path"]
    """Device of the receiving site."""
    amplitude: Complex64[np.ndarray, "path port node"]
    """Amplitude without the phase of the delay; pairs of ports, the transmitter's first."""
    node_hz: Float64[np.ndarray, "node"]
    """Frequencies of the amplitudes [Hz], ascending; the middle one is the band's centre."""
    delay_s: Float64[np.ndarray, "path"]
    """Time of flight [s]."""
    doppler_hz: Float32[np.ndarray, "path"]
    """Doppler shift at the band's centre [Hz], positive where the path becomes shorter."""
    departure_zenith_rad: Float32[np.ndarray, "path"]
    """Direction in which the path leaves [rad], 0 to π."""
    departure_azimuth_rad: Float32[np.ndarray, "path"]
    """Direction in which the path leaves [rad], −π to π."""
    arrival_zenith_rad: Float32[np.ndarray, "path"]
    """Direction from which the path comes [rad], 0 to π."""
    arrival_azimuth_rad: Float32[np.ndarray, "path"]
    """Direction from which the path comes [rad], −π to π."""
    kind: UInt8[np.ndarray, "path bounce"]
    """What happens at each corner, codes of `rfgs_core.radio.images`; 0 beyond the last."""
    object: Int32[np.ndarray, "path bounce"]
    """What is met at each corner, `id` of `objects`; 0 beyond the last."""
    vertices: Float32[np.ndarray, "path corner 3"]
    """Corners from transmitter to receiver [m], padded with the receiver."""

    def __len__(self) -> int:
        return len(self.tx_site)

    @property
    def length_m(self) -> Float64[np.ndarray, "path"]:
        """Length of each path [m], from its delay."""
        return self.delay_s * SPEED_OF_LIGHT

    def select(self, keep: np.ndarray) -> PathTable:
        """The paths of a mask or of indices, in that order."""
        columns = {spec.name: getattr(self, spec.name) for spec in fields(self)}
        node_hz = columns.pop("node_hz")
        return PathTable(**{name: value[keep] for name, value in columns.items()}, node_hz=node_hz)

    def amplitude_at(
        self, freq_hz: Float64[np.ndarray, "subcarrier"]
    ) -> Complex128[np.ndarray, "path port subcarrier"]:
        """Amplitudes at frequencies within the band, without the phase of the delay."""
        if len(self.node_hz) == 1:
            return np.repeat(self.amplitude.astype(np.complex128), len(freq_hz), axis=2)
        left = np.searchsorted(self.node_hz, freq_hz, side="right") - 1
        left = np.clip(left, 0, len(self.node_hz) - 2)
        share = (freq_hz - self.node_hz[left]) / (self.node_hz[left + 1] - self.node_hz[left])
        return self.amplitude[:, :, left] * (1.0 - share) + self.amplitude[:, :, left + 1] * share

    def channel(
        self, layout: Layout, freq_hz: Float64[np.ndarray, "subcarrier"]
    ) -> Complex128[np.ndarray, "tx rx subcarrier"]:
        """Channel that the paths add up to, for every measured link.

        Elements are reached from the centre of their site: a path's own mirror images give
        exact distances (plane walls), and its amplitude goes with 1/distance. Directions of
        antenna patterns and shadows are those of the centre.

        Args:
            layout: Antenna elements.
            freq_hz: Subcarriers within the band [Hz].
        """
        return self._summed(
            layout, freq_hz, np.arange(len(layout.tx_site)), np.arange(len(layout.rx_site))
        )

    def link(
        self, layout: Layout, tx: int, rx: int, freq_hz: Float64[np.ndarray, "subcarrier"]
    ) -> Complex128[np.ndarray, "subcarrier"]:
        """Channel between two elements, as `channel` gives it; zero if not measured."""
        return self._summed(layout, freq_hz, np.array([tx]), np.array([rx]))[0, 0]

    def _summed(
        self, layout: Layout, freq_hz: np.ndarray, chosen_tx: np.ndarray, chosen_rx: np.ndarray
    ) -> np.ndarray:
        """Channel between some elements, shape (tx, rx, subcarrier)."""
        out = np.zeros((len(chosen_tx), len(chosen_rx), len(freq_hz)), dtype=np.complex128)
        tx_ports, rx_ports = np.unique(layout.tx_port), np.unique(layout.rx_port)
        for a, b in np.unique(np.stack([self.tx_site, self.rx_site], axis=1), axis=0):
            of_tx = np.flatnonzero(layout.tx_site[chosen_tx] == a)
            of_rx = np.flatnonzero(layout.rx_site[chosen_rx] == b)
            if not len(of_tx) or not len(of_rx):
                continue
            rows = self.select((self.tx_site == a) & (self.rx_site == b))
            centres = layout.tx_xyz[layout.tx_site == a], layout.rx_xyz[layout.rx_site == b]
            tx_offset, rx_offset = (
                xyz[chosen] - centre.mean(axis=0)
                for xyz, chosen, centre in (
                    (layout.tx_xyz, chosen_tx[of_tx], centres[0]),
                    (layout.rx_xyz, chosen_rx[of_rx], centres[1]),
                )
            )
            tx_port = np.searchsorted(tx_ports, layout.tx_port[chosen_tx[of_tx]])
            rx_port = np.searchsorted(rx_ports, layout.rx_port[chosen_rx[of_rx]])
            port = tx_port[:, None] * len(rx_ports) + rx_port
            out[np.ix_(of_tx, of_rx)] = rows._of_pair(tx_offset, rx_offset, port, freq_hz)
        out[~layout.measured[np.ix_(chosen_tx, chosen_rx)]] = 0.0
        return out

    def _of_pair(
        self, tx_offset: np.ndarray, rx_offset: np.ndarray, port: np.ndarray, freq_hz: np.ndarray
    ) -> np.ndarray:
        """Channel between elements of one pair of sites, given their offsets from the centres.

        Args:
            tx_offset: Transmitting elements [m], shape (tx, 3).
            rx_offset: Receiving elements [m], shape (rx, 3).
            port: Pair of ports of each link, shape (tx, rx).
            freq_hz: Subcarriers [Hz].
        """
        extra_m, scale = self._elements(tx_offset, rx_offset)
        turn = -2j * np.pi * freq_hz
        out = np.zeros((*port.shape, len(freq_hz)), dtype=np.complex128)
        rows = max(1, _AT_ONCE // max(out.size, 1))
        for first in range(0, len(self), rows):
            part = slice(first, first + rows)
            delay_s = self.delay_s[part, None, None] + extra_m[part] / SPEED_OF_LIGHT
            phasor = scale[part, ..., None] * np.exp(turn * delay_s[..., None])
            amplitude = self.select(np.arange(len(self))[part]).amplitude_at(freq_hz)
            out += np.einsum("ptrf,ptrf->trf", amplitude[:, port], phasor)
        return out

    def _elements(
        self, tx_offset: np.ndarray, rx_offset: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """How much longer each path is between two elements [m], and its relative amplitude.

        Returns:
            Two arrays of shape (path, tx, rx).
        """
        vertices = self.vertices.astype(np.float64)
        seen = images(vertices, self.kind.astype(np.int64))
        from_tx = seen.seen_from_tx - vertices[:, 0]
        from_rx = seen.seen_from_rx - vertices[:, -1]
        at_tx, at_rx = np.linalg.norm(from_tx, axis=1), np.linalg.norm(from_rx, axis=1)
        image_offset = np.einsum("pij,tj->pti", seen.mirror, tx_offset)
        way = rx_offset[None, None] - image_offset[:, :, None] - from_rx[:, None, None]
        whole = np.linalg.norm(way, axis=-1)
        leg_tx = np.linalg.norm(tx_offset[None] - from_tx[:, None], axis=-1)[:, :, None]
        leg_rx = np.linalg.norm(rx_offset[None] - from_rx[:, None], axis=-1)[:, None, :]
        one_sided = seen.one_sided[:, None, None]
        at_tx, at_rx = at_tx[:, None, None], at_rx[:, None, None]
        extra_m = np.where(one_sided, whole - at_rx, leg_tx - at_tx + leg_rx - at_rx)
        with np.errstate(divide="ignore", invalid="ignore"):
            scale = np.where(one_sided, at_rx / whole, at_tx / leg_tx * (at_rx / leg_rx))
        return extra_m, scale


def angles_rad(vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Zenith angle from +Z and azimuth from +X towards +Y [rad] of vectors, shape (path, 3)."""
    across = np.hypot(vectors[:, 0], vectors[:, 1])
    return np.arctan2(across, vectors[:, 2]), np.arctan2(vectors[:, 1], vectors[:, 0])


def ends_rad(vertices: np.ndarray, kind: np.ndarray) -> dict[str, np.ndarray]:
    """The angles at both ends of paths by their names in `PathTable`.

    Args:
        vertices: Corners [m], shape (path, corner, 3).
        kind: What happens at each inner corner, shape (path, bounce).
    """
    k = directions(vertices)
    leaves, comes = k[:, 0], -k[np.arange(len(k)), (kind != 0).sum(axis=1)]
    found = {}
    for name, vectors in (("departure", leaves), ("arrival", comes)):
        zenith, azimuth = angles_rad(vectors)
        found[f"{name}_zenith_rad"] = zenith.astype(np.float32)
        found[f"{name}_azimuth_rad"] = azimuth.astype(np.float32)
    return found
