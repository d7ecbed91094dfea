# SPDX-License-Identifier: Apache-2.0
"""Channels of bundles, link by link, from the tracers that make datasets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dataset_factory.scene.bundle import Bundle
from dataset_factory.verify.workshop import Workshop, devices_of
from rfgs_core.radio import Layout, Radio, layout

#: Arrays nearly one above the other have no defined sign of a vertical polarisation.
STEEP = 0.999


@dataclass(frozen=True)
class Links:
    """Measured links of a radio, one after the other."""

    channel: np.ndarray
    """Complex128, shape (link, subcarrier)."""
    tx_xyz: np.ndarray
    """Transmitting element of each [m], shape (link, 3)."""
    rx_xyz: np.ndarray
    """Receiving element of each [m], shape (link, 3)."""
    steep: np.ndarray
    """Whether the centres of its arrays are one above the other, bool, shape (link,)."""

    @property
    def distance_m(self) -> np.ndarray:
        """Distance of the elements of each link [m], shape (link,)."""
        return np.linalg.norm(self.rx_xyz - self.tx_xyz, axis=1)


def static_links(workshop: Workshop, bundle: Bundle, radio: Radio) -> Links:
    """What every measured link hears of a scene without anything that moves.

    Args:
        workshop: Chooses the tracer.
        bundle: Scene bundle.
        radio: Its radio.

    Returns:
        Those of all places of a radio that moves.
    """
    devices = devices_of(bundle, radio)
    csi = workshop.traced(bundle, radio, devices, depth=1).static()
    csi = csi if radio.antennas_move else csi[None]
    return joined([links(layout(radio, devices, n), channel) for n, channel in enumerate(csi)])


def joined(parts: Sequence[Links]) -> Links:
    """Links of several places as one set."""
    columns = zip(*(vars(part).values() for part in parts), strict=True)
    return Links(*(np.concatenate(column) for column in columns))


def links(elements: Layout, csi: np.ndarray) -> Links:
    """The measured links of a channel of shape (tx, rx, subcarrier)."""
    tx, rx = np.nonzero(elements.measured)
    tx_middle, rx_middle = (
        np.stack([xyz[site == s].mean(axis=0) for s in site])
        for xyz, site in (
            (elements.tx_xyz, elements.tx_site),
            (elements.rx_xyz, elements.rx_site),
        )
    )
    way = rx_middle[rx] - tx_middle[tx]
    return Links(
        csi[tx, rx].astype(np.complex128),
        elements.tx_xyz[tx],
        elements.rx_xyz[rx],
        np.abs(way[:, 2]) > STEEP * np.linalg.norm(way, axis=1),
    )


def single(radio: Radio, **fields: Any) -> Radio:
    """A radio of one element each way at one place, which hears other devices alone.

    Args:
        radio: Gives the band and everything that `fields` does not.
        **fields: Further fields of the radio.
    """
    alone = {"tx_rows": 1, "tx_cols": 1, "rx_rows": 1, "rx_cols": 1, "tx_offset_m": (0.0, 0.0, 0.0)}
    return replace(radio, **{**alone, "own_device_links": "excluded", **fields})


def monostatic(radio: Radio, subcarriers: int, **fields: Any) -> Radio:
    """A radio of one element each way, 5 cm apart, that all but hears nothing of its own way there.

    Args:
        radio: Gives the band and everything that `fields` does not.
        subcarriers: Their number.
        **fields: Further fields of the radio.
    """
    near = {"tx_offset_m": (0.0, 0.0, -0.05), "isolation_db": 100.0, "own_device_links": "included"}
    return single(radio, **{**near, "num_subcarriers": subcarriers, **fields})


def echoes(workshop: Workshop, bundle: Bundle, radio: Radio) -> np.ndarray:
    """What moving things add to the channel of each frame, without the shadows that they cast.

    Args:
        workshop: Chooses the tracer.
        bundle: Scene bundle.
        radio: Its radio.

    Returns:
        Complex128, shape (frame, tx, rx, subcarrier).
    """
    tracer = workshop.traced(bundle, radio, depth=1, shadow="hard")
    static = tracer.static().astype(np.complex128)
    return np.stack([tracer.frame(bundle.frame(frame)) - static for frame in bundle.frames])
