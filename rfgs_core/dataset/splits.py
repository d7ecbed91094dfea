# SPDX-License-Identifier: Apache-2.0
"""What is held out of training, chosen once when a sequence is made."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool

from rfgs_core.errors import RfgsFormatError
from rfgs_core.radio import Layout, Radio
from rfgs_core.seeds import sub_seed


def evenly_spaced(count: int) -> list[int]:
    """Indices of about a quarter of `count` things, evenly spaced; none of a single thing.

    Example:
        >>> evenly_spaced(8)
        [2, 6]
    """
    if count < 2:
        return []
    held = max(1, round(count / 4))
    return [int((index + 0.5) * count / held) for index in range(held)]


def image_split(cameras: list[str], frames: list[int]) -> dict[str, list[Any]]:
    """Chooses cameras for testing, and frames whose pictures no shader may see."""
    return {
        "test_cameras": [cameras[index] for index in evenly_spaced(len(cameras))],
        "test_frames": [frames[index] for index in evenly_spaced(len(frames))],
    }


def radio_split(radio: Radio, layout: Layout, seed: int) -> dict[str, list[Any]]:
    """Chooses the held-out channel entries of one radio.

    Args:
        radio: The radio.
        layout: Its antenna elements.
        seed: Root seed; it picks the device pair.

    Returns:
        `rx_elements`: indices of the last quarter of each array's columns; `subcarriers`: the
        contiguous eighth from 5/8 to 6/8 of the band; `device_pairs`: one unordered pair of
        devices, a device with itself where a radio only hears itself.
    """
    held_columns = radio.rx_cols // 4
    elements = np.flatnonzero(layout.rx_column >= radio.rx_cols - held_columns)
    subcarriers = radio.num_subcarriers
    first, last = 5 * subcarriers // 8, 6 * subcarriers // 8
    tx, rx = np.nonzero(layout.measured)
    devices = np.stack([layout.tx_device[tx], layout.rx_device[rx]], axis=1)
    pairs = np.unique(np.sort(devices, axis=1), axis=0)
    between = pairs[pairs[:, 0] != pairs[:, 1]]
    pool = between if len(between) else pairs
    # With a single pair nothing would be left to train on.
    held = pool[sub_seed(seed, radio.name, "held-out pair") % len(pool)][None]
    return {
        "rx_elements": elements.tolist(),
        "subcarriers": list(range(first, max(last, first + 1))) if subcarriers >= 8 else [],
        "device_pairs": held.tolist() if len(pairs) > 1 else [],
    }


def refuse_beyond(source: str, split: Mapping[str, Any], sizes: Mapping[str, int]) -> None:
    """Refuses a radio's split that names elements, subcarriers or devices beyond its last.

    Args:
        source: Where the split stands, for the message.
        split: As `radio_split` chooses it.
        sizes: Receiving elements (`rx`), subcarriers and devices of the radio.

    Raises:
        RfgsFormatError: It does.
    """
    pairs = [device for pair in split["device_pairs"] for device in pair]
    for name, indices, axis in (
        ("rx_elements", split["rx_elements"], "rx"),
        ("subcarriers", split["subcarriers"], "subcarrier"),
        ("device_pairs", pairs, "device"),
    ):
        if max(indices, default=0) >= sizes[axis]:
            raise RfgsFormatError(
                f"{source}.{name}: expected indices below {sizes[axis]}, found {max(indices)}"
            )


@dataclass(frozen=True)
class HeldOut:
    """Which entries of a channel training must not see; the three kinds do not overlap."""

    links: Bool[np.ndarray, "tx rx"]
    """Measured links that training may use."""
    subcarriers: Bool[np.ndarray, "subcarrier"]
    """Subcarriers that training may use."""
    pair_links: Bool[np.ndarray, "tx rx"]
    """Links of held-out device pairs, in both directions; all their subcarriers are held out."""
    element_links: Bool[np.ndarray, "tx rx"]
    """Links of held-out elements outside the held-out device pairs."""
    unmeasured: Bool[np.ndarray, "subcarrier"] | None = None
    """Subcarriers that a real radio did not report, which nobody sees and nothing is judged by;
    None where there are all."""

    @staticmethod
    def of(split: Mapping[str, Any], layout: Layout, num_subcarriers: int) -> HeldOut:
        """Reads a radio's split, as `radio_split` chooses it.

        Args:
            split: `rx_elements`, `subcarriers` and unordered `device_pairs`; of captures also
                `unmeasured_subcarriers`.
            layout: Antenna elements and the links that exist.
            num_subcarriers: Subcarriers of the radio.
        """
        subcarriers = np.ones(num_subcarriers, dtype=bool)
        subcarriers[list(split["subcarriers"])] = False
        unmeasured = np.zeros(num_subcarriers, dtype=bool)
        unmeasured[list(split.get("unmeasured_subcarriers", ()))] = True
        column = np.zeros(layout.measured.shape, dtype=bool)
        column[:, list(split["rx_elements"])] = True
        pair = np.zeros(layout.measured.shape, dtype=bool)
        for a, b in split["device_pairs"]:
            pair |= layout.links_between(a, b) | layout.links_between(b, a)
        return HeldOut(
            links=layout.measured & ~pair & ~column,
            subcarriers=subcarriers & ~unmeasured,
            pair_links=layout.measured & pair,
            element_links=layout.measured & ~pair & column,
            unmeasured=unmeasured,
        )

    @property
    def element(self) -> Bool[np.ndarray, "tx rx subcarrier"]:
        """Held-out array columns, at training subcarriers."""
        return self.element_links[:, :, None] & self.subcarriers

    @property
    def subcarrier(self) -> Bool[np.ndarray, "tx rx subcarrier"]:
        """Held-out subcarriers, at training elements."""
        hidden = ~self.subcarriers
        if self.unmeasured is not None:
            hidden = hidden & ~self.unmeasured
        return self.links[:, :, None] & hidden

    @property
    def visible(self) -> Bool[np.ndarray, "tx rx subcarrier"]:
        """Measured entries that training may see."""
        return self.links[:, :, None] & self.subcarriers
