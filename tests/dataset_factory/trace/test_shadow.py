# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import numpy as np
import pytest
import trimesh
from antennas import one_device

from rfgs_core.radio import Layout
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.simulate.paths.path_set import PathSet
from rfgs_core.simulate.shadow.kirchhoff import transmission
from rfgs_core.simulate.shadow.outline import Outline, ShadowMesh, coarse_mesh

FREQ_HZ = np.array([5.8e9])
D_1, D_2 = 2.5, 3.5
PER_M = np.sqrt(2.0 * (1 / D_1 + 1 / D_2) * FREQ_HZ[0] / SPEED_OF_LIGHT)


def line_of_sight(tx: np.ndarray, rx: np.ndarray, elements: np.ndarray) -> tuple[PathSet, Layout]:
    """One direct path between a transmitter and an array around `rx`."""
    zero = np.zeros(1, np.int64)
    vertices = np.stack([tx, rx])[None].astype(np.float64)
    none = np.zeros((1, 0), np.int64)
    paths = PathSet(zero, zero, np.ones((1, 1, 1), np.complex128), vertices, none, none, none)
    return paths, one_device(tx[None].astype(float), rx + elements)


def screen(low: float, high: float) -> tuple[np.ndarray, np.ndarray]:
    """A wide upright screen between two heights at D_1 from the transmitter."""
    vertices = np.array([[D_1, -60, low], [D_1, 60, low], [D_1, 60, high], [D_1, -60, high]])
    return vertices, np.array([[0, 1, 2], [0, 2, 3]])


def shaded(
    paths: PathSet, layout: Layout, body: tuple[np.ndarray, np.ndarray], mode: str = "kirchhoff"
) -> np.ndarray:
    everywhere = np.ones((len(paths), paths.vertices.shape[1] - 1), bool)
    passed = transmission(
        paths, layout, [Outline(body[0], ShadowMesh.of(body[1]), everywhere)], FREQ_HZ, mode
    )
    out = np.ones((len(paths), *passed.factor.shape[1:]), np.complex128)
    out[passed.path] = passed.factor
    return out


def factor(body: tuple[np.ndarray, np.ndarray], mode: str = "kirchhoff") -> complex:
    ends = np.zeros(3), np.array([D_1 + D_2, 0.0, 0.0])
    paths, layout = line_of_sight(*ends, np.zeros((1, 3)))
    return complex(shaded(paths, layout, body, mode)[0, 0, 0, 0])


def test_half_plane_at_grazing_costs_six_db() -> None:
    assert 20 * np.log10(abs(factor(screen(-60.0, 0.0)))) == pytest.approx(-6.02, abs=0.1)


@pytest.mark.parametrize("nu", [-0.7, -0.3, 0.0, 0.5, 1.0, 1.5, 2.0, 2.4])
def test_knife_edge_follows_itu_r_p526(nu: float) -> None:
    # Equation 31 of ITU-R P.526-15, itself an approximation good to a few tenths of a decibel.
    loss_db = 6.9 + 20 * np.log10(np.sqrt((nu - 0.1) ** 2 + 1) + nu - 0.1)
    found = -20 * np.log10(abs(factor(screen(-60.0, nu / PER_M))))
    assert found == pytest.approx(loss_db, abs=0.35)


def test_screen_plus_its_gap_are_free_space() -> None:
    # Babinet: what a screen lets past and what its complement lets past add up to one.
    upper, lower = factor(screen(-60.0, 0.13)), factor(screen(0.13, 60.0))
    assert abs(upper + lower - 1.0) < 1e-3


def test_far_screen_changes_nothing() -> None:
    assert factor(screen(-60.0, -8.0)) == 1.0


def test_hard_shadow_is_all_or_nothing() -> None:
    assert factor(screen(-60.0, 0.01), "hard") == 0.0
    assert factor(screen(-60.0, -0.01), "hard") == 1.0


def test_elements_see_the_shadow_from_where_they_are() -> None:
    tx, rx = np.zeros(3), np.array([D_1 + D_2, 0.3, 0.1])
    offsets = np.array([[0.0, -0.1, -0.1], [0.0, 0.1, 0.1], [0.0, 0.0, 0.12]])
    vertices, faces = screen(-1.7, 0.02)
    body = (vertices * [1.0, 0.005, 1.0], faces)
    paths, layout = line_of_sight(tx, rx, offsets)
    together = shaded(paths, layout, body)[0, 0, :, 0]
    for offset, value in zip(offsets, together, strict=True):
        alone, place = line_of_sight(tx, rx + offset, np.zeros((1, 3)))
        exact = shaded(alone, place, body)[0, 0, 0, 0]
        assert abs(value - exact) < 0.02


def test_reflected_path_is_shaded_on_its_unfolded_line() -> None:
    # A mirror folds the line half way; the same screen before or after it shades alike.
    tx, corner, rx = np.zeros(3), np.array([3.0, 0.0, 0.0]), np.array([3.0, 3.0, 0.0])
    zero, kind = np.zeros(1, np.int64), np.ones((1, 1), np.int64)
    vertices = np.stack([tx, corner, rx])[None]
    paths = PathSet(zero, zero, np.ones((1, 1, 1), np.complex128), vertices, kind, kind, kind)
    layout = one_device(tx[None], rx[None])
    wide = np.array([[-1.0, -4.0], [1.0, -4.0], [1.0, 0.07], [-1.0, 0.07]])
    middle = [np.stack([np.full(4, D_1), wide[:, 0], wide[:, 1]], axis=1)]
    middle.append(np.stack([3.0 + wide[:, 0], np.full(4, 6.0 - D_1 - 3.0), wide[:, 1]], axis=1))
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    first, second = (shaded(paths, layout, (body, faces))[0, 0, 0, 0] for body in middle)
    straight_paths, straight_layout = line_of_sight(tx, np.array([6.0, 0.0, 0.0]), np.zeros((1, 3)))
    straight = [
        shaded(straight_paths, straight_layout, (body, faces))
        for body in (middle[0], middle[0] + [6.0 - D_1 - 3.0 + 3.0 - D_1, 0.0, 0.0])
    ]
    assert first == pytest.approx(straight[0][0, 0, 0, 0], abs=1e-6)
    assert second == pytest.approx(straight[1][0, 0, 0, 0], abs=1e-6)
    assert abs(first) < 0.9


def test_coarse_mesh_keeps_the_outline() -> None:
    ball = trimesh.creation.icosphere(subdivisions=5, radius=0.2)
    kept, mesh = coarse_mesh(ball.vertices, ball.faces)
    faces = mesh.faces
    assert len(faces) < 0.5 * len(ball.faces)
    fine = (np.asarray(ball.vertices) + np.array([D_1, 0.1, 0.2]), np.asarray(ball.faces))
    assert abs(factor((fine[0][kept], faces)) - factor(fine)) < 0.01
