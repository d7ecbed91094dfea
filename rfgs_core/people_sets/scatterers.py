# SPDX-License-Identifier: Apache-2.0
"""Heard places as a radar of ours would hear them, since our network reads its channels alone.

A set's points, or the strongest cells of its cubes, become scatterers of random phases in front of
one radar of the preset `mmwave` at the set's own place, each as strong as the set says:

    ΔH[t, r, f] = Σ_i a_i e^{jφ_i} e^{−j2πf(d_ti + d_ri)/c}.

What other antennas, another band and another detector heard is thus given our antennas and band,
not what our radar would have heard: points that were not detected stay silent.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from rfgs_core.encode.body_maps import CENTRE_HEIGHT_M
from rfgs_core.measure.observations import Observations
from rfgs_core.radio import PRESETS, DevicePose, Layout, layout
from rfgs_core.radio.constants import SPEED_OF_LIGHT

#: Points of a frame that count; more are drawn by chance.
MOST_POINTS = 400
#: The radar looks along y.
_ALONG_Y = (np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5))
#: Around the body [m]; only the floor is read.
_BESIDE_M = 2.0


def own_radar() -> Layout:
    """One radar of the preset at the origin, looking along y."""
    return layout(PRESETS["mmwave"], [DevicePose("radar", (0.0, 0.0, 0.0), _ALONG_Y)])


def heard_by_us(
    points: Float64[np.ndarray, "point 3"],
    amplitude: Float64[np.ndarray, "point"],
    centre: Float64[np.ndarray, "3"],
    rng: np.random.Generator,
) -> Observations:
    """A frame of our own radar.

    Args:
        points: Where scatterers are [m].
        amplitude: How strong they are.
        centre: Middle of the body [m]; the floor is `CENTRE_HEIGHT_M` below.
        rng: Draws phases, and points where there are too many.
    """
    elements, freq_hz = own_radar(), PRESETS["mmwave"].freq_hz
    if len(points) > MOST_POINTS:
        chosen = rng.choice(len(points), MOST_POINTS, replace=False)
        points, amplitude = points[chosen], amplitude[chosen]
    phase = np.exp(2j * np.pi * rng.random(len(points)))
    wavenumber = 2.0 * np.pi * freq_hz / SPEED_OF_LIGHT
    ends = [
        np.exp(-1j * wavenumber[:, None, None] * np.linalg.norm(xyz[:, None] - points, axis=2))
        for xyz in (elements.tx_xyz, elements.rx_xyz)
    ]
    change = (ends[0] * (amplitude * phase)) @ ends[1].swapaxes(1, 2)
    delta = np.moveaxis(change, 0, -1).astype(np.complex64)
    low, high = centre - _BESIDE_M, centre + _BESIDE_M
    low[2] = centre[2] - CENTRE_HEIGHT_M
    return Observations(
        delta=delta,
        static=np.zeros_like(delta),
        links=elements.measured,
        subcarriers=np.ones(len(freq_hz), dtype=bool),
        layout=elements,
        freq_hz=np.asarray(freq_hz, np.float64),
        bounds_m=np.array([low, high]),
    )
