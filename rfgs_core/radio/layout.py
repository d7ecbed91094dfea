# SPDX-License-Identifier: Apache-2.0
"""Where every antenna element of a scene's devices is."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float64, Int64

from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.presets import Radio
from rfgs_core.rotations import rotation_rows

Role = Literal["ACCESS_POINT", "TRANSMITTER", "RECEIVER"]

#: Antennas closer than this have no far field to speak of, and no finite channel at zero [m].
NEAREST_ANTENNAS_M = 1e-3
#: Phases along an array change by this much at most between the middle and the ends of the band
#: where it counts as one place [rad]; tracers carry beams on over the band by a short series.
_TURNING_RAD = 2.0


@dataclass(frozen=True)
class DevicePose:
    """Position and orientation of one device; local +X is its boresight, local +Z its up."""

    name: str
    """Unique name within a radio."""
    position_m: tuple[float, float, float]
    """Centre of the RX array [m]."""
    quat_wxyz: tuple[float, float, float, float]
    """Rotation world_from_device, unit quaternion, w first."""
    role: Role = "ACCESS_POINT"
    """Whether it transmits, receives or, as an access point, does both."""


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
        return self.pairs_of(self.measured)[1]

    def pairs_of(
        self, use: Bool[np.ndarray, "tx rx"]
    ) -> tuple[Int64[np.ndarray, "tx rx"], list[tuple[int, int]]]:
        """Numbers the ordered (transmitting, receiving) device pairs that have a used link.

        Returns:
            Pair index per link, -1 where unused, and the list of pairs.
        """
        tx, rx = np.nonzero(use)
        names = sorted(
            set(zip(self.tx_device[tx].tolist(), self.rx_device[rx].tolist(), strict=True))
        )
        pair = np.full(use.shape, -1, dtype=np.int64)
        for index, (a, b) in enumerate(names):
            pair[self.links_between(a, b) & use] = index
        return pair, names

    def links_between(self, a: int, b: int) -> Bool[np.ndarray, "tx rx"]:
        """Links from elements of device `a` to those of device `b`, measured or not."""
        return (self.tx_device[:, None] == a) & (self.rx_device[None, :] == b)

    def block_of(
        self, a: int, b: int
    ) -> tuple[Int64[np.ndarray, "from 1"], Int64[np.ndarray, "1 to"]]:
        """Elements of device `a` that transmit and of `b` that receive: `csi[block]` is theirs."""
        tx, rx = np.flatnonzero(self.tx_device == a), np.flatnonzero(self.rx_device == b)
        return tx[:, None], rx[None, :]

    def centres_of(
        self, a: int, b: int
    ) -> tuple[Float64[np.ndarray, "3"], Float64[np.ndarray, "3"]]:
        """Centres of the transmitting array of device `a` and of the receiving one of `b` [m]."""
        tx = self.tx_xyz[self.tx_device == a].mean(axis=0)
        return tx, self.rx_xyz[self.rx_device == b].mean(axis=0)


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


def devices_at(radio: Radio, devices: list[DevicePose], sample: int) -> list[DevicePose]:
    """Where the devices are at one of a frame's samples: all of them, or the one that moves.

    Args:
        radio: Their kind; it tells whether they move.
        devices: Poses; of a device that moves, one for each sample.
        sample: Which sample of a frame.
    """
    return devices[sample : sample + 1] if radio.antennas_move else devices


def layout(radio: Radio, devices: list[DevicePose], sample: int = 0) -> Layout:
    """Lays out the antennas of `devices`, all of the same kind `radio`, at a sample of a frame."""
    devices = devices_at(radio, devices, sample)
    tx_local, _ = element_offsets(
        radio.tx_rows, radio.tx_cols, _spacing_m(radio.tx_spacing_m, radio)
    )
    tx_local = tx_local + np.asarray(radio.tx_offset_m)
    rx_local, column = element_offsets(
        radio.rx_rows, radio.rx_cols, _spacing_m(radio.rx_spacing_m, radio)
    )
    senders = [i for i, device in enumerate(devices) if device.role != "RECEIVER"]
    hearers = [i for i, device in enumerate(devices) if device.role != "TRANSMITTER"]
    far = (
        radio.tx_spacing_m > radio.wavelength_m or _beams_turn(tx_local, radio),
        radio.rx_spacing_m > radio.wavelength_m or _beams_turn(rx_local, radio),
    )
    tx_xyz, tx_device, tx_port, tx_site = _spread(radio, devices, senders, tx_local, far[0])
    rx_xyz, rx_device, rx_port, rx_site = _spread(radio, devices, hearers, rx_local, far[1])
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


def nearest_m(tx_xyz: Float64[np.ndarray, "tx 3"], rx_xyz: Float64[np.ndarray, "rx 3"]) -> float:
    """Least distance of a transmitting and a receiving element [m]."""
    return min(float(np.linalg.norm(rx_xyz - place, axis=1).min()) for place in tx_xyz)


def _beams_turn(local: Float64[np.ndarray, "element 3"], radio: Radio) -> bool:
    """Whether an array is so wide for its band that its beams differ from end to end of that."""
    reach_m = float(np.linalg.norm(local - local.mean(axis=0), axis=1).max())
    return math.pi * radio.bandwidth_hz / SPEED_OF_LIGHT * reach_m > _TURNING_RAD


def _spacing_m(given_m: float, radio: Radio) -> float:
    """Distance of neighbouring elements [m]."""
    return given_m or 0.5 * radio.wavelength_m


def _spread(
    radio: Radio,
    devices: list[DevicePose],
    chosen: list[int],
    local: Float64[np.ndarray, "element 3"],
    far_apart: bool,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Position [m], device, port and site of one array's elements in the chosen devices."""
    ports = len(radio.slants_deg)
    xyz = [
        np.tile(
            local @ rotation(devices[i].quat_wxyz).T + np.asarray(devices[i].position_m), (ports, 1)
        )
        for i in chosen
    ]
    port = np.tile(np.repeat(np.arange(ports, dtype=np.int64), len(local)), len(chosen))
    site = np.repeat(np.arange(len(chosen), dtype=np.int64), ports * len(local))
    device = np.array(chosen, dtype=np.int64)[site]
    if far_apart:
        # Too far apart to see the same, or to be one place over all of the band: rays are traced
        # to each element.
        site = site * len(local) + np.tile(np.arange(len(local)), ports * len(chosen))
    return np.concatenate([np.zeros((0, 3)), *xyz]), device, port, site
