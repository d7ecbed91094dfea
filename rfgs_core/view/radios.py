# SPDX-License-Identifier: Apache-2.0
"""Where a run's radio stands: elements, boresights and the links between its devices."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float64

from rfgs_core.dataset import Sequence
from rfgs_core.radio import DevicePose, frame_samples
from rfgs_core.radio.layout import rotation


@dataclass(frozen=True)
class RadioShapes:
    """A radio as points, arrows and lines [m]."""

    names: list[str]
    """Name of each device."""
    places: Float64[np.ndarray, "device 3"]
    """Where each device is."""
    boresights: Float64[np.ndarray, "device 3"]
    """Unit vector that each device faces."""
    tx_xyz: Float64[np.ndarray, "tx 3"]
    """Transmitting elements, at every sample of a frame where they move."""
    rx_xyz: Float64[np.ndarray, "rx 3"]
    """Receiving elements, likewise."""
    links: Float64[np.ndarray, "link 2 3"]
    """From a device's transmitting to another's receiving elements, centre to centre."""
    held_out: Bool[np.ndarray, "link"]
    """Links that training did not see."""


def radio_shapes(sequence: Sequence, radio: str) -> RadioShapes:
    """Shapes of a radio of a sequence; links of a device with itself have no length to show."""
    devices = sequence.devices(radio)
    samples = frame_samples(sequence.radio_spec(radio), sequence.fps, devices)
    hidden = {frozenset(pair) for pair in sequence.held_out(radio)["device_pairs"]}
    shapes = shapes_of(devices, sequence.layout(radio), hidden)
    if samples.tx_xyz is None or samples.rx_xyz is None:
        return shapes
    everywhere = samples.tx_xyz.reshape(-1, 3), samples.rx_xyz.reshape(-1, 3)
    return replace(shapes, tx_xyz=everywhere[0], rx_xyz=everywhere[1])


def shapes_of(
    devices: list[DevicePose],
    elements: Layout,
    hidden: Collection[frozenset[int]] = (),
) -> RadioShapes:
    """Shapes of devices that stand still.

    Args:
        devices: The devices.
        elements: Their antenna elements.
        hidden: Pairs of devices that training does not see.
    """
    pairs = [pair for pair in elements.device_pairs if pair[0] != pair[1]]
    return RadioShapes(
        names=[device.name for device in devices],
        places=np.array([device.position_m for device in devices]),
        boresights=np.array([_boresight(device) for device in devices]),
        tx_xyz=elements.tx_xyz,
        rx_xyz=elements.rx_xyz,
        links=np.array([elements.centres_of(*pair) for pair in pairs]).reshape(-1, 2, 3),
        held_out=np.array([frozenset(pair) in hidden for pair in pairs], dtype=bool),
    )


def _boresight(device: DevicePose) -> Float64[np.ndarray, "3"]:
    """Local +X."""
    return rotation(device.quat_wxyz)[:, 0]
