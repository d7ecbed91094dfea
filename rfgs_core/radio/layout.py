# SPDX-License-Identifier: Apache-2.0
"""Where every antenna element of a scene's devices is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, Int64

from rfgs_core.radio.presets import Radio
from rfgs_core.rotations import rotation_rows


@dataclass(frozen=True)
class DevicePose:
    """Position and orientation of one device; local +X is its boresight, local +Z its up."""

    name: str
    """Unique name within a radio."""
    position_m: tuple[float, float, float]
    """Centre of the RX array [m]."""
    quat_wxyz: tuple[float, float, float, float]
    """Rotation world_from_device, unit quaternion, w first."""


@dataclass(frozen=True)
class Layout:
    """Antenna elements of all devices, flattened device by device, port by port."""

    tx_xyz: Float64[np.ndarray, "tx 3"]
    """Positions of transmitting elements [m]."""
    rx_xyz: Float64[np.ndarray, "rx 3"]
    """Positions of receiving elements [m]."""
    tx_device: Int64[np.ndarray, "tx"]
    """Device index of each transmitting element."""
    rx_device: Int64[np.ndarray, "rx"]
    """Device index of each receiving element."""
    rx_column: Int64[np.ndarray, "rx"]
    """Column of each receiving element within its own array."""
    measured: Bool[np.ndarray, "tx rx"]
    """Links that the radio measures."""
    tx_port: Int64[np.ndarray, "tx"]
    """Polarisation port of each transmitting element; ports of one element share its place."""
    rx_port: Int64[np.ndarray, "rx"]
    """Polarisation port of each receiving element."""
    tx_site: Int64[np.ndarray, "tx"]
    """Group of each transmitting element; elements of a group are near enough to share rays."""
    rx_site: Int64[np.ndarray, "rx"]
    """Group of each receiving element."""
    tx_quat_wxyz: Float64[np.ndarray, "tx 4"]
    """Rotation world_from_antenna of each transmitting element, w first."""
    rx_quat_wxyz: Float64[np.ndarray, "rx 4"]
    """Rotation world_from_antenna of each receiving element, w first."""

    @property
    def device_pairs(self) -> list[tuple[int, int]]:
        """Measured (transmitting, receiving) pairs of devices, ascending."""
        tx, rx = np.nonzero(self.measured)
        pairs = np.unique(np.stack([self.tx_device[tx], self.rx_device[rx]], axis=1), axis=0)
        return [(int(a), int(b)) for a, b in pairs]


def rotation(quat_wxyz: tuple[float, float, float, float]) -> Float64[np.ndarray, "3 3"]:
    """Rotation matrix of a quaternion, w first; the quaternion is normalised first."""
    return np.array(rotation_rows(*np.asarray(quat_wxyz) / np.linalg.norm(quat_wxyz)))


def element_offsets(
    rows: int, cols: int, spacing_m: float
) -> tuple[Float64[np.ndarray, "element 3"], Int64[np.ndarray, "element"]]:
    """Element positions of a planar array in its device's axes.

    Elements lie in the local y-z plane, column by column, starting at (-y, +z), which is
    also Sionna's order.

    Returns:
        Offsets [m], shape (rows * cols, 3), and the column of each element.
    """
    column, row = np.divmod(np.arange(rows * cols), rows)
    y = (column - 0.5 * (cols - 1)) * spacing_m
    z = -(row - 0.5 * (rows - 1)) * spacing_m
    return np.stack([np.zeros_like(y), y, z], axis=1), column.astype(np.int64)


def layout(radio: Radio, devices: list[DevicePose]) -> Layout:
    """Lays out the antennas of `devices`, all of the same kind `radio`."""
    tx_local, _ = element_offsets(
        radio.tx_rows, radio.tx_cols, _spacing_m(radio.tx_spacing_m, radio)
    )
    tx_local = tx_local + np.asarray(radio.tx_offset_m)
    rx_local, column = element_offsets(
        radio.rx_rows, radio.rx_cols, _spacing_m(radio.rx_spacing_m, radio)
    )
    tx_xyz, tx_device, tx_port, tx_site = _spread(radio, devices, tx_local, radio.tx_spacing_m)
    rx_xyz, rx_device, rx_port, rx_site = _spread(radio, devices, rx_local, radio.rx_spacing_m)
    own = tx_device[:, None] == rx_device[None, :]
    measured = {"included": np.ones_like(own), "only": own, "excluded": ~own}
    quats = np.array([device.quat_wxyz for device in devices], dtype=np.float64)
    return Layout(
        tx_quat_wxyz=quats[tx_device],
        rx_quat_wxyz=quats[rx_device],
        tx_xyz=tx_xyz,
        rx_xyz=rx_xyz,
        tx_device=tx_device,
        rx_device=rx_device,
        rx_column=np.tile(column, len(rx_xyz) // len(column)),
        measured=measured[radio.own_device_links],
        tx_port=tx_port,
        rx_port=rx_port,
        tx_site=tx_site,
        rx_site=rx_site,
    )


def _spacing_m(given_m: float, radio: Radio) -> float:
    """Distance of neighbouring elements [m]."""
    return given_m or 0.5 * radio.wavelength_m


def _spread(
    radio: Radio, devices: list[DevicePose], local: Float64[np.ndarray, "element 3"], given_m: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Position [m], device, port and site of one array's elements in every device."""
    ports = len(radio.slants_deg)
    xyz = [
        np.tile(local @ rotation(device.quat_wxyz).T + np.asarray(device.position_m), (ports, 1))
        for device in devices
    ]
    index = np.arange(len(devices), dtype=np.int64)
    port = np.tile(np.repeat(np.arange(ports), len(local)), len(devices))
    site = device = np.repeat(index, ports * len(local))
    if given_m > radio.wavelength_m:
        # Too far apart to see the same: rays are traced to each element.
        site = device * len(local) + np.tile(np.arange(len(local)), ports * len(devices))
    return np.concatenate(xyz), device, port.astype(np.int64), site
