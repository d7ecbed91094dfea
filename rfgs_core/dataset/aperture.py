# SPDX-License-Identifier: Apache-2.0
"""A synthetic aperture as one array: the places of an antenna that moves, side by side.

Everything that fits, predicts and judges knows channels as (tx, rx, subcarrier). Of antennas that
move within a frame, each place becomes an element of its own, and a link exists between
elements of the same place alone. Antennas that stand still are what they were.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Complex64

from rfgs_core.dataset.observed import Observed, observed_packets
from rfgs_core.radio import Layout

if TYPE_CHECKING:
    from rfgs_core.dataset.sequence import Sequence


def whole_layout(sequence: Sequence, radio: str, *, coherent: bool = True) -> Layout:
    """Every element of a radio, at every place.

    Args:
        sequence: The data.
        radio: Which radio.
        coherent: Places of antennas that move share a device, since their oscillator does; else
            each is a device of its own, all of whose links exist, as interpolation over the links
            of a device needs it.
    """
    spec = sequence.radio_spec(radio)
    if not spec.antennas_move:
        return sequence.layout(radio)
    places = [sequence.layout(radio, sample) for sample in range(spec.samples_per_frame)]
    links = np.zeros([sum(p.measured.shape[axis] for p in places) for axis in (0, 1)], bool)
    for number, place in enumerate(places):
        num_tx, num_rx = place.measured.shape
        links[number * num_tx : (number + 1) * num_tx, number * num_rx : (number + 1) * num_rx] = (
            place.measured
        )
    joined = {
        name: np.concatenate([getattr(place, name) for place in places])
        for name in Layout.__dataclass_fields__
        if name not in ("measured", "tx_site", "rx_site")
    }
    sites = {
        name: np.concatenate(
            [getattr(p, name) + n * (1 + getattr(p, name).max()) for n, p in enumerate(places)]
        )
        for name in ("tx_site", "rx_site")
    }
    if not coherent:
        for name in ("tx_device", "rx_device"):
            sizes = [len(getattr(place, name)) for place in places]
            joined[name] = np.repeat(np.arange(len(places)), sizes)
    return Layout(**joined, **sites, measured=links)


def whole_packets(
    sequence: Sequence, radio: str, frame: int, channel: Observed, count: int | None = None
) -> Complex64[np.ndarray, "packet tx rx subcarrier"]:
    """Channels of a frame as `observed_packets` gives them, over all places.

    Antennas that move send one packet from each place, so there is one channel of all places.

    Args:
        sequence: The data.
        radio: Which radio.
        frame: Which frame.
        channel: The traced channel, or what imperfect radios make of it.
        count: Packets of antennas that stand still; None reads all.
    """
    if not sequence.radio_spec(radio).antennas_move:
        return observed_packets(sequence, radio, frame, channel, count)
    return _joined(observed_packets(sequence, radio, frame, channel))[None]


def whole_csi(
    sequence: Sequence, radio: str, frame: int, channel: Observed = "clean"
) -> Complex64[np.ndarray, "tx rx subcarrier"]:
    """Channel at a frame's own time over all places."""
    return whole_packets(sequence, radio, frame, channel, 1)[0]


def whole_static(sequence: Sequence, radio: str) -> Complex64[np.ndarray, "tx rx subcarrier"]:
    """Channel without anything that moves over all places."""
    if not sequence.radio_spec(radio).antennas_move:
        return sequence.csi_static(radio)
    return _joined(sequence.csi_static_samples(radio))


def _joined(
    samples: Complex64[np.ndarray, "sample tx rx subcarrier"],
) -> Complex64[np.ndarray, "tx rx subcarrier"]:
    """Channels of each place on the diagonal of one array, zero between places."""
    count, num_tx, num_rx, bins = samples.shape
    whole = np.zeros((count, num_tx, count, num_rx, bins), samples.dtype)
    whole[np.arange(count), :, np.arange(count)] = samples
    return whole.reshape(count * num_tx, count * num_rx, bins)
