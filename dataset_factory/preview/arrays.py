# SPDX-License-Identifier: Apache-2.0
"""What an array hears over delay: by angle of arrival, or antenna by antenna if they are far apart.

Antennas more than a wavelength apart have no single direction that a beam points to, and those
along a wall see a person from many sides; over such an array a scatterer draws a curve.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rfgs_core.dataset import Sequence
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.delay import delay_profile, hann_to_zero, path_lengths_m
from rfgs_core.radio.layout import rotation

#: Interpolation of delays between the band's own bins.
OVERSAMPLING = 8
#: Truth over images.
TRUTH_COLOUR = "#4dd2ff"


def has_beam(sequence: Sequence, radio: str) -> bool:
    """Whether the receiving antennas are near enough to each other for an angle of arrival."""
    spec = sequence.radio_spec(radio)
    return spec.rx_spacing_m <= spec.wavelength_m


def across_label(sequence: Sequence, radio: str) -> str:
    """What the second axis of `delay_image` is."""
    beam = has_beam(sequence, radio)
    return "angle from boresight [°]" if beam else "antenna, from the device's middle [m]"


def delay_image(
    sequence: Sequence, radio: str, value: np.ndarray, pair: tuple[int, int]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Power over angle, or over antennas that are far apart, and path length.

    Returns:
        Power (across, delay), angles [°] or places of antennas [m], and path lengths [m].
    """
    if has_beam(sequence, radio):
        return delay_angle(sequence, radio, value, pair)
    block = sequence.layout(radio).block_of(*pair)
    profile, length_m = responses(sequence, radio, value[block])
    place_m = _local(sequence, radio, pair[1])[:, 1]
    order = np.argsort(place_m)
    return (np.abs(profile) ** 2).sum(axis=0)[order], place_m[order], length_m


def draw_scatterer(
    axis: Any, sequence: Sequence, radio: str, pair: tuple[int, int], point: np.ndarray
) -> None:
    """Marks where a single scatterer [m] appears in a `delay_image`: a cross, or its curve."""
    if has_beam(sequence, radio):
        where = seen_from(sequence, radio, pair, point)
        axis.plot(*where, "x", color=TRUTH_COLOUR, ms=7, mew=1.8)
        return
    layout = sequence.layout(radio)
    place_m = _local(sequence, radio, pair[1])[:, 1]
    order = np.argsort(place_m)
    back = np.linalg.norm(layout.rx_xyz[layout.rx_device == pair[1]] - point, axis=1)
    out = np.linalg.norm(point - layout.centres_of(*pair)[0])
    axis.plot(place_m[order], (out + back)[order], "--", color=TRUTH_COLOUR, lw=1)


def delay_angle(
    sequence: Sequence, radio: str, value: np.ndarray, pair: tuple[int, int]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Power over angle and path length at one receiving device, from one transmitting device.

    Bartlett: P(θ, τ) = Σ_rows,tx |Σ_columns h_c(τ) e^{−jk y_c sin θ}|² with y_c the column's
    position along the device's y axis; angles count from the boresight towards +y.

    Returns:
        Power (angle, delay), angles [°] and path lengths [m].
    """
    layout, spec = sequence.layout(radio), sequence.radio_spec(radio)
    profile, length_m = responses(sequence, radio, value[layout.block_of(*pair)])
    local = _local(sequence, radio, pair[1])
    angle_deg = np.linspace(-90.0, 90.0, 181)
    turn = np.sin(np.deg2rad(angle_deg))[:, None] * local[:, 1]
    steering = np.exp(-2j * np.pi * spec.centre_hz / SPEED_OF_LIGHT * turn)
    power = np.zeros((len(angle_deg), len(length_m)))
    heights = np.round(local[:, 2], 6)
    for height in np.unique(heights):
        row = heights == height
        beams = np.einsum("ar,trd->tad", steering[:, row], profile[:, row])
        power += (np.abs(beams) ** 2).sum(axis=0)
    return power, angle_deg, length_m


def responses(sequence: Sequence, radio: str, links: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Hann-windowed impulse responses up to twice the scene's diagonal.

    Returns:
        Responses (..., delay) and path lengths [m].
    """
    spec = sequence.radio_spec(radio)
    window = hann_to_zero(spec.num_subcarriers)
    # The first subcarrier's own phase is kept, so responses stay comparable between elements.
    response = delay_profile(links, window, OVERSAMPLING, peak=True) / window.sum()
    length_m = path_lengths_m(spec, OVERSAMPLING)
    carrier = 2 * np.pi * spec.freq_hz[0] / SPEED_OF_LIGHT
    response = response * np.exp(1j * carrier * length_m)
    diagonal = float(np.linalg.norm(sequence.bounds_m[1] - sequence.bounds_m[0]))
    keep = length_m <= 2 * diagonal
    return response[..., keep], length_m[keep]


def seen_from(
    sequence: Sequence, radio: str, pair: tuple[int, int], point: np.ndarray
) -> tuple[float, float]:
    """Angle [°] and path length [m] of a single scatterer."""
    layout, device = sequence.layout(radio), sequence.devices(radio)[pair[1]]
    local = (point - np.asarray(device.position_m)) @ rotation(device.quat_wxyz)
    away = np.linalg.norm(local)
    out = np.linalg.norm(point - layout.centres_of(*pair)[0])
    return float(np.rad2deg(np.arcsin(local[1] / away))), float(away + out)


def _local(sequence: Sequence, radio: str, receiver: int) -> np.ndarray:
    """A device's receiving antennas in its own axes [m], shape (rx, 3)."""
    layout, device = sequence.layout(radio), sequence.devices(radio)[receiver]
    xyz = layout.rx_xyz[layout.rx_device == receiver]
    return (xyz - np.asarray(device.position_m)) @ rotation(device.quat_wxyz)
