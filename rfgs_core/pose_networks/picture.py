# SPDX-License-Identifier: Apache-2.0
"""Amplitudes and sanitised phases of a channel, as networks of Wi-Fi sensing read them.

Of every device pair a few antennas and every other subcarrier: in phase with the empty room's
channel H₀ the change of amplitude |H| − |H₀|, in quadrature |H| sin φ, where φ is the phase
between the two less a line over subcarriers that all antennas of a pair share (SpotFi, algorithm
1): what clocks do to a packet is gone. Publications read the channel as it is; the empty room is
taken off here because rooms differ, and both parts are in units of the pair's H₀.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Complex, Float32, Int64

from rfgs_core.encode.body_maps import ArrayEnd
from rfgs_core.errors import RfgsError
from rfgs_core.radio import Layout
from rfgs_core.sanitize.phase import remove_linear_phase

#: Rows and columns of a receiving array that are read, from its middle: publications have three
#: antennas per receiver.
ANTENNAS = 4
#: Of so many neighbouring subcarriers one is read: publications have 30 of them.
EVERY = 2


def central_elements(layout: Layout, device: int) -> Int64[np.ndarray, "row column"]:
    """Receiving elements in the middle of a device's array, from below, as rows and columns.

    Raises:
        RfgsError: The elements do not stand in rows and columns.
    """
    own = np.flatnonzero(layout.rx_device == device)
    offsets = ArrayEnd.of(layout.rx_xyz[own], layout.rx_quat_wxyz[own[0]]).offsets.round(5)
    middles = [_middle(np.unique(offsets[:, axis])) for axis in (1, 0)]
    grid = []
    for z in middles[0]:
        found = [own[(offsets == (y, z)).all(axis=1)] for y in middles[1]]
        if any(len(one) == 0 for one in found):
            raise RfgsError(f"device {device}: expected receiving antennas in rows and columns")
        grid.append([int(one[0]) for one in found])
    return np.array(grid)


def _middle(places: np.ndarray) -> np.ndarray:
    """The middle ones of ascending places."""
    first = max((len(places) - ANTENNAS) // 2, 0)
    return places[first : first + ANTENNAS]


def pictures(
    csi: Complex[np.ndarray, "frame tx rx subcarrier"],
    static: Complex[np.ndarray, "tx rx subcarrier"],
    layout: Layout,
) -> Float32[np.ndarray, "frame token number"]:
    """What the network reads of frames: a token for every row of antennas of every device pair.

    Args:
        csi: The channel, one packet per frame.
        static: That of the empty room.
        layout: Antenna elements.

    Returns:
        Pairs ascending, their rows from below. Numbers of a token: the two parts, each of
        transmitting antennas, columns and subcarriers.

    Raises:
        RfgsError: Devices have different arrays.
    """
    tokens = []
    for a, b in layout.device_pairs:
        tx, grid = np.flatnonzero(layout.tx_device == a), central_elements(layout, b)
        block = np.ix_(tx, grid.ravel(), np.arange(0, csi.shape[-1], EVERY))
        still, heard = static[block], csi[:, *block]
        turn = remove_linear_phase(heard * still.conj(), np.arange(still.shape[-1]))
        size = float(np.sqrt(np.mean(np.abs(still) ** 2)))
        parts = np.stack(
            [np.abs(heard) - np.abs(still), np.abs(heard) * np.sin(np.angle(turn))], axis=1
        )
        # (frame, part, tx, row · column, subcarrier) to a token for every row.
        shaped = parts.reshape(*parts.shape[:3], *grid.shape, parts.shape[-1]) / max(size, 1e-30)
        tokens.append(np.moveaxis(shaped, 3, 1).reshape(len(csi), len(grid), -1))
    if len({part.shape for part in tokens}) != 1:
        raise RfgsError("expected the same array on every device of the radio")
    return np.concatenate(tokens, axis=1).astype(np.float32)
