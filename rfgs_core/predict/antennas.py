# SPDX-License-Identifier: Apache-2.0
"""Antennas at positions a user names."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Float64

from rfgs_core.errors import RfgsError
from rfgs_core.predict.places import spelt
from rfgs_core.radio import DevicePose, Radio, layout
from rfgs_core.radio.layout import NEAREST_ANTENNAS_M


def read_position(text: str, option: str) -> Float64[np.ndarray, "3"]:
    """A position [m] from `x,y,z`.

    Raises:
        RfgsError: The text is not three finite numbers.
    """
    parts = text.split(",")
    try:
        position = np.array([float(part) for part in parts])
    except ValueError:
        position = np.array([np.nan])
    if len(position) != 3 or not np.isfinite(position).all():
        raise RfgsError(
            f"{option} {text!r}: expected three finite coordinates x,y,z in metres, "
            f"for example {option} 1.0,2.5,1.2"
        )
    return position


def check_positions(
    tx_xyz: Float[np.ndarray, "3"],
    rx_xyz: Float[np.ndarray, "rx 3"],
    scatterers: Float[np.ndarray, "M 3"],
    clearance_m: float,
) -> None:
    """Refuses antennas on top of each other or inside what scatters.

    Args:
        tx_xyz: Transmitting antenna [m].
        rx_xyz: Receiving antennas [m], at least one.
        scatterers: Centres of the Gaussians [m].
        clearance_m: Distance that antennas keep from them [m].

    Raises:
        RfgsError: Two antennas share a place, or one stands within the Gaussians.
    """
    named = [("--tx", tx_xyz), *(("--rx", place) for place in rx_xyz)]
    for index, (option, place) in enumerate(named):
        name = f"{option} {spelt(place)}"
        for other, there in named[:index]:
            if np.linalg.norm(place - there) < NEAREST_ANTENNAS_M:
                raise RfgsError(
                    f"{name}: on top of a {other} antenna; expected antennas at least "
                    f"{NEAREST_ANTENNAS_M * 1e3:g} mm apart, move one of them"
                )
        nearest_m = np.linalg.norm(scatterers - place, axis=1).min(initial=np.inf)
        if nearest_m < clearance_m:
            raise RfgsError(
                f"{name}: {nearest_m * 100:.1f} cm from a Gaussian; expected at least "
                f"{clearance_m * 100:.1f} cm (λ/2), move the antenna out of the person"
            )


def receiving_array(
    radio: Radio, centre: Float[np.ndarray, "3"], facing: Float[np.ndarray, "3"]
) -> tuple[Float64[np.ndarray, "element 3"], float]:
    """Elements of a radio's receiving array at a new place, upright and turned towards a point.

    Args:
        radio: Gives rows, columns and spacing.
        centre: Centre of the array [m].
        facing: Point that the array's boresight is turned to, about the vertical [m].

    Returns:
        Element positions [m], one per place (ports of one element share it), and the azimuth
        of the boresight [rad].

    Raises:
        RfgsError: The point lies straight above or below the array.
    """
    towards = np.asarray(facing, dtype=np.float64) - centre
    if np.hypot(towards[0], towards[1]) < NEAREST_ANTENNAS_M:
        raise RfgsError(
            "--facing: expected a point beside the array, found one straight above or below it; "
            "give --facing x,y,z"
        )
    yaw = float(np.arctan2(towards[1], towards[0]))
    quat = (float(np.cos(yaw / 2)), 0.0, 0.0, float(np.sin(yaw / 2)))
    x, y, z = (float(value) for value in centre)
    elements = layout(radio, [DevicePose("", (x, y, z), quat, "RECEIVER")])
    return elements.rx_xyz[elements.rx_port == 0], yaw


def positions(tx: str, rx: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    """Transmitting position (3,) and receiving positions (rx, 3) [m] from their texts.

    Raises:
        RfgsError: A text is not a position, or there is no receiving one.
    """
    if not rx:
        raise RfgsError("--rx: expected at least one position x,y,z in metres, found none")
    return read_position(tx, "--tx"), np.stack([read_position(text, "--rx") for text in rx])
