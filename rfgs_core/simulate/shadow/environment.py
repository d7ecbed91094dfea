# SPDX-License-Identifier: Apache-2.0
"""From paths of the environment to its channel."""

from __future__ import annotations

import math

import numpy as np

from rfgs_core.radio import Layout, Radio
from rfgs_core.simulate.paths.path_set import PathSet
from rfgs_core.simulate.paths.steering import resampled, steer
from rfgs_core.simulate.shadow.kirchhoff import Passed

#: Above this fractional bandwidth materials are evaluated at several frequencies.
WIDE_BAND = 0.05
#: Fewest frequencies of a wide band.
WIDE_BAND_NODES = 9
#: Largest distance of the frequencies of an ultra-wide band [Hz]: a slab of 3 cm and √ε = 2
#: ripples every 2.5 GHz.
NODE_SPACING_HZ = 0.125e9
#: Frequencies of a narrow band: over 160 MHz at 5.8 GHz a slab of 12.5 mm plasterboard, half a
#: wave thick, changes paths by −37 dB of the channel.
NARROW_BAND_NODES = 3
#: Most that a wave in a slab turns from one frequency to the next [rad]: a straight line between
#: the two is off by 1 − cos(0.14), −40 dB.
NODE_TURN_RAD = 0.28


def node_frequencies(radio: Radio, slab_s: float = 0.0) -> np.ndarray:
    """Frequencies [Hz] between which amplitudes are interpolated, both band edges included.

    Args:
        radio: The radio.
        slab_s: Time that its waves spend in slabs, at most [s], see `Room.slab_delay_s`.
    """
    wide = radio.bandwidth_hz / radio.centre_hz > WIDE_BAND
    count = WIDE_BAND_NODES if wide else NARROW_BAND_NODES
    if radio.ultra_wide:
        count = max(count, math.ceil(radio.bandwidth_hz / NODE_SPACING_HZ) + 1)
    turn_rad = 2.0 * math.pi * radio.bandwidth_hz * slab_s
    count = max(count, math.ceil(turn_rad / NODE_TURN_RAD) + 1)
    return np.linspace(radio.freq_min_hz, radio.freq_max_hz, count)


def path_frequencies(paths: PathSet, radio: Radio) -> np.ndarray:
    """Frequencies [Hz] of the amplitudes of paths from `node_frequencies`, shape (node,)."""
    return np.linspace(radio.freq_min_hz, radio.freq_max_hz, paths.amplitude.shape[2])


def environment_channel(
    paths: PathSet,
    radio: Radio,
    layout: Layout,
    passed: Passed | None = None,
) -> np.ndarray:
    """Channel of the environment, complex128, shape (tx, rx, subcarrier).

    Args:
        paths: Paths of `Environment`.
        radio: The radio they were traced for.
        layout: Antenna elements.
        passed: What bodies leave of some paths; None if there are none.
    """
    nodes_hz = path_frequencies(paths, radio)
    if passed is None:
        channel = steer(paths, layout, radio.freq_hz, nodes_hz)
    else:
        free = np.setdiff1d(np.arange(len(paths)), passed.path)
        channel = steer(paths.select(free), layout, radio.freq_hz, nodes_hz)
        shaded = resampled(paths.select(passed.path), nodes_hz, passed.grid_hz)
        channel += steer(shaded, layout, radio.freq_hz, passed.grid_hz, passed.factor)
    return channel * (radio.centre_hz / radio.freq_hz)


def shadow_channel(paths: PathSet, radio: Radio, layout: Layout, passed: Passed) -> np.ndarray:
    """What shadows change of the environment's channel, complex128, shape (tx, rx, subcarrier).

    Args:
        paths: Paths of the environment.
        radio: The radio they were traced for.
        layout: Antenna elements.
        passed: What bodies leave of some of them.
    """
    shaded = resampled(paths.select(passed.path), path_frequencies(paths, radio), passed.grid_hz)
    channel = steer(shaded, layout, radio.freq_hz, passed.grid_hz, passed.factor, 1.0)
    return channel * (radio.centre_hz / radio.freq_hz)
