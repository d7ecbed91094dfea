# SPDX-License-Identifier: Apache-2.0
"""What of a radio a learned encoder depends on: its subcarriers and the arrays of one device."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from rfgs_core.errors import RfgsError
from rfgs_core.radio.layout import Layout, rotation


@dataclass(frozen=True)
class RadioSignature:
    """Subcarriers, and antennas in their device's own axes; where devices stand does not count."""

    freq_hz: Float64[np.ndarray, "subcarrier"]
    """Subcarriers [Hz]."""
    tx_offset_m: Float64[np.ndarray, "tx 3"]
    """Transmitting elements of a device from their centre [m]."""
    rx_offset_m: Float64[np.ndarray, "rx 3"]
    """Receiving elements of a device from their centre [m]."""
    packets: int = 1
    """Packets of a frame that are read."""
    packet_interval_s: float = 0.0
    """Time between them [s]; zero for a single one."""

    @staticmethod
    def of(
        layout: Layout,
        freq_hz: Float64[np.ndarray, "subcarrier"],
        packets: int = 1,
        packet_interval_s: float = 0.0,
    ) -> RadioSignature:
        """The signature of a radio."""
        return RadioSignature(
            freq_hz,
            _offsets_m(layout.tx_xyz, layout.tx_quat_wxyz, layout.tx_device),
            _offsets_m(layout.rx_xyz, layout.rx_quat_wxyz, layout.rx_device),
            packets,
            packet_interval_s,
        )

    def __str__(self) -> str:
        low, high = self.freq_hz[[0, -1]] * 1e-9
        arrays = f"{len(self.tx_offset_m)} TX and {len(self.rx_offset_m)} RX antennas per device"
        band = f"{len(self.freq_hz)} subcarriers from {low:.4g} to {high:.4g} GHz"
        if self.packets == 1:
            return f"{band}, {arrays}"
        return (
            f"{band}, {arrays}, {self.packets} packets {1e3 * self.packet_interval_s:.4g} ms apart"
        )

    def refuse_others(self, other: RadioSignature, name: str) -> None:
        """Refuses another radio.

        Raises:
            RfgsError: Subcarriers, antennas or packets differ.
        """
        rhythm = [(one.packets, round(one.packet_interval_s * 1e9)) for one in (self, other)]
        if rhythm[0] != rhythm[1]:
            raise RfgsError(
                f"{name} was made for a radio of {self}; of this one {other.packets} per frame are "
                f"read, {other.packet_interval_s * 1e3:.4g} ms apart; make one for it with "
                "`rfgs encode`"
            )
        for mine, theirs, tolerance in (
            (self.freq_hz, other.freq_hz, 1.0),
            (self.tx_offset_m, other.tx_offset_m, 1e-6),
            (self.rx_offset_m, other.rx_offset_m, 1e-6),
        ):
            if mine.shape != theirs.shape or np.abs(mine - theirs).max() > tolerance:
                also = ", spaced otherwise" if str(self) == str(other) else ""
                raise RfgsError(
                    f"{name} was made for a radio of {self}; this one has {other}{also}; make one "
                    "for it with `rfgs encode`"
                )

    def need_linear_arrays(self, network: str) -> None:
        """Refuses arrays that have no single row of directions.

        Args:
            network: Which network asks for them.

        Raises:
            RfgsError: An array is not a line of evenly spaced antennas.
        """
        for offsets_m in (self.tx_offset_m, self.rx_offset_m):
            steps_m = np.diff(offsets_m, axis=0)
            if len(steps_m) and np.abs(steps_m - steps_m[0]).max() > 1e-6:
                raise RfgsError(
                    f"the {network} network expects evenly spaced antennas in a line, this radio "
                    f"has {len(offsets_m)} in another arrangement; use --network csi"
                )


def _offsets_m(
    xyz: Float64[np.ndarray, "element 3"],
    quat_wxyz: Float64[np.ndarray, "element 4"],
    device: np.ndarray,
) -> Float64[np.ndarray, "element 3"]:
    """Elements of the first device from their centre, in the device's axes [m]."""
    first = device == device[0]
    w, x, y, z = quat_wxyz[0]
    return (xyz[first] - xyz[first].mean(axis=0)) @ rotation((w, x, y, z))
