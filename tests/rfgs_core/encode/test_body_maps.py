# SPDX-License-Identifier: Apache-2.0
"""Beam–range maps of a single scatterer, whose echo is known in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rfgs_core.encode.body_maps import (
    AZIMUTHS,
    ELEVATIONS,
    Ranges,
    body_maps,
    views_of,
)
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.layout import DevicePose, Layout, layout
from rfgs_core.radio.presets import preset

CENTRE = np.array([0.1, -0.2, 0.95])


def devices(name: str) -> tuple[Layout, np.ndarray]:
    """Two devices that look at each other across a room."""
    radio = preset(name)
    poses = [
        DevicePose("a", (-2.5, -0.5, 1.3), (1.0, 0.0, 0.0, 0.0)),
        DevicePose("b", (2.0, 1.5, 2.1), (0.0, 0.0, 0.0, 1.0)),
    ]
    return layout(radio, poses), radio.freq_hz


def echo(placed: Layout, freq_hz: np.ndarray, point: np.ndarray, amplitude: float) -> np.ndarray:
    """Channel of a point that scatters alike in all directions."""
    d_t = np.linalg.norm(placed.tx_xyz - point, axis=1)[:, None, None]
    d_r = np.linalg.norm(placed.rx_xyz - point, axis=1)[None, :, None]
    wave = np.exp(-2j * np.pi * freq_hz / SPEED_OF_LIGHT * (d_t + d_r))
    return amplitude / (4 * np.pi * d_t * d_r) * wave


@pytest.mark.parametrize("name", ["mmwave", "wifi"])
def test_a_point_at_the_centre_shows_its_amplitude(name: str) -> None:
    placed, freq_hz = devices(name)
    everything = np.ones(len(freq_hz), dtype=bool)
    change = echo(placed, freq_hz, CENTRE, 0.3)
    maps = body_maps(change, placed, placed.measured, freq_hz, everything, CENTRE)
    assert len(maps) == len(views_of(placed, placed.measured)) == (2 if name == "mmwave" else 4)
    middle = maps[:, len(ELEVATIONS) // 2, len(AZIMUTHS) // 2]
    # The ranges next to the centre are half a step off it, which a Hann window hardly sees.
    np.testing.assert_allclose(middle.max(axis=1), 0.3**2, rtol=0.15)
    assert (middle.max(axis=1) >= 0.999 * maps.max(axis=(1, 2, 3))).all()


def test_offsets_in_range_and_direction_move_the_peak() -> None:
    placed, freq_hz = devices("mmwave")
    everything = np.ones(len(freq_hz), dtype=bool)
    view = views_of(placed, placed.measured)[0]
    ranges = Ranges.of_band(freq_hz)
    towards = (CENTRE - view.rx.centre) / np.linalg.norm(CENTRE - view.rx.centre)
    further = CENTRE + 0.3 * towards
    change = echo(placed, freq_hz, further, 1.0)
    found = body_maps(change, placed, placed.measured, freq_hz, everything, CENTRE)[0]
    peak = np.unravel_index(found.argmax(), found.shape)
    assert ranges.offsets_m[peak[2]] == pytest.approx(0.6, abs=0.5 * ranges.step_m + 1e-9)
    # A beam is 0.15 of a direction cosine: move the point by two beams along the device's own y.
    distance = np.linalg.norm(CENTRE - view.rx.centre)
    aside = CENTRE + 2 * 0.15 * distance * view.rx.axes[0]
    change = echo(placed, freq_hz, aside, 1.0)
    found = body_maps(change, placed, placed.measured, freq_hz, everything, CENTRE)[0]
    peak = np.unravel_index(found.argmax(), found.shape)
    assert AZIMUTHS[peak[1]] == pytest.approx(0.3)


def test_hidden_links_and_subcarriers_do_not_count() -> None:
    placed, freq_hz = devices("wifi")
    change = echo(placed, freq_hz, CENTRE, 1.0)
    links = placed.measured.copy()
    links[:, placed.rx_column >= 6] = False
    links[placed.links_between(0, 1)] = False
    subcarriers = np.ones(len(freq_hz), dtype=bool)
    subcarriers[40:48] = False
    wrong = np.where(links[..., None] & subcarriers, change, 1e3)
    one, two = (
        body_maps(values, placed, links, freq_hz, subcarriers, CENTRE) for values in (change, wrong)
    )
    np.testing.assert_array_equal(one, two)
    assert [view.pair for view in views_of(placed, links)] == [(0, 0), (1, 0), (1, 1)]


def test_a_turned_world_has_the_same_maps() -> None:
    placed, freq_hz = devices("wifi")
    everything = np.ones(len(freq_hz), dtype=bool)
    point = CENTRE + np.array([0.2, 0.1, 0.3])
    straight = body_maps(
        echo(placed, freq_hz, point, 1.0), placed, placed.measured, freq_hz, everything, CENTRE
    )
    # A quarter turn around z: (x, y) becomes (-y, x).
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    half = np.sqrt(0.5)

    def turned(quats: np.ndarray) -> np.ndarray:
        w, x, y, z = quats.T
        return half * np.stack([w - z, x - y, x + y, w + z], axis=1)

    moved = replace(
        placed,
        tx_xyz=placed.tx_xyz @ turn.T,
        rx_xyz=placed.rx_xyz @ turn.T,
        tx_quat_wxyz=turned(placed.tx_quat_wxyz),
        rx_quat_wxyz=turned(placed.rx_quat_wxyz),
    )
    change = echo(moved, freq_hz, turn @ point, 1.0)
    got = body_maps(change, moved, moved.measured, freq_hz, everything, turn @ CENTRE)
    np.testing.assert_allclose(got, straight, rtol=1e-5, atol=1e-9)
