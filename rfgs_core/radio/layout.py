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
    """Antenna elements of all devices, flattened device by device."""

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
    spacing_m = 0.5 * radio.wavelength_m
    tx_local, _ = element_offsets(radio.tx_rows, radio.tx_cols, spacing_m)
    tx_local = tx_local + np.asarray(radio.tx_offset_m)
    rx_local, column = element_offsets(radio.rx_rows, radio.rx_cols, spacing_m)
    tx_xyz, rx_xyz = [], []
    for device in devices:
        world = rotation(device.quat_wxyz)
        tx_xyz.append(tx_local @ world.T + np.asarray(device.position_m))
        rx_xyz.append(rx_local @ world.T + np.asarray(device.position_m))
    count = np.arange(len(devices), dtype=np.int64)
    tx_device, rx_device = np.repeat(count, len(tx_local)), np.repeat(count, len(rx_local))
    own = tx_device[:, None] == rx_device[None, :]
    measured = {"included": np.ones_like(own), "only": own, "excluded": ~own}
    return Layout(
        tx_xyz=np.concatenate(tx_xyz),
        rx_xyz=np.concatenate(rx_xyz),
        tx_device=tx_device,
        rx_device=rx_device,
        rx_column=np.tile(column, len(devices)),
        measured=measured[radio.own_device_links],
    )


def place_devices(radio: Radio, bounds_m: Float64[np.ndarray, "2 3"]) -> list[DevicePose]:
    """Places devices in the corners of the scene, facing its centre.

    Args:
        radio: Which radio; gives count, heights and inset.
        bounds_m: Scene bounds [m], rows minimum and maximum.

    Returns:
        One pose per device, counter-clockwise from the corner of smallest x and y.
    """
    low, high = bounds_m[0] + radio.inset_m, bounds_m[1] - radio.inset_m
    corners = [(low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])]
    centre = bounds_m.mean(axis=0)
    devices = []
    for index in range(radio.num_devices):
        x, y = corners[index % 4]
        z = bounds_m[0, 2] + radio.heights_m[index % len(radio.heights_m)]
        yaw = float(np.arctan2(centre[1] - y, centre[0] - x))
        quat = (float(np.cos(yaw / 2)), 0.0, 0.0, float(np.sin(yaw / 2)))
        devices.append(DevicePose(f"{radio.name}_{index}", (float(x), float(y), float(z)), quat))
    return devices
