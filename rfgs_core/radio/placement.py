# SPDX-License-Identifier: Apache-2.0
"""Where devices stand in a scene that brings none of its own."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from rfgs_core.errors import RfgsError
from rfgs_core.radio.layout import DevicePose, layout
from rfgs_core.radio.presets import Radio

#: A device in a corner that is outside the room comes nearer to the people by such a share.
NEARER = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8)
#: It keeps this far from what it came around [m].
NOT_AT_WALL_M = 0.15
#: Devices that a room has corners for.
CORNERS = 4
#: Bounds that reach this far below the floor under the people hold something that fell [m].
SUNK_M = 0.3


def height_m(radio: Radio, bounds_m: Float64[np.ndarray, "2 3"], wanted_m: float) -> float:
    """A device's height above the floor [m]: as wanted, but below a low ceiling."""
    room_m = float(bounds_m[1, 2] - bounds_m[0, 2])
    return min(wanted_m, max(room_m - radio.inset_m, 0.5 * room_m))


def place_devices(radio: Radio, bounds_m: Float64[np.ndarray, "2 3"]) -> list[DevicePose]:
    """Places devices by the radio's rule, heights alternating, below the ceiling.

    `corners`: in the corners of the scene, facing its centre, counter-clockwise from the corner
    of smallest x and y. `walls`: along the walls, facing inwards, as evenly as they fit.
    `circle`: on the largest circle around the centre, facing it, counter-clockwise from +x.

    Args:
        radio: Which radio; gives rule, count, heights and inset.
        bounds_m: Bounds of the scene or of a room [m], rows minimum and maximum.

    Returns:
        One pose per device; of a device that moves, one per sample of a frame.

    Raises:
        RfgsError: The arrays are longer than the walls, there is no room for a circle, or a room
            has fewer corners than there are devices.
    """
    rule = {"corners": _corners, "walls": _walls, "circle": _circle}[radio.placement]
    spots = rule(radio, bounds_m)
    devices = []
    for index, (x, y, yaw) in enumerate(spots):
        z = bounds_m[0, 2] + height_m(
            radio, bounds_m, radio.heights_m[index % len(radio.heights_m)]
        )
        quat = (float(np.cos(yaw / 2)), 0.0, 0.0, float(np.sin(yaw / 2)))
        devices.append(DevicePose(f"{radio.name}_{index}", (float(x), float(y), float(z)), quat))
    return devices


def _corners(radio: Radio, bounds_m: np.ndarray) -> list[tuple[float, float, float]]:
    """Place [m] and yaw [rad] of devices in the corners."""
    low, high = bounds_m[0] + radio.inset_m, bounds_m[1] - radio.inset_m
    corners = [(low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])]
    centre = bounds_m.mean(axis=0)
    if radio.num_places > CORNERS:
        raise RfgsError(
            f"radio {radio.name!r}: {radio.num_places} devices in four corners would stand in each "
            "other; give the radio placement: walls or circle, or place devices in the scene "
            "(Empties with the role access point)"
        )
    chosen = corners[: radio.num_places]
    return [(x, y, float(np.arctan2(centre[1] - y, centre[0] - x))) for x, y in chosen]


def _circle(radio: Radio, bounds_m: np.ndarray) -> list[tuple[float, float, float]]:
    """Place [m] and yaw [rad] of devices on the largest circle that keeps off the bounds."""
    centre = bounds_m.mean(axis=0)
    radius_m = 0.5 * float(np.diff(bounds_m[:, :2], axis=0).min()) - radio.inset_m
    if radius_m <= 0.0:
        raise RfgsError(
            f"radio {radio.name!r}: no circle fits into a scene of "
            f"{np.diff(bounds_m, axis=0)[0].round(2).tolist()} m with {radio.inset_m:g} m to "
            "spare; place devices in the scene (Empties with the role access point)"
        )
    turns = 2.0 * np.pi * np.arange(radio.num_places) / radio.num_places
    away = radius_m * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    return [
        (float(centre[0] + x), float(centre[1] + y), float(turn + np.pi))
        for (x, y), turn in zip(away, turns, strict=True)
    ]


def _walls(radio: Radio, bounds_m: np.ndarray) -> list[tuple[float, float, float]]:
    """Place [m] and yaw [rad] of devices along the walls, counter-clockwise from smallest y."""
    low, high = bounds_m[0, :2] + radio.inset_m, bounds_m[1, :2] - radio.inset_m
    width_m = _width_m(radio)
    length = np.array([high[0] - low[0], high[1] - low[1]] * 2)
    # A wall takes one device after the other as long as their arrays do not overlap.
    room = (length // max(width_m, 1e-3)).astype(int)
    if room.sum() < radio.num_places:
        raise RfgsError(
            f"radio {radio.name!r}: {radio.num_places} arrays of {width_m:g} m do not fit along "
            f"walls of {length[0]:.2f} and {length[1]:.2f} m; place devices in the scene (Empties "
            "with the role access point) or use a radio with shorter arrays"
        )
    count = np.zeros(4, dtype=int)
    while count.sum() < radio.num_places:
        # The next device goes where it gets most space, the first of equals.
        count[np.argmax(np.where(count < room, length / (count + 1), -1.0))] += 1
    starts = np.array([low, (high[0], low[1]), high, (low[0], high[1])])
    spots = []
    for wall in range(4):
        along = np.array([(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)][wall])
        for k in range(count[wall]):
            x, y = starts[wall] + along * length[wall] * (k + 0.5) / count[wall]
            spots.append((float(x), float(y), float((wall + 1) * np.pi / 2)))
    return spots


def _width_m(radio: Radio) -> float:
    """Extent of one device's elements along its local y [m]."""
    alone = layout(radio, [DevicePose("", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))])
    return float(np.ptp(np.concatenate([alone.tx_xyz, alone.rx_xyz])[:, 1]))
