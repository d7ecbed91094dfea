# SPDX-License-Identifier: Apache-2.0
"""Specular paths against closed forms and against a plain search over every sequence of faces."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
import trimesh

from rfgs_core.radio.images import REFRACTION, SPECULAR
from rfgs_core.simulate.geometry import (
    SpecularPaths,
    faces_of,
    mirror_legs,
    specular_paths,
    surroundings,
)
from rfgs_core.simulate.geometry.bvh import build_bvh
from rfgs_core.simulate.geometry.rays import crossings

ROOM_M = np.array([4.0, 5.0, 2.6])
TX = np.array([0.51, 0.83, 1.23])
RX = np.array([3.27, 4.11, 2.07])
ALL = np.ones((1, 1), dtype=bool)


def box(size: np.ndarray, corner: np.ndarray, subdivisions: int = 0) -> np.ndarray:
    mesh = trimesh.creation.box(size)
    for _ in range(subdivisions):
        mesh = mesh.subdivide()
    return np.asarray(mesh.triangles) + np.asarray(size) / 2 + corner


def room(subdivisions: int = 0) -> list[np.ndarray]:
    return [box(ROOM_M, np.zeros(3), subdivisions)]


def furnished() -> list[np.ndarray]:
    """A room with a cupboard, a table top that is turned, a screen and a small pyramid."""
    turn = trimesh.transformations.rotation_matrix(0.4, [0.1, 0.2, 1.0])
    table = trimesh.transform_points(box([1.2, 0.7, 0.05], [0, 0, 0]).reshape(-1, 3), turn)
    screen = np.array([[[1.5, 2.5, 0.4], [2.6, 2.9, 0.4], [2.6, 2.9, 1.6]]])
    pyramid = trimesh.creation.cone(radius=0.3, height=0.5, sections=5).triangles
    return [
        *room(),
        box([0.5, 1.1, 1.8], [3.4, 1.2, 0.0]),
        table.reshape(-1, 3, 3) + np.array([1.0, 3.3, 0.75]),
        screen,
        np.asarray(pyramid) + np.array([2.2, 1.4, 0.6]),
    ]


def ball() -> np.ndarray:
    round_one = trimesh.creation.icosphere(subdivisions=3, radius=0.4)
    return np.asarray(round_one.triangles) + np.array([2.0, 2.0, 1.0])


def search(meshes: list[np.ndarray], tx=TX, rx=RX, depth: int = 3, **options) -> SpecularPaths:
    mesh = np.repeat(np.arange(len(meshes)), [len(part) for part in meshes])
    faces = faces_of(np.concatenate(meshes), mesh, **options)
    tx, rx = np.atleast_2d(tx), np.atleast_2d(rx)
    return specular_paths(surroundings(faces, tx, rx), np.ones((len(tx), len(rx)), bool), depth)


def lengths(paths: SpecularPaths, tx=TX, rx=RX) -> np.ndarray:
    """Length of each path between two antennas [m]."""
    ends = (np.broadcast_to(end, (len(paths.tx), 1, 3)) for end in (tx, rx))
    first, last = ends
    every = np.concatenate([first, paths.corners, last], axis=1)
    return np.linalg.norm(np.diff(every, axis=1), axis=2).sum(axis=1)


def image_lengths(order: int) -> np.ndarray:
    """Lengths of the image paths of a box room, from the lattice of its images [m]."""
    found = []
    for cells in product(range(-order, order + 1), repeat=3):
        if sum(map(abs, cells)) > order:
            continue
        cell = np.array(cells)
        image = cell * ROOM_M + np.where(cell % 2 == 0, TX, ROOM_M - TX)
        found.append(np.linalg.norm(image - RX))
    return np.sort(found)


@pytest.mark.parametrize("subdivisions", [0, 3])
def test_box_room_has_every_image_path(subdivisions: int) -> None:
    paths = search(room(subdivisions))
    assert len(paths.tx) == 63
    np.testing.assert_allclose(np.sort(lengths(paths)), image_lengths(3), atol=1e-9)
    assert set(paths.kinds.ravel()) == {0, SPECULAR}


def mirror_places(planes: list[tuple[np.ndarray, float]]) -> list[np.ndarray]:
    """Where the way by some mirrors meets them; fewer where it misses one."""
    images = [TX]
    for n, o in planes:
        images.append(images[-1] - 2 * (images[-1] @ n - o) * n)
    corners, target = [], RX
    for (n, o), image in zip(planes[::-1], images[:0:-1], strict=True):
        over, under = image @ n - o, target @ n - o
        if over * under >= 0:
            break
        target = image + (target - image) * over / (over - under)
        corners.insert(0, target)
    return corners


def plain(meshes: list[np.ndarray], depth: int) -> list[tuple]:
    """Every sequence of planes, tried one by one: kinds and corners of the paths."""
    triangles = np.concatenate(meshes)
    a, u, v = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    normals = np.cross(u, v)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    offsets = np.einsum("tx,tx->t", normals, a)
    sign = np.where(normals[np.arange(len(a)), np.argmax(np.abs(normals), axis=1)] < 0, -1, 1)
    keys = np.round(np.c_[normals, offsets] * sign[:, None], 6)
    _, first = np.unique(keys, axis=0, return_index=True)
    planes = [(normals[i], offsets[i]) for i in first]

    def met(start: np.ndarray, end: np.ndarray) -> np.ndarray:
        """Shares of the way at which anything is met, ends included."""
        way = end - start
        across = np.cross(way, v)
        det = np.einsum("tx,tx->t", u, across)
        with np.errstate(all="ignore"):
            p = np.einsum("tx,tx->t", start - a, across) / det
            turned = np.cross(start - a, u)
            q = turned @ way / det
            t = np.einsum("tx,tx->t", v, turned) / det
            inside = (p > -1e-9) & (q > -1e-9) & (p + q < 1 + 1e-9)
        inside &= (t > 1e-7) & (t < 1 + 1e-7)
        return np.unique(np.round(t[inside & (det != 0)], 7))

    found = []
    for count in range(depth + 1):
        for chain in product(range(len(planes)), repeat=count):
            corners = mirror_places([planes[plane] for plane in chain])
            if len(corners) < count:
                continue
            stops, kinds, places = [TX, *corners, RX], [], []
            for i in range(count + 1):
                start, end = stops[i], stops[i + 1]
                shares = met(start, end)
                mirror = i < count
                if mirror and (not len(shares) or abs(shares[-1] - 1) > 1e-6):
                    break
                inner = shares[:-1] if mirror else shares[shares < 1 - 1e-6]
                kinds += [REFRACTION] * len(inner) + [SPECULAR] * mirror
                places += [*(start + s * (end - start) for s in inner), *([end] * mirror)]
            else:
                if len(kinds) <= depth:
                    found.append((tuple(kinds), *np.round(np.ravel(places), 4)))
    return sorted(set(found))


def as_rows(paths: SpecularPaths) -> list[tuple]:
    rows = []
    for kinds, corners in zip(paths.kinds, paths.corners, strict=True):
        count = int((kinds != 0).sum())
        rows.append((tuple(kinds[:count]), *np.round(corners[:count].ravel(), 4)))
    return sorted(rows)


def test_furnished_room_has_the_paths_of_a_plain_search() -> None:
    meshes = furnished()
    found, expected = as_rows(search(meshes)), plain(meshes, 3)
    assert len(expected) > 50
    kinds = {kind for row in expected for kind in row[0]}
    assert kinds == {SPECULAR, REFRACTION}
    assert [row[0] for row in found] == [row[0] for row in expected]
    for ours, theirs in zip(found, expected, strict=True):
        np.testing.assert_allclose(ours[1:], theirs[1:], atol=2e-4)


def test_exchanging_the_ends_reverses_the_paths() -> None:
    meshes = [*furnished(), ball()]
    there, back = search(meshes), search(meshes, RX, TX)
    assert len(there.tx) == len(back.tx) > 50
    ours, theirs = np.sort(lengths(there)), np.sort(lengths(back, RX, TX))
    np.testing.assert_allclose(ours, theirs, atol=1e-9)


def test_a_mirror_point_on_the_rim_of_two_faces_counts_once_both_ways() -> None:
    """Antennas that mirror each other put it exactly where a wall's two parts meet."""
    wall = np.array([[[0, -3, 0], [0, 3, 0], [0, 3, 1.5]], [[0, -3, 0], [0, 3, 1.5], [0, -3, 1.5]]])
    upper = wall + np.array([0.0, 0.0, 1.5])
    lintel = np.array([[[0, -3, 1.5], [0, 3, 1.5], [-0.2, 3, 1.5]]], dtype=float)
    ends = np.array([1.3, 0.7, 1.1]), np.array([1.3, -0.4, 1.9])
    for meshes in ([wall, upper], [upper, wall, lintel], [lintel, wall, upper]):
        for start, end in (ends, ends[::-1]):
            paths = search(meshes, start, end)
            assert sorted((paths.kinds != 0).sum(axis=1)) == [0, 1]


def test_more_samples_on_the_faces_find_nothing_new() -> None:
    meshes = [*furnished(), ball()]
    assert as_rows(search(meshes)) == as_rows(search(meshes, sample_m=0.05))


@pytest.mark.parametrize("depth", [0, 1, 2, 3])
def test_no_path_has_more_interactions_than_asked_for(depth: int) -> None:
    paths = search(furnished(), depth=depth)
    assert paths.kinds.shape[1] == depth
    deep = search(furnished())
    allowed = (deep.kinds != 0).sum(axis=1) <= depth
    np.testing.assert_allclose(np.sort(lengths(paths)), np.sort(lengths(deep)[allowed]))


def test_sheets_between_the_antennas_are_crossed_and_counted() -> None:
    wall = np.array([[[-5, 0, -5], [5, 0, -5], [5, 0, 5]], [[-5, 0, -5], [5, 0, 5], [-5, 0, 5]]])
    for sheets in range(5):
        shifts = [0.4 * i + 0.2 for i in range(sheets)] or [-9.0]
        meshes = [wall + np.array([0.0, shift, 0.0]) for shift in shifts]
        # The way leads through the diagonal that both triangles of each sheet share.
        start, end = np.array([0.1, -1.0, 0.1]), np.array([0.1, 3.0, 0.1])
        straight = search(meshes, start, end).kinds
        straight = straight[(straight != SPECULAR).all(axis=1)]
        assert [int((row == REFRACTION).sum()) for row in straight] == [sheets][: sheets <= 3]


def test_surfaces_laid_on_each_other_count_once() -> None:
    wall = np.array([[[-5, 1, -5], [5, 1, -5], [5, 1, 5]], [[-5, 1, -5], [5, 1, 5], [-5, 1, 5]]])
    start, end = np.array([0.3, 0.0, 0.1]), np.array([0.1, 0.0, 0.4])
    assert len(search([wall, wall[::-1]], start, end).tx) == len(search([wall], start, end).tx) == 2


def test_smaller_faces_than_the_largest_do_not_mirror() -> None:
    """They still stand in the way."""
    meshes = [*room(), box([0.05, 0.05, 0.05], np.array([1.9, 2.4, 1.5]))]
    limited, full = search(meshes, max_faces=6), search(meshes)
    assert 60 <= len(limited.tx) <= len(full.tx)
    assert set(limited.triangles[limited.kinds == SPECULAR]) <= set(range(12))
    assert as_rows(full)[0] in as_rows(limited)


def test_only_wanted_pairs_are_searched() -> None:
    mesh = np.zeros(12, dtype=int)
    faces = faces_of(room()[0], mesh)
    wanted = np.array([[True, False], [True, True]])
    ends = np.stack([TX, RX]), np.stack([RX + 0.1, TX + 0.1])
    paths = specular_paths(surroundings(faces, *ends), wanted)
    pairs, count = np.unique(np.stack([paths.tx, paths.rx]), axis=1, return_counts=True)
    assert pairs.T.tolist() == [[0, 0], [1, 0], [1, 1]]
    assert count.tolist() == [63, 63, 63]


def test_nothing_around_leaves_the_line_of_sight() -> None:
    faces = faces_of(np.zeros((0, 3, 3)), np.zeros(0, dtype=int))
    paths = specular_paths(surroundings(faces, TX[None], RX[None]), ALL)
    assert paths.kinds.tolist() == [[0, 0, 0]]
    assert np.array_equal(paths.corners[0], np.tile(RX, (3, 1)))


def test_a_senseless_depth_is_refused() -> None:
    faces = faces_of(room()[0], np.zeros(12, dtype=int))
    with pytest.raises(ValueError, match="depth 4: expected 0 to 3"):
        specular_paths(surroundings(faces, TX[None], RX[None]), ALL, depth=4)


def test_crossings_are_those_of_a_plain_test() -> None:
    rng = np.random.default_rng(0)
    triangles = rng.uniform(-1, 1, (400, 1, 3)) + rng.normal(0, 0.4, (400, 3, 3))
    bvh = build_bvh(triangles)
    at_m, hit = np.zeros(400), np.zeros(400, dtype=np.int64)
    for _ in range(50):
        start, end = rng.uniform(-2, 2, (2, 3))
        found = crossings(bvh, start, end, 0.0, at_m, hit)
        way = end - start
        a, u, v = triangles[:, 0], *(triangles[:, i] - triangles[:, 0] for i in (1, 2))
        sides = np.stack([u, v, np.broadcast_to(-way, u.shape)], -1)
        shares = np.linalg.solve(sides, (start - a)[..., None])[..., 0]
        p, q, t = shares[..., 0], shares[..., 1], shares[..., 2]
        inside = (p > 0) & (q > 0) & (p + q < 1) & (t > 0) & (t < 1)
        order = np.argsort(t[inside])
        assert hit[:found].tolist() == np.flatnonzero(inside)[order].tolist()
        np.testing.assert_allclose(at_m[:found], np.sort(t[inside]) * np.linalg.norm(way))


def test_legs_of_points_are_the_single_mirrors_of_paths() -> None:
    """Those in sight: a leg's rest is tested by whoever uses it."""
    meshes = furnished()
    mesh = np.repeat(np.arange(len(meshes)), [len(part) for part in meshes])
    faces = faces_of(np.concatenate(meshes), mesh)
    points = np.random.default_rng(1).uniform([0.2, 0.2, 0.1], ROOM_M - 0.2, (40, 3))
    ends = np.stack([TX, RX])
    legs = mirror_legs(surroundings(faces, ends[:1], ends[1:]), points)
    paths = specular_paths(surroundings(faces, points, ends), np.ones((40, 2), bool), depth=1)
    single = paths.kinds[:, 0] == SPECULAR
    keys = np.stack([paths.tx, paths.rx, paths.triangles[:, 0]], axis=1)[single]
    rows = zip(legs.point, legs.site, legs.triangle, strict=True)
    found = dict(zip(rows, legs.place, strict=True))
    assert single.sum() > 300
    for key, place in zip(keys, paths.corners[single, 0], strict=True):
        np.testing.assert_allclose(found[tuple(key)], place, atol=1e-9)
    assert len(found) < 1.5 * single.sum()
