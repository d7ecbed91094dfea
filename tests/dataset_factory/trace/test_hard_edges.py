# SPDX-License-Identifier: Apache-2.0
"""Boxes scatter like their faces, whatever triangles they are made of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from box_meshes import mesh_of
from bundle_files import describe_bundle

from dataset_factory.scene.bundle import Bundle, read_bundle
from dataset_factory.verify.physical_optics import Cuboid as Box
from dataset_factory.verify.physical_optics import cuboid as box
from dataset_factory.verify.physical_optics import in_sight, scattered
from rfgs_core.errors import RfgsFormatError
from rfgs_core.radio import DevicePose, Radio, layout
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.simulate.surface.edges import SHARP, SMOOTH, UNSAID
from rfgs_core.simulate.surface.facets import facet_sum
from rfgs_core.simulate.surface.points import SurfacePoints, surface_points, triangle_areas

MakeBundle = Callable[..., Bundle]
WIFI_HZ, WIFI24_HZ = np.linspace(5.72e9, 5.88e9, 5), np.linspace(2.417e9, 2.457e9, 5)
CUBE = [box((0.4, 0.4, 0.4))]
VEHICLE = [box((4.2, 1.8, 1.5))]
#: Seat, back and four legs; a millimetre apart, so that no face lies in another.
CHAIR = [
    box((0.44, 0.44, 0.03), (0, 0, -0.015)),
    box((0.03, 0.44, 0.45), (-0.2, 0, 0.226)),
    *(box((0.04, 0.04, 0.44), (x, y, -0.251)) for x in (-0.19, 0.19) for y in (-0.19, 0.19)),
]
#: Azimuths and elevations of the transmitter and of the receiver [deg].
NEAR_BROADSIDE = [(a, e, a, e) for a in (0, 1, 2) for e in (0, 1)]
ASLANT = [(a, e, a, e) for a in (10, 14, 18, 22, 26, 30) for e in (0, 3, 7)]
BISTATIC = [(a, 5, -b, 12) for a in (10, 20, 30) for b in (10, 20, 35, 60)]
SETS = {"near broadside": NEAR_BROADSIDE, "aslant": ASLANT, "bistatic": BISTATIC}


def points_of(vertices: np.ndarray, faces: np.ndarray, freq_hz: float, **said) -> SurfacePoints:
    zeros = np.zeros(len(faces), np.int64)
    return surface_points(vertices, faces, zeros, zeros, SPEED_OF_LIGHT / freq_hz, 0, **said)


def place(azimuth_deg: float, elevation_deg: float, distance_m: float) -> np.ndarray:
    a, e = np.radians([azimuth_deg, elevation_deg])
    return distance_m * np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])


def misses_db(
    boxes: list[Box], freq_hz: np.ndarray, distance_m: float, meshes: list[tuple]
) -> dict[str, list[float]]:
    """By how much the points of each mesh miss physical optics [dB], for each set of directions.

    Off broadside, physical optics falls into nulls that no finite number of points follows, so
    powers are averaged over the band and the directions of a set.
    """
    posed = []
    for vertices, faces in meshes:
        points = points_of(vertices, faces, freq_hz.max())
        posed.append((points.areas, *points.at(vertices)))
    out = {}
    for name, directions in SETS.items():
        ends = [(place(*d[:2], distance_m), place(*d[2:], distance_m)) for d in directions]
        exact = np.mean([np.abs(scattered(boxes, *pair, freq_hz)) ** 2 for pair in ends])
        out[name] = []
        for areas, positions, normals in posed:
            found = []
            for tx, rx in ends:
                lit = in_sight(positions, tx, boxes) & in_sight(positions, rx, boxes)
                h = facet_sum(
                    positions, normals, areas, tx[None], rx[None], lit.astype(float), freq_hz
                )
                found.append(np.abs(h[0, 0]) ** 2)
            out[name].append(10.0 * np.log10(np.mean(found) / exact))
    return out


def within(misses: dict[str, list[float]], limit_db: float) -> bool:
    """Whether every mesh agrees with physical optics, and all agree with each other."""
    return all(max(*m, 0.0) - min(*m, 0.0) < limit_db for m in misses.values())


@pytest.mark.parametrize("freq_hz", [WIFI_HZ, WIFI24_HZ], ids=["5.8 GHz", "2.4 GHz"])
def test_cube_is_physical_optics_of_its_faces(freq_hz: np.ndarray) -> None:
    meshes = [mesh_of(CUBE), mesh_of(CUBE, 8), mesh_of(CUBE, side_m=0.03)]
    misses = misses_db(CUBE, freq_hz, 6.0, meshes)
    assert within(misses, 0.3), misses


@pytest.mark.parametrize("freq_hz", [WIFI_HZ, WIFI24_HZ], ids=["5.8 GHz", "2.4 GHz"])
def test_chair_is_physical_optics_of_its_faces(freq_hz: np.ndarray) -> None:
    misses = misses_db(CHAIR, freq_hz, 5.0, [mesh_of(CHAIR), mesh_of(CHAIR, side_m=0.03)])
    assert within(misses, 0.3), misses


@pytest.mark.slow
@pytest.mark.parametrize("freq_hz", [WIFI_HZ, WIFI24_HZ], ids=["5.8 GHz", "2.4 GHz"])
def test_vehicle_of_points_is_physical_optics_of_its_faces(freq_hz: np.ndarray) -> None:
    misses = misses_db(VEHICLE, freq_hz, 15.0, [mesh_of(VEHICLE), mesh_of(VEHICLE, 8)])
    assert within(misses, 0.3), misses


@pytest.mark.parametrize("cells", [1, 7])
def test_points_of_a_cube_have_the_normals_and_areas_of_its_faces(cells: int) -> None:
    vertices, faces = mesh_of(CUBE, cells)
    points = points_of(vertices, faces, WIFI_HZ.max())
    turn = trimesh.transformations.euler_matrix(0.3, -0.5, 1.1)[:3, :3]
    # The cube is squeezed and turned after its points were made at rest.
    bent = (vertices * [1.0, 0.8, 1.3]) @ turn.T
    for posed, axes in ((vertices, np.eye(3)), (bent, turn)):
        _, normals = points.at(posed)
        facing = np.abs(normals @ axes)
        np.testing.assert_allclose(facing.max(axis=1), 1.0, atol=1e-9)
        face = facing.argmax(axis=1) * 2 + ((normals @ axes).sum(axis=1) > 0)
        np.testing.assert_allclose(np.bincount(face, points.areas), 6 * [0.16], rtol=1e-9)


def test_cells_keep_to_the_faces_of_a_thin_plate() -> None:
    """Its rims are narrower than a cell, and its two sides nearer to each other."""
    plate = [box((0.4, 0.3, 0.004))]
    vertices, faces = mesh_of(plate, 4)
    points = points_of(vertices, faces, WIFI_HZ.max())
    _, normals = points.at(vertices)
    face = np.abs(normals).argmax(axis=1) * 2 + (normals.sum(axis=1) > 0)
    sides = 2 * [0.3 * 0.004] + 2 * [0.4 * 0.004] + 2 * [0.4 * 0.3]
    np.testing.assert_allclose(np.bincount(face, points.areas), sides, rtol=1e-9)


def test_slivers_cost_less_than_a_thousandth_of_the_surface() -> None:
    """A hundred crumbs beside a plate, each face a hundredth of a cell, together 0.5 % of it."""
    crumbs = [box((2e-3, 2e-3, 2e-3), (x / 100, 0, 0.3)) for x in range(100)]
    vertices, faces = mesh_of([box((0.5, 0.5, 0.01)), *crumbs])
    # Each is an instance of its own, or crumbs would be left out as parts of a larger one.
    owner = np.arange(len(faces)) // 12
    points = surface_points(vertices, faces, 0 * owner, owner, SPEED_OF_LIGHT / 5.88e9, 0)
    assert points.areas.sum() == pytest.approx(triangle_areas(vertices, faces).sum(), rel=1e-3)


def prism(sides: int) -> trimesh.Trimesh:
    return trimesh.creation.cylinder(radius=0.1, height=0.5, sections=sides)


def side_normals(points: SurfacePoints, mesh: trimesh.Trimesh) -> np.ndarray:
    """How far normals on the mantle are from those of flat faces [deg]."""
    _, normals = points.at(np.asarray(mesh.vertices))
    flat = mesh.face_normals[points.triangle]
    cosine = np.sum(normals * flat, axis=1)[np.abs(flat[:, 2]) < 0.5]
    return np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))


@pytest.mark.parametrize(("sides", "flat"), [(6, True), (8, True), (12, False), (24, False)])
def test_unmarked_edges_are_told_by_their_angle(sides: int, flat: bool) -> None:
    mesh = prism(sides)
    off_deg = side_normals(points_of(np.asarray(mesh.vertices), mesh.faces, 5.8e9), mesh)
    assert (off_deg.max() < 1e-3) == flat


def test_mesh_has_its_say_about_edges_before_the_angle() -> None:
    mesh = prism(24)
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    marked = points_of(vertices, faces, 5.8e9, edges=np.full(faces.shape, SHARP))
    assert side_normals(marked, mesh).max() < 1e-3
    cube = trimesh.creation.box((0.4, 0.4, 0.4))
    vertices, faces = np.asarray(cube.vertices), np.asarray(cube.faces)
    smooth = points_of(vertices, faces, 5.8e9, edges=np.full(faces.shape, SMOOTH))
    assert np.abs(smooth.at(vertices)[1]).max(axis=1).min() < 0.9


def test_marks_stay_on_their_sides_when_a_mesh_is_turned_outwards() -> None:
    """Only the rim of a low cone is marked; its mantle is smooth."""
    mesh = trimesh.creation.cone(radius=0.3, height=0.05, sections=40)
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    rim = np.hypot(vertices[:, 0], vertices[:, 1]) > 0.29
    marks = np.where(rim[faces] & rim[np.roll(faces, -1, axis=1)], SHARP, SMOOTH)
    for turned in (False, True):
        wound, said = (faces[:, ::-1], marks[:, [1, 0, 2]]) if turned else (faces, marks)
        points = points_of(vertices, wound, 5.8e9, edges=said)
        positions, normals = points.at(vertices)
        bottom = positions[:, 2] < 1e-9
        np.testing.assert_allclose(normals[bottom], np.tile([0, 0, -1.0], (bottom.sum(), 1)))
        assert points.areas[bottom].sum() == pytest.approx(20 * 0.09 * np.sin(np.pi / 20), rel=1e-6)
        # Of the mantle, 9° steep, no normal leans towards the bottom.
        assert normals[~bottom, 2].min() > 0.9


def test_seams_are_no_edges() -> None:
    """Every triangle of a ball has vertices of its own, as some exporters write them."""
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.25)
    split = np.asarray(ball.vertices)[ball.faces.ravel()]
    apart = np.arange(len(split)).reshape(-1, 3)
    for said in (UNSAID, SMOOTH):
        edges = np.full(apart.shape, said)
        whole = points_of(np.asarray(ball.vertices), ball.faces, 5.8e9, edges=edges)
        seamed = points_of(split, apart, 5.8e9, edges=edges)
        assert np.array_equal(seamed.areas, whole.areas)
        normals = seamed.at(split)[1]
        np.testing.assert_allclose(normals, whole.at(np.asarray(ball.vertices))[1], atol=1e-9)


def test_sides_of_a_double_sheet_keep_their_own_normals() -> None:
    sheet = box((1.0, 1.0, 1.0)).faces[0]
    corners = sheet.corner + np.array([0 * sheet.side_u, sheet.side_u, sheet.side_u + sheet.side_v])
    faces = np.array([[0, 1, 2], [2, 1, 0]])
    for said in (UNSAID, SMOOTH):
        points = points_of(corners, faces, 2.4e9, edges=np.full((2, 3), said))
        assert np.abs(points.at(corners)[1] @ sheet.normal) == pytest.approx(1.0)


def test_tracer_hears_the_faces_of_a_cube(
    make_bundle: MakeBundle, small_radio: Radio, facing_cube: list[DevicePose]
) -> None:
    from dataset_factory.trace import Tracer

    radio = replace(small_radio, freq_min_hz=5.72e9, freq_max_hz=5.88e9)
    vertices, faces = mesh_of([box((0.4, 0.4, 0.4), (0, 0, 1.2))])
    bundle = make_bundle(static=[], mover=(vertices.astype(np.float32), faces.astype(np.int32)))
    frame = bundle.frame(1)
    # A hard shadow leaves the line of sight, which passes the cube by, as it was.
    tracer = Tracer(bundle, radio, facing_cube, depth=1, shadow="hard")
    found = tracer.frame(frame) - tracer.static()
    middle = (frame.vertices.min(axis=0) + frame.vertices.max(axis=0)) / 2
    cube = [box((0.4, 0.4, 0.4), tuple(middle))]
    elements = layout(radio, facing_cube)
    gamma = tracer._bodies.gamma(radio.freq_hz)[1]
    exact = np.zeros_like(found)
    for t, r in np.argwhere(elements.measured):
        ends = elements.tx_xyz[t], elements.rx_xyz[r]
        exact[t, r] = gamma * scattered(cube, *ends, radio.freq_hz)
    for device in range(2):
        own = elements.tx_device[:, None] == device
        own = own & (elements.rx_device == device) & elements.measured
        power, expected = (np.mean(np.abs(h[own]) ** 2) for h in (found, exact))
        level_db = 10 * np.log10(power / expected)
        assert level_db == pytest.approx(0.0, abs=0.3), device


@pytest.mark.parametrize(
    ("band_hz", "degrees"),
    [
        pytest.param((5.72e9, 5.88e9), 1.0, id="5.8"),
        pytest.param((61.9e9, 62.1e9), 5.0, id="62", marks=pytest.mark.slow),
    ],
)
def test_a_sheet_answers_from_its_own_plane(
    make_bundle: MakeBundle,
    small_radio: Radio,
    facing_cube: list[DevicePose],
    band_hz: tuple[float, float],
    degrees: float,
) -> None:
    """A millimetre nearer to the antennas would turn it by 14 degrees at 5.8 GHz, 150 at 62."""
    from dataset_factory.trace import Tracer

    radio = replace(
        small_radio,
        freq_min_hz=band_hz[0],
        freq_max_hz=band_hz[1],
        num_subcarriers=2,
    )
    vertices, faces = mesh_of([box((0.3, 0.02, 0.3), (0, 0, 1.2))])
    bundle = make_bundle(static=[], mover=(vertices.astype(np.float32), faces.astype(np.int32)))
    frame, device = bundle.frame(1), facing_cube[:1]
    tracer = Tracer(bundle, radio, device, depth=1, shadow="hard")
    found = tracer.frame(frame) - tracer.static()
    middle = (frame.vertices.min(axis=0) + frame.vertices.max(axis=0)) / 2
    sheet = [box((0.3, 0.02, 0.3), tuple(middle))]
    elements = layout(radio, device)
    gamma = tracer._bodies.gamma(radio.freq_hz)[1]
    exact = np.zeros_like(found)
    for t, r in np.argwhere(elements.measured):
        ends = elements.tx_xyz[t], elements.rx_xyz[r]
        exact[t, r] = gamma * scattered(sheet, *ends, radio.freq_hz)
    turned = np.degrees(np.angle(np.sum(found * exact.conj())))
    assert abs(turned) < degrees


@pytest.fixture
def facing_cube() -> list[DevicePose]:
    """One device in front of a face of the cube at (1.7, 2.1, 1.2), one 15° beside it."""
    upright = (1.0, 0.0, 0.0, 0.0)
    aside = np.radians(15.0)
    beside = (1.7 + 2.5 * np.cos(aside), 2.1 - 2.5 * np.sin(aside), 1.2)
    return [DevicePose("front", (1.7, 4.6, 1.2), upright), DevicePose("beside", beside, upright)]


def test_bundle_without_a_word_about_edges_is_read(person_bundle: Bundle) -> None:
    edges = person_bundle.topology.edges
    assert edges.shape == person_bundle.topology.faces.shape and (edges == UNSAID).all()


@pytest.mark.parametrize("wrong", [np.zeros((7, 3), np.int8), None], ids=["shape", "values"])
def test_damaged_edges_are_named(
    make_bundle: MakeBundle, coarse_capsule: tuple, wrong: np.ndarray | None
) -> None:
    folder: Path = make_bundle(mover=coarse_capsule).path
    with np.load(folder / "topology.npz") as stored:
        arrays = dict(stored)
    bad = np.full(arrays["faces"].shape, 5, np.int8) if wrong is None else wrong
    np.savez(folder / "topology.npz", **arrays, edges=bad)
    describe_bundle(folder)
    with pytest.raises(RfgsFormatError, match=r"topology\.npz: edges: expected"):
        read_bundle(folder)
