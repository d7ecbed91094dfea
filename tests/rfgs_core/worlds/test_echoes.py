# SPDX-License-Identifier: Apache-2.0
"""Maps straight from facets beside those of the channel that the same facets make."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rfgs_core.encode.body_maps import body_maps, views_of
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.delay import band_window, hann
from rfgs_core.radio.layout import DevicePose, Layout, layout
from rfgs_core.radio.presets import preset
from rfgs_core.simulate.surface.facets import facet_sum
from rfgs_core.worlds.echoes import Band, Listener, Seen, mirrored

CENTRE = np.array([0.1, -0.2, 0.95])
SKIN = 0.7


def placed(name: str) -> tuple[Layout, np.ndarray]:
    """Two devices that see a body from one side, none of them behind it."""
    poses = [
        DevicePose("a", (-2.5, -1.5, 1.3), (np.cos(0.2), 0.0, 0.0, np.sin(0.2))),
        DevicePose("b", (-2.2, 1.6, 2.1), (np.cos(-0.3), 0.0, 0.0, np.sin(-0.3))),
    ]
    return layout(preset(name), poses), preset(name).freq_hz


def body(count: int = 300, seed: int = 2) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Facets all over a body-sized ellipsoid."""
    rng = np.random.default_rng(seed)
    away = rng.normal(size=(count, 3))
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    points = CENTRE + away * [0.25, 0.25, 0.85]
    normals = away / [0.25, 0.25, 0.85]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return points, normals, rng.uniform(2e-4, 6e-4, count)


def facing(points: np.ndarray, normals: np.ndarray, place: np.ndarray) -> np.ndarray:
    return np.einsum("ij,ij->i", place - points, normals) > 0.0


@pytest.mark.parametrize(
    ("name", "gap", "tolerance"),
    [("wifi", False, 0.06), ("wifi", True, 0.06), ("mmwave", False, 0.03), ("mmwave", True, 0.03)],
)
def test_maps_of_facets_are_those_of_their_channel(name: str, gap: bool, tolerance: float) -> None:
    """The twin forms the channel at every element.

    Its wave fronts are spherical: k D²/(8R) is 0.2 rad at the edges of 8×8 elements at 5.8 GHz,
    2.6 m away.
    """
    lay, freq_hz = placed(name)
    points, normals, areas = body()
    subcarriers = np.ones(len(freq_hz), dtype=bool)
    if gap:
        subcarriers[5 * len(freq_hz) // 8 : 6 * len(freq_hz) // 8] = False
    views = views_of(lay, lay.measured)
    change = np.zeros((len(lay.tx_xyz), len(lay.rx_xyz), len(freq_hz)), dtype=np.complex128)
    band = Band.of(freq_hz, band_window(subcarriers, hann), SKIN)
    found = []
    for view in views:
        by_tx, by_rx = (facing(points, normals, end.centre) for end in (view.tx, view.rx))
        own = np.ix_(lay.tx_device == view.pair[0], lay.rx_device == view.pair[1])
        tx, rx = lay.tx_xyz[own[0].ravel()], lay.rx_xyz[own[1].ravel()]
        seen = (by_tx & by_rx).astype(np.float64)
        change[own] = SKIN * facet_sum(points, normals, areas, tx, rx, seen, freq_hz)
        listener = Listener.at(CENTRE, view, band)
        out = listener.empty_map()
        listener.add(out, Seen(points, normals, areas, by_tx, by_rx), view.tx, view.rx)
        found.append(np.abs(SKIN * out) ** 2)
    expected = body_maps(change, lay, lay.measured, freq_hz, subcarriers, CENTRE)
    for own, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(
            np.sqrt(own), np.sqrt(other), atol=tolerance * other.max() ** 0.5
        )


def test_a_wall_shows_what_the_mirrored_body_would() -> None:
    """Transmitter and receiver mirrored in a wall hear what they heard of the mirrored body."""
    lay, freq_hz = placed("wifi")
    points, normals, areas = body()
    band = Band.of(freq_hz, band_window(np.ones(len(freq_hz), dtype=bool), hann), SKIN)
    view = views_of(lay, lay.measured)[0]
    listener = Listener.at(CENTRE, view, band)
    tx, rx = (mirrored(end, 1, -2.0) for end in (view.tx, view.rx))
    seen = [facing(points, normals, end.centre) for end in (tx, rx)]
    by_wall = listener.empty_map()
    listener.add(by_wall, Seen(points, normals, areas, *seen), tx, rx)
    flip = np.array([1.0, -1.0, 1.0])
    image = points * flip - [0.0, 4.0, 0.0]
    seen = [facing(image, normals * flip, end.centre) for end in (view.tx, view.rx)]
    of_image = listener.empty_map()
    listener.add(of_image, Seen(image, normals * flip, areas, *seen), view.tx, view.rx)
    np.testing.assert_allclose(by_wall, of_image, atol=1e-9 * np.abs(of_image).max())
    assert np.abs(by_wall).max() > 0.0


def test_a_disc_on_the_line_of_sight_shadows_as_kirchhoff_says() -> None:
    """T − 1 = −(1 − e^{−jπsR²/λ}), s = 1/d_t + 1/d_r, for a disc of radius R across the line."""
    radio = replace(preset("wifi"), tx_offset_m=(0.0, 0.0, 0.0), rx_rows=1, rx_cols=1)
    poses = [
        DevicePose("a", (-3.0, 0.0, 0.95), (1.0, 0.0, 0.0, 0.0)),
        DevicePose("b", (2.0, 0.0, 0.95), (0.0, 0.0, 0.0, 1.0)),
    ]
    lay = layout(radio, poses)
    radius, step = 0.25, 0.005
    side = np.arange(-radius, radius + step, step)
    y, z = (values.ravel() for values in np.meshgrid(side, side))
    inside = y**2 + z**2 <= radius**2
    points = np.column_stack([np.zeros(inside.sum()), y[inside], z[inside] + 0.95])
    normals = np.tile([-1.0, 0.0, 0.0], (len(points), 1))
    areas = np.full(len(points), np.pi * radius**2 / len(points))
    everything = np.ones(radio.num_subcarriers, dtype=bool)
    band = Band.of(radio.freq_hz, band_window(everything, hann), SKIN)
    view = next(v for v in views_of(lay, lay.measured) if v.pair == (0, 1))
    centre = np.array([0.0, 0.0, 0.95])
    listener = Listener.at(centre, view, band)
    out = listener.empty_map()
    lit = np.ones(len(points), dtype=bool)
    listener.add(out, Seen(points, normals, areas, lit, ~lit), view.tx, view.rx)
    wavelength = SPEED_OF_LIGHT / radio.centre_hz
    s = 1 / 3.0 + 1 / 2.0
    lost = abs(1 - np.exp(-1j * np.pi * s * radius**2 / wavelength))
    direct = wavelength / (4 * np.pi * 5.0)
    expected = direct * lost * 4 * np.pi * 3.0 * 2.0
    # No range lies on the path itself: the two next to it are a quarter of a cell away.
    between = np.abs(band.response[len(band.response) // 2 + 8])
    assert SKIN * np.abs(out).max() == pytest.approx(expected * between, rel=0.03)
