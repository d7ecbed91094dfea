# SPDX-License-Identifier: Apache-2.0
"""Random worlds: the same for the same seed, bodies where they should be, sights that agree."""

from __future__ import annotations

from itertools import islice

import numpy as np
import pytest
import torch
import trimesh
from scipy.spatial import KDTree

from rfgs_core.articulated import Body, Pose, facets_of, people
from rfgs_core.limbs.learn import LearnConfig, learn
from rfgs_core.limbs.stream import chunks, next_chunk, pairs_of
from rfgs_core.radio.presets import preset
from rfgs_core.worlds.figure import Figure, look_cell, seen_among
from rfgs_core.worlds.heard import Example, examples
from rfgs_core.worlds.motion import random_motion
from rfgs_core.worlds.room import Room, Sight

WAVELENGTH_M = 0.051


def first(count: int, seed: int, name: str = "mmwave") -> list[Example]:
    return list(islice(examples(preset(name), seed), count))


@pytest.fixture(scope="module")
def walker() -> tuple[Body, Pose]:
    rng = np.random.default_rng(3)
    body = people().random(rng)
    return body, random_motion(rng, body, "walk").at(0.7)


def test_a_seed_is_a_world() -> None:
    one, again, other = first(2, 5), first(2, 5), first(1, 6)
    for a, b in zip(one, again, strict=True):
        np.testing.assert_array_equal(a.maps, b.maps)
        np.testing.assert_array_equal(a.joints, b.joints)
    assert not np.array_equal(one[0].joints, other[0].joints)


@pytest.mark.parametrize("name", ["mmwave", "wifi"])
def test_everybody_is_inside_and_near_the_centre_of_the_maps(name: str) -> None:
    for example in first(24, 1, name):
        assert np.isfinite(example.maps).all() and (example.maps >= 0.0).all()
        assert len(example.maps) == len(example.views)
        middle = example.joints[:, :2].mean(axis=0)
        assert np.linalg.norm(middle - example.centre[:2]) < 0.6
        own = [view.pair[0] == view.pair[1] for view in example.views]
        assert all(own) if name == "mmwave" else not all(own)


def test_facets_cover_the_skin(walker: tuple[Body, Pose]) -> None:
    body, pose = walker
    figure = Figure.of(body, WAVELENGTH_M)
    skin = body.skin(pose)
    centres, _, areas = facets_of(skin, body.faces)
    assert figure.areas_m2.sum() == pytest.approx(areas.sum(), rel=0.03)
    posed = figure.posed(pose)
    gaps = KDTree(centres).query(posed.points)[0]
    assert gaps.max() < 0.06
    # Facets bend with the skin: places on it lie 3 mm apart here.
    on_skin = trimesh.sample.sample_surface(trimesh.Trimesh(skin, body.faces), 200_000, seed=0)[0]
    assert KDTree(on_skin).query(posed.points)[0].max() < 0.01


def through_skin(points: np.ndarray, place: np.ndarray, skin: np.ndarray) -> np.ndarray:
    """Whether the way from each point to a place meets a triangle [T, 3, 3] of the skin."""
    a, u, v = skin[:, 0], skin[:, 1] - skin[:, 0], skin[:, 2] - skin[:, 0]
    out = []
    for point in points:
        way = place - point
        side = np.cross(way, v)
        det = np.einsum("ti,ti->t", u, side)
        inverse = 1.0 / np.where(det == 0.0, np.inf, det)
        back = np.cross(point - a, u)
        x = np.einsum("ti,ti->t", point - a, side) * inverse
        y, at = back @ way * inverse, np.einsum("ti,ti->t", v, back) * inverse
        away = at * np.linalg.norm(way) > 4e-3
        out.append(((x > 0.0) & (y > 0.0) & (x + y < 1.0) & away & (at < 1.0)).any())
    return np.array(out)


def test_a_sight_is_nearly_that_of_rays(walker: tuple[Body, Pose]) -> None:
    """Facets hide each other as the skin does, from near and from far."""
    body, pose = walker
    figure = Figure.of(body, WAVELENGTH_M)
    posed = figure.posed(pose)
    some = slice(None, None, 6)
    skin = body.skin(pose)[body.faces].astype(np.float64)
    cell_m = look_cell(len(posed.points), float(figure.areas_m2.sum()))
    for angle, away_m in zip(np.linspace(0.0, 2 * np.pi, 7)[:-1], (1.0, 3.0) * 3, strict=True):
        across = away_m * np.array([np.cos(angle), np.sin(angle)])
        place = figure.middle(pose) + np.array([*across, 0.6])
        own = seen_among(posed.points, posed.normals, place, cell_m)[some]
        faces = np.einsum("fi,fi->f", place - posed.points, posed.normals)[some] > 0.0
        rays = faces & ~through_skin(posed.points[some], place, skin)
        # Both see most of the half that faces them, and hide an arm behind the trunk.
        assert 0.2 < rays.mean() < 0.5
        assert (own == rays).mean() > 0.93 and (own & ~rays).mean() < 0.03


def test_the_middle_is_the_centroid_of_all_facets(walker: tuple[Body, Pose]) -> None:
    figure = Figure.of(walker[0], WAVELENGTH_M)
    weight = figure.areas_m2 / figure.areas_m2.sum()
    expected = weight @ figure.posed(walker[1]).points
    np.testing.assert_allclose(figure.middle(walker[1]), expected, atol=1e-4)


def test_devices_that_find_no_place_are_no_world() -> None:
    rng = np.random.default_rng(0)
    tiny = Room(np.array([[-0.5, -0.5, 0.0], [0.5, 0.5, 2.5]]), np.zeros((3, 2)))
    radio = preset("mmwave")
    drawn = [Sight.random(rng, radio, tiny, np.zeros(2)) for _ in range(40)]
    # Corners there are always; anywhere else is too near to the person.
    assert any(sight is None for sight in drawn)


@pytest.mark.slow
def test_a_network_learns_from_worlds(tmp_path) -> None:
    """Joint errors in worlds it has not seen fall well below those of an untrained network."""
    radio = preset("mmwave")
    config = LearnConfig(frames=4096, passes=6.0, kept=4096, workers=0)
    learned = learn(radio, config, checkpoint=tmp_path / "state")
    assert learned.progress.frames == 4096 and learned.unseen_m < 0.3
    # The state that was kept goes on without another step being due.
    again = learn(radio, config, checkpoint=tmp_path / "state")
    assert again.progress.frames == 4160


def test_chunks_hold_what_a_step_needs() -> None:
    radio = preset("mmwave")
    chunk = next_chunk(examples(radio, 2), 8, pairs_of(radio))
    assert bool(chunk.packed.there.any(1).all()) and bool(torch.isfinite(chunk.joints).all())
    streamed = next(chunks(radio, 2, "cpu", workers=0))
    assert streamed.joints.shape == (64, 17, 3)
