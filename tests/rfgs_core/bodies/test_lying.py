# SPDX-License-Identifier: Apache-2.0
"""Who lies is found where they do, though a column was found elsewhere; nobody else lies."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from lit_bodies import echoing

from rfgs_core.articulated import facets_of, people
from rfgs_core.bodies import posture, start
from rfgs_core.bodies.body_prior import Bodies, surface_prior
from rfgs_core.bodies.localise import locate_bodies, pair_maps
from rfgs_core.bodies.lying import with_lying
from rfgs_core.measure.observations import Observations
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.settings import TrainConfig
from rfgs_core.skeleton import JOINTS
from rfgs_core.worlds.motion import random_motion

ROOM_M = np.array([[0.0, 0.0, 0.0], [4.4, 4.0, 2.5]])
MIDDLE = np.array([2.2, 1.9])


@pytest.fixture(autouse=True)
def fewer_entries(monkeypatch: pytest.MonkeyPatch) -> None:
    """A sixth of the entries, fewer Gaussians and wider cells tell who lies in small rooms."""
    monkeypatch.setattr(posture, "ENTRIES", posture.ENTRIES // 6)
    monkeypatch.setattr(start, "CELL_M", 1.5 * start.CELL_M)
    monkeypatch.setattr(posture, "GAUSSIANS", 500)


def lying(way_rad: float, height_m: float = 0.13) -> Bodies:
    return Bodies(MIDDLE[None], np.array([np.nan]), np.array([[way_rad, height_m]]))


def told(seen: Observations, axes_xy: np.ndarray | None = None) -> Bodies:
    maps = pair_maps(seen)
    found = locate_bodies(maps, seen.bounds_m, 1) if axes_xy is None else axes_xy
    return with_lying(seen, maps, found, TrainConfig(), 0)


def turned(way_rad: float, true_rad: float) -> float:
    """Least turn between two directions."""
    return abs((way_rad - true_rad + np.pi) % (2 * np.pi) - np.pi)


def test_a_lying_body_is_dense_along_its_line_and_faces_away_from_it() -> None:
    body = lying(0.5 * np.pi)
    along = np.append(MIDDLE, 0.2) + np.array([[0.0, y, 0.0] for y in (-0.6, 0.0, 0.6)])
    beyond = np.append(MIDDLE, 0.2) + np.array([[0.0, 1.2, 0.0], [0.6, 0.0, 0.0]])
    log, normals = surface_prior(along, body)
    assert log.min() > surface_prior(beyond, body)[0].max() + 3.0
    np.testing.assert_allclose(normals, np.tile([0.0, 0.0, 1.0], (3, 1)), atol=1e-9)
    assert body.lies.all() and not body.sits.any() and not Bodies.standing(MIDDLE[None]).lies.any()


@pytest.mark.parametrize(("way", "height"), [(0.25 * np.pi, 0.13), (1.5 * np.pi, 0.6)])
def test_who_lies_is_found_where_they_do(
    make_observations: Callable[..., Observations], way: float, height: float
) -> None:
    seen = echoing(make_observations(bounds_m=ROOM_M), lying(way, height), seed=3)
    ahead = np.array([np.cos(way), np.sin(way)])
    bodies = told(seen, (MIDDLE + 0.5 * ahead)[None])
    assert bodies.lies.tolist() == [True]
    assert np.linalg.norm(bodies.axes_xy[0] - MIDDLE) < 0.3
    assert turned(bodies.ways[0, 0], way) < 0.5
    assert bodies.ways[0, 1] == height


@pytest.mark.parametrize("knees", [np.nan, 1.5 * np.pi])
def test_who_stands_or_sits_does_not_lie(
    make_observations: Callable[..., Observations], knees: float
) -> None:
    upright = Bodies(MIDDLE[None], np.array([knees]))
    seen = echoing(make_observations(bounds_m=ROOM_M), upright, seed=3)
    bodies = told(seen)
    assert bodies.lying is None
    np.testing.assert_array_equal(bodies.axes_xy, locate_bodies(pair_maps(seen), ROOM_M, 1))


@pytest.mark.parametrize("change", ["no phases", "asked to stand"])
def test_everybody_stands_where_nothing_is_told(
    make_observations: Callable[..., Observations], change: str
) -> None:
    seen = echoing(make_observations(bounds_m=ROOM_M), lying(0.0), seed=3)
    maps, config = pair_maps(seen), TrainConfig()
    if change == "no phases":
        seen = replace(seen, kind="power")
    else:
        config = TrainConfig(posture="standing")
    assert with_lying(seen, maps, MIDDLE[None], config, 0).lying is None


def test_a_body_of_skin_is_found_on_the_floor(
    make_observations: Callable[..., Observations],
) -> None:
    """A posed skin of thousands of triangles, which knows nothing of limbs with a deviation."""
    rng = np.random.default_rng(5)
    body = people().body(np.zeros(0))
    motion = random_motion(rng, body, "lie")
    skin = body.skin(motion.at(0.5 * motion.duration_s))
    joints = body.joints17(motion.at(0.5 * motion.duration_s))
    skin += [*(MIDDLE - joints[0, :2]), 0.01 - skin[:, 2].min()]
    ahead = joints[JOINTS.index("head")] - joints[0]
    seen = of_skin(make_observations(bounds_m=ROOM_M), skin, body.faces, rng)
    bodies = told(seen)
    assert bodies.lies.tolist() == [True]
    assert np.linalg.norm(bodies.axes_xy[0] - MIDDLE) < 0.35
    assert turned(bodies.ways[0, 0], np.arctan2(ahead[1], ahead[0])) < 0.6


def of_skin(
    empty: Observations, skin: np.ndarray, faces: np.ndarray, rng: np.random.Generator
) -> Observations:
    """Facets of random phases, by area; an antenna behind a facet neither lights nor hears it."""
    centres, normals, area = facets_of(skin, faces)
    some = rng.choice(len(area), 500, p=area / area.sum())
    centres, normals = centres[some], normals[some]
    k = 2 * np.pi * empty.freq_hz / SPEED_OF_LIGHT
    legs = []
    for xyz in (empty.layout.tx_xyz, empty.layout.rx_xyz):
        towards = xyz - centres[:, None]
        distance = np.linalg.norm(towards, axis=2)
        facing = np.maximum(np.einsum("mac,mc->ma", towards, normals) / distance, 0.0) / distance
        legs.append(facing[..., None] * np.exp(-1j * k * distance[..., None]))
    gamma = rng.standard_normal(len(some)) + 1j * rng.standard_normal(len(some))
    delta = np.einsum("m,mtf,mrf->trf", gamma, *legs)
    return empty.with_delta(delta * empty.links[..., None])
