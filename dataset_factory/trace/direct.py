# SPDX-License-Identifier: Apache-2.0
"""What everything that moves scatters straight from transmitter to receiver."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from dataset_factory.trace.facets import facet_sum
from dataset_factory.trace.points import LIFT_M
from dataset_factory.trace.scene import centres, visible
from rfgs_core.radio import Layout
from rfgs_core.radio.layout import DevicePose, rotation


@dataclass(frozen=True)
class PosedPoints:
    """Scattering points of one frame."""

    positions: np.ndarray
    """On the skin [m], shape (point, 3)."""
    normals: np.ndarray
    """Unit outward normals, shape (point, 3)."""
    areas: np.ndarray
    """Area of each facet [m²], shape (point,)."""
    material: np.ndarray
    """Material index of each point, shape (point,)."""

    @property
    def lifted(self) -> np.ndarray:
        """Positions a millimetre outside the skin [m], from where shadows are tested."""
        return self.positions + LIFT_M * self.normals


def direct_channel(
    mi_scene: Any,
    points: PosedPoints,
    layout: Layout,
    devices: list[DevicePose],
    gamma: dict[int, np.ndarray],
    freq_hz: np.ndarray,
) -> np.ndarray:
    """Single-bounce channel of the moving points, for every measured link.

    Visibility is Sionna's own ray test from each point to the centre of each array, in the
    scene with the body in it; distances and facets are exact per element and tone.

    Args:
        mi_scene: Mitsuba scene with everything that moves in place.
        points: Scattering points.
        layout: Antenna elements.
        devices: Poses of the devices, for polarisation.
        gamma: Reflection coefficient by material index, each of shape (subcarrier,).
        freq_hz: Tones [Hz].

    Returns:
        Complex128, shape (tx, rx, subcarrier), zero where a link is not measured.
    """
    lifted = points.lifted
    tx_centres, rx_centres = centres(layout)
    sees_tx = [visible(mi_scene, lifted, centre) for centre in tx_centres]
    sees_rx = [visible(mi_scene, lifted, centre) for centre in rx_centres]
    out = np.zeros((len(layout.tx_xyz), len(layout.rx_xyz), len(freq_hz)), dtype=np.complex128)
    for a, b in layout.device_pairs:
        both = sees_tx[a] & sees_rx[b]
        factor = copolar(
            lifted - tx_centres[a],
            rx_centres[b] - lifted,
            rotation(devices[a].quat_wxyz),
            rotation(devices[b].quat_wxyz),
        )
        tx, rx = np.flatnonzero(layout.tx_device == a), np.flatnonzero(layout.rx_device == b)
        for material, coefficient in gamma.items():
            weights = np.where(both & (points.material == material), factor, 0.0)
            part = facet_sum(
                lifted,
                points.normals,
                points.areas,
                layout.tx_xyz[tx],
                layout.rx_xyz[rx],
                weights,
                freq_hz,
            )
            out[np.ix_(tx, rx)] += part * coefficient
    return out


def copolar(
    into: np.ndarray, out_of: np.ndarray, tx_axes: np.ndarray, rx_axes: np.ndarray
) -> np.ndarray:
    """Share of the field that vertical antennas pass by way of points that keep polarisation.

    A point hands the θ and φ components of the field on unchanged, as Sionna's scattering
    points do; it is 1 for devices that stand upright.

    Args:
        into: Vectors from the transmitter to the points, shape (point, 3).
        out_of: Vectors from the points to the receiver, shape (point, 3).
        tx_axes: Rotation world_from_device of the transmitter.
        rx_axes: Rotation world_from_device of the receiver.

    Returns:
        Factor in [-1, 1], shape (point,).
    """
    theta_i, phi_i = spherical_basis(into)
    theta_s, phi_s = spherical_basis(out_of)
    sent = spherical_basis(into @ tx_axes)[0] @ tx_axes.T
    heard = spherical_basis(-out_of @ rx_axes)[0] @ rx_axes.T
    along = np.sum(sent * theta_i, axis=1) * np.sum(heard * theta_s, axis=1)
    return along + np.sum(sent * phi_i, axis=1) * np.sum(heard * phi_s, axis=1)


def spherical_basis(directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors θ̂ and φ̂ of directions of any length, each of shape (point, 3)."""
    x, y, z = directions.T
    length = np.maximum(np.linalg.norm(directions, axis=1), 1e-12)
    azimuth = np.arctan2(y, x)
    cos_theta = np.clip(z / length, -1.0, 1.0)
    sin_theta = np.sqrt(1.0 - cos_theta**2)
    theta = np.stack([cos_theta * np.cos(azimuth), cos_theta * np.sin(azimuth), -sin_theta], axis=1)
    phi = np.stack([-np.sin(azimuth), np.cos(azimuth), np.zeros_like(azimuth)], axis=1)
    return theta, phi
