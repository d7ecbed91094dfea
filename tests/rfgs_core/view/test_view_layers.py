# SPDX-License-Identifier: Apache-2.0
"""Ray paths and coverage: closed forms in an empty box, shadows behind a wall, stored paths."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

import numpy as np
import pytest

from rfgs_core.dataset import Sequence, open_dataset
from rfgs_core.dataset.mesh_ply import write_mesh
from rfgs_core.dataset.path_store import write_paths
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.images import SCATTERING, SPECULAR
from rfgs_core.radio.path_table import PathTable
from rfgs_core.view.coverage import HEIGHT_M, coverage_of
from rfgs_core.view.layer_colors import coverage_picture, layers_html
from rfgs_core.view.rays import MORE, ONE, PEOPLE, STRAIGHT, follows_frames, rays_of


@pytest.fixture
def boxed(tiny_dataset: Path) -> Sequence:
    """Four devices in the corners of an empty box."""
    return open_dataset(tiny_dataset).sequence()


@pytest.fixture
def walled(tiny_dataset: Path, tmp_path: Path) -> Sequence:
    """The same box, cut in two at x = 1.52 m, up to the ceiling."""
    shutil.copytree(tiny_dataset, tmp_path / "walled")
    sequence = open_dataset(tmp_path / "walled").sequence()
    vertices, faces = sequence.static_mesh()
    wall = np.array([[1.52, y, z] for y in (0.0, 3.0) for z in (0.0, 2.5)], np.float32)
    more = np.array([[0, 1, 2], [1, 3, 2]], np.int32) + len(vertices)
    write_mesh(
        sequence.files.static_mesh, np.concatenate([vertices, wall]), np.concatenate([faces, more])
    )
    return sequence


def test_coverage_of_an_empty_box_is_the_radar_equation(boxed: Sequence) -> None:
    found = coverage_of(boxed, "wifi")
    assert found is not None and found.floor_m == 0.0
    spec, layout = boxed.radio_spec("wifi"), boxed.layout("wifi")
    row, column = 7, 4
    place = np.array([found.x_m[row], found.y_m[column], HEIGHT_M])
    total = 0.0
    for a, b in layout.device_pairs:
        tx, rx = layout.centres_of(a, b)
        spread = math.dist(tx, place) ** 2 * math.dist(rx, place) ** 2
        total += (SPEED_OF_LIGHT / spec.centre_hz) ** 2 / ((4.0 * math.pi) ** 3 * spread)
    assert found.power_db[row, column] == pytest.approx(10.0 * math.log10(total), abs=1e-9)
    (west, east), (south, north) = found.edges_m
    assert (west, east, south, north) == pytest.approx((0.0, 3.0, 0.0, 3.0))


def test_links_across_a_wall_hear_nothing(boxed: Sequence, walled: Sequence) -> None:
    free, cut = coverage_of(boxed, "wifi"), coverage_of(walled, "wifi")
    assert free is not None and cut is not None
    assert (cut.power_db < free.power_db).all()
    layout, found = walled.layout("wifi"), 0.0
    place = np.array([cut.x_m[2], cut.y_m[5], HEIGHT_M])
    for pair in layout.device_pairs:
        ends = layout.centres_of(*pair)
        if all(end[0] < 1.5 for end in ends):
            found += 1.0 / np.prod([math.dist(end, place) ** 2 for end in ends])
    factor = (SPEED_OF_LIGHT / walled.radio_spec("wifi").centre_hz) ** 2 / (4.0 * math.pi) ** 3
    assert cut.power_db[2, 5] == pytest.approx(10.0 * math.log10(factor * found), abs=1e-9)


def test_a_map_is_drawn_south_first_and_clear_where_nobody_hears(boxed: Sequence) -> None:
    found = coverage_of(boxed, "wifi")
    assert found is not None
    found.power_db[0, -1] = -np.inf
    picture = coverage_picture(found)
    assert picture.shape[2] == 4 and picture.shape[0] % len(found.y_m) == 0
    assert picture[-1, 0, 3] == 0 and picture[0, 0, 3] == 255 and picture[-1, -1, 3] == 255


def test_ways_in_an_empty_box_are_straight_or_by_one_of_its_sides(boxed: Sequence) -> None:
    found = rays_of(boxed, "wifi", boxed.frames[0])
    assert found is not None and not found.traced and not follows_frames(boxed, "wifi")
    pairs = len(boxed.layout("wifi").device_pairs)
    straight = (found.colors == STRAIGHT).all(axis=1)
    assert straight.sum() == pairs
    assert ((found.colors == ONE).all(axis=1) | straight).all()
    assert len(found.segments) == pairs * (1 + 2 * 6)
    bent = found.segments[~straight].reshape(-1, 2, 2, 3)
    at = bent[:, 0, 1]
    np.testing.assert_allclose(at, bent[:, 1, 0])
    low, high = np.asarray(boxed.bounds_m)
    assert (np.minimum(np.abs(at - low), np.abs(at - high)).min(axis=1) < 1e-4).all()


def test_legends_say_what_is_shown(boxed: Sequence) -> None:
    rays, coverage = rays_of(boxed, "wifi", 1), coverage_of(boxed, "wifi")
    assert layers_html(None, None) == ""
    assert "found by mirrors" in layers_html(rays, None)
    text = layers_html(None, coverage)
    assert "echo of 1 m²" in text and text.count("dB") == 2 and "Ray paths" not in text


def test_stored_paths_are_drawn_by_what_they_met(tiny_dataset: Path, tmp_path: Path) -> None:
    """Straight, by a wall, by two, by a person, and one too weak to be drawn."""
    shutil.copytree(tiny_dataset, tmp_path / "traced")
    sequence = open_dataset(tmp_path / "traced").sequence()
    kind = np.zeros((5, 2), np.uint8)
    kind[1:3, 0], kind[2, 1], kind[3, 0] = SPECULAR, SPECULAR, SCATTERING
    met = (kind != 0).sum(axis=1)
    corner = np.minimum(np.arange(4), met[:, None] + 1)
    vertices = np.stack([np.arange(5)[:, None] + 0.0 * corner, corner, 0 * corner], axis=2)
    gain = np.array([1.0, 0.5, 0.25, 0.1, 1e-4])
    angles = ("departure_zenith", "departure_azimuth", "arrival_zenith", "arrival_azimuth")
    where = ("tx_site", "rx_site", "tx_device", "rx_device")
    table = PathTable(
        **dict.fromkeys(where, np.zeros(5, np.int32)),
        **dict.fromkeys([f"{name}_rad" for name in angles], np.zeros(5, np.float32)),
        delay_s=np.zeros(5), doppler_hz=np.zeros(5, np.float32), kind=kind,
        amplitude=gain[:, None, None].astype(np.complex64), node_hz=np.array([5.8e9]),
        object=np.zeros((5, 2), np.int32), vertices=vertices.astype(np.float32),
    )  # fmt: skip
    write_paths(sequence.files.paths("wifi", 1), table)
    found = rays_of(sequence, "wifi", 1)
    assert found is not None and found.traced and follows_frames(sequence, "wifi")
    drawn = [
        (colour, int(x), int(y))
        for colour, x, y in zip(
            map(tuple, found.colors.tolist()), *found.segments[:, 0, :2].T, strict=True
        )
    ]
    two, person = [(MORE, 2, k) for k in range(3)], [(PEOPLE, 3, k) for k in range(2)]
    assert drawn == [(STRAIGHT, 0, 0), (ONE, 1, 0), (ONE, 1, 1), *two, *person]
    assert (found.segments[:, 1, 1] - found.segments[:, 0, 1] == 1.0).all()
