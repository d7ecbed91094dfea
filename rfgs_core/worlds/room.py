# SPDX-License-Identifier: Apache-2.0
"""Random rooms with walls that reflect, and devices in them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float64

from rfgs_core.radio import Layout, Radio
from rfgs_core.radio.layout import DevicePose, layout
from rfgs_core.radio.placement import CORNERS, place_devices

#: Share of worlds without walls, of those with a shortened array, a gap in the band, furniture
#: before a device, and of devices in corners rather than anywhere.
OUTDOORS, SHORTENED, GAPPED, FURNISHED, IN_CORNERS = 0.1, 0.5, 0.5, 0.2, 0.6
#: Heights of devices that stand anywhere [m].
_LOWEST_M, _HIGHEST_M = 0.4, 2.4
#: Devices keep this far from a person [m].
_NEAREST_M = 0.8


@dataclass(frozen=True)
class Room:
    """A box whose sides reflect, each by its own amplitude."""

    bounds_m: Float64[np.ndarray, "2 3"]
    """Where the sides are [m]; the floor is z = 0."""
    reflects: Float64[np.ndarray, "3 2"]
    """Amplitude of a wave after each side, low and high along x, y and z; 0 for no wall."""

    @staticmethod
    def random(rng: np.random.Generator) -> Room:
        """A room of 3 to 9 m with walls of anything from plasterboard to concrete."""
        half = rng.uniform(1.6, 3.8, 2) if rng.random() < 0.8 else rng.uniform(2.5, 5.0, 2)
        high = np.array([*half, rng.uniform(2.3, 3.4)])
        bounds = np.array([[*-half, 0.0], high])
        reflects = rng.uniform(0.1, 0.75, (3, 2))
        if rng.random() < OUTDOORS:
            reflects[:2] = reflects[2, 1] = 0.0
        return Room(bounds, reflects)

    def place(self, rng: np.random.Generator) -> Float64[np.ndarray, "2"]:
        """Where somebody may stand [m]."""
        room = np.minimum(0.7, 0.4 * (self.bounds_m[1, :2] - self.bounds_m[0, :2]))
        return rng.uniform(self.bounds_m[0, :2] + room, self.bounds_m[1, :2] - room)


@dataclass(frozen=True)
class Sight:
    """What a radio hears with, less what is hidden from the fit."""

    layout: Layout
    links: Bool[np.ndarray, "tx rx"]
    subcarriers: Bool[np.ndarray, "subcarrier"]
    freq_hz: Float64[np.ndarray, "subcarrier"]
    above_m: Float64[np.ndarray, "device"]
    """Furniture hides from each device what is lower [m]."""

    @staticmethod
    def random(
        rng: np.random.Generator, radio: Radio, room: Room, person: np.ndarray
    ) -> Sight | None:
        """Devices around a person at `person` (x, y) [m], with entries left out as training does.

        None where they found no place.
        """
        count = int(rng.choice([3, 4, 5], p=[0.25, 0.6, 0.15]))
        kind = replace(radio, num_devices=count, inset_m=float(rng.uniform(0.1, 0.4)))
        heights = np.resize([1.2, 2.2], count) + rng.uniform(-0.25, 0.25, count)
        kind = replace(kind, heights_m=tuple(heights))
        if count <= CORNERS and rng.random() <= IN_CORNERS:
            devices = place_devices(kind, room.bounds_m)
        else:
            devices = anywhere(rng, room.bounds_m, person[None], count)
        if not devices:
            return None
        placed = layout(kind, devices)
        links = placed.measured.copy()
        if rng.random() < SHORTENED and radio.rx_cols >= 4:
            links[:, placed.rx_column >= radio.rx_cols - radio.rx_cols // 4] = False
        subcarriers = np.ones(radio.num_subcarriers, dtype=bool)
        if rng.random() < GAPPED:
            width = radio.num_subcarriers // 8
            # Mostly the gap of our own splits, five eighths up the band.
            first = 5 * width if rng.random() < 0.7 else int(rng.integers(0, 7 * width))
            subcarriers[first : first + width] = False
        hidden = rng.random(count) < FURNISHED
        above_m = np.where(hidden, rng.uniform(0.15, 0.8, count), -np.inf)
        return Sight(placed, links, subcarriers, radio.freq_hz, above_m)

    @staticmethod
    def whole(radio: Radio, room: Room) -> Sight:
        """Devices where the radio's own rule puts them, nothing left out and nothing hidden."""
        placed = layout(radio, place_devices(radio, room.bounds_m))
        subcarriers = np.ones(radio.num_subcarriers, dtype=bool)
        hidden_below = np.full(radio.num_devices, -np.inf)
        return Sight(placed, placed.measured.copy(), subcarriers, radio.freq_hz, hidden_below)


def anywhere(
    rng: np.random.Generator,
    bounds_m: Float64[np.ndarray, "2 3"],
    apart_m: Float64[np.ndarray, "n 2"],
    count: int,
) -> list[DevicePose]:
    """Devices anywhere in a room, facing its middle roughly; none if they find no place.

    Args:
        rng: Where chance comes from.
        bounds_m: The room [m].
        apart_m: Where people are from above [m]; devices keep away from there and each other.
        count: How many.
    """
    low, high = bounds_m[0, :2] + 0.1, bounds_m[1, :2] - 0.1
    devices: list[DevicePose] = []
    for _ in range(1000):
        x, y = rng.uniform(low, high)
        others = np.array([*apart_m, *(device.position_m[:2] for device in devices)])
        if np.linalg.norm(others - (x, y), axis=1).min() < _NEAREST_M:
            continue
        yaw = np.arctan2(-y, -x) + rng.normal(0.0, 0.4)
        z = float(rng.uniform(_LOWEST_M, min(_HIGHEST_M, bounds_m[1, 2] - 0.1)))
        quat = (float(np.cos(yaw / 2)), 0.0, 0.0, float(np.sin(yaw / 2)))
        devices.append(DevicePose(str(len(devices)), (float(x), float(y), z), quat))
        if len(devices) == count:
            return devices
    return []
