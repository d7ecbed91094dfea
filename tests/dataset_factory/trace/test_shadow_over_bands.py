# SPDX-License-Identifier: Apache-2.0
"""Shadows at every subcarrier of every preset, against closed forms of rectangles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from PIL import Image, ImageDraw

from dataset_factory.verify.closed_forms import fresnel_integral
from rfgs_core.radio import PRESETS, Layout, Radio, preset
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.simulate.paths.path_set import PathSet
from rfgs_core.simulate.shadow import silhouette
from rfgs_core.simulate.shadow.environment import environment_channel, node_frequencies
from rfgs_core.simulate.shadow.frequencies import COUNTS, fine_grid, nodes_for
from rfgs_core.simulate.shadow.fresnel import FRESNEL, fill_fresnel, screen_factors
from rfgs_core.simulate.shadow.kirchhoff import transmission
from rfgs_core.simulate.shadow.lattice import lattice_factors, places_needed
from rfgs_core.simulate.shadow.outline import Outline, ShadowMesh
from rfgs_core.simulate.shadow.silhouette import WINDOW

D_1, D_2 = 2.5, 3.5
#: Rectangles in Fresnel coordinates at the top of the band: x from and to, y from and to. A
#: person beside the path, far from it, across it, a limb, a corner that just reaches in.
RECTANGLES = [
    (0.8, 2.9, -9.0, 4.0),
    (-1.2, 1.0, -12.0, 3.0),
    (7.5, 9.9, -11.0, 6.0),
    (9.6, 14.0, -3.0, 3.0),
    (-9.9, -9.3, -13.0, 13.0),
    (-0.2, 0.3, -9.5, -0.4),
    (3.0, 17.0, 2.0, 16.0),
    (-13.0, 13.0, -12.0, -9.0),
]


def rectangle_factor(box: tuple[float, ...], freq_hz: np.ndarray, top_hz: float) -> np.ndarray:
    """Kirchhoff factor of an opaque rectangle, given in coordinates at the band's top."""
    scale = np.sqrt(freq_hz / top_hz)
    x, y = (
        fresnel_integral(high * scale) - fresnel_integral(low * scale)
        for low, high in (box[:2], box[2:])
    )
    return 1.0 - 0.5j * x * y


def straight(radio: Radio) -> tuple[PathSet, Layout]:
    """One direct path of unit amplitude along x."""
    zero, none = np.zeros(1, np.int64), np.zeros((1, 0), np.int64)
    ends = np.array([[[0.0, 0.0, 0.0], [D_1 + D_2, 0.0, 0.0]]])
    amplitude = np.ones((1, 1, len(node_frequencies(radio))), np.complex128)
    upright = np.array([[1.0, 0.0, 0.0, 0.0]])
    elements = Layout(
        ends[:, 0], ends[:, 1], zero, zero, zero, np.ones((1, 1), bool), zero, zero, zero, zero,
        upright, upright,
    )  # fmt: skip
    return PathSet(zero, zero, amplitude, ends, none, none, none), elements


def screen(box: tuple[float, ...], top_hz: float) -> tuple[np.ndarray, ShadowMesh]:
    """The rectangle as a mesh across the path, D_1 from its start."""
    per_m = np.sqrt(2.0 * (1 / D_1 + 1 / D_2) * top_hz / SPEED_OF_LIGHT)
    x0, x1, y0, y1 = np.array(box) / per_m
    corners = [[D_1, x0, y0], [D_1, x1, y0], [D_1, x1, y1], [D_1, x0, y1]]
    return np.array(corners), ShadowMesh.of(np.array([[0, 1, 2], [0, 2, 3]]))


@pytest.mark.parametrize("name", sorted(PRESETS))
@pytest.mark.parametrize("box", RECTANGLES)
def test_every_subcarrier_is_shaded_as_the_closed_form_says(name: str, box) -> None:
    radio = preset(name)
    paths, elements = straight(radio)
    free = environment_channel(paths, radio, elements)[0, 0]
    outline = Outline(*screen(box, radio.freq_max_hz), np.ones((1, 1), bool))
    grid = fine_grid(node_frequencies(radio))
    passed = transmission(paths, elements, [outline], grid, "kirchhoff")
    found = environment_channel(paths, radio, elements, passed)[0, 0] / free
    expected = rectangle_factor(box, radio.freq_hz, radio.freq_max_hz)
    assert np.abs(expected - 1.0).max() > 0.005
    assert np.abs(found - expected).max() < 0.003


def test_two_bodies_shade_one_after_the_other() -> None:
    radio = preset("mmwave")
    paths, elements = straight(radio)
    boxes = RECTANGLES[0], RECTANGLES[2]
    grid = fine_grid(node_frequencies(radio))
    outlines = [Outline(*screen(box, radio.freq_max_hz), np.ones((1, 1), bool)) for box in boxes]
    passed = transmission(paths, elements, outlines, grid, "kirchhoff")
    single = [rectangle_factor(box, grid, radio.freq_max_hz) for box in boxes]
    assert np.abs(passed.factor[0, 0, 0] - single[0] * single[1]).max() < 0.003


def test_what_nothing_is_near_to_is_not_computed() -> None:
    radio = preset("wifi")
    paths, elements = straight(radio)
    grid = fine_grid(node_frequencies(radio))
    vertices, faces = screen((-1.0, 1.0, -1.0, 1.0), radio.freq_max_hz)
    everywhere = np.ones((1, 1), bool)
    # Far to the side, behind the receiver, and before the transmitter.
    for away in ([0.0, 5.0, 0.0], [5.0, 0.0, 0.0], [-4.0, 0.0, 0.0]):
        outline = Outline(vertices + away, faces, everywhere)
        assert len(transmission(paths, elements, [outline], grid, "kirchhoff").path) == 0
    here = Outline(vertices, faces, everywhere)
    assert transmission(paths, elements, [here], grid, "kirchhoff").path.tolist() == [0]
    hidden = replace(here, in_view=np.zeros((1, 1), bool))
    assert len(transmission(paths, elements, [hidden], grid, "kirchhoff").path) == 0


def test_polynomials_pass_through_their_nodes() -> None:
    grid = np.linspace(60e9, 64e9, 49)
    nodes = nodes_for(grid)
    middle, half = 62e9, 2e9
    first = 0
    for count in nodes.counts[:-1]:
        weights = nodes.weights[first : first + count]
        x = (nodes.hz[first : first + count] - middle) / half
        for power in range(count):
            found = x**power @ weights
            np.testing.assert_allclose(found, ((grid - middle) / half) ** power, atol=1e-9)
        first += count
    assert [*nodes.counts[:-1]] == [count for count in COUNTS if count < len(grid)]
    np.testing.assert_array_equal(nodes.hz[first:], grid)


def figure() -> tuple[np.ndarray, np.ndarray]:
    """Limbs, trunk and head of capsules and a ball, legs and arms aslant."""
    parts = []
    for start, end, radius in (
        ((0.05, 0.05, 0.1), (0.0, 0.08, 0.85), 0.07),
        ((-0.1, -0.25, 0.1), (0.0, -0.08, 0.85), 0.07),
        ((0.0, 0.0, 0.9), (0.0, 0.0, 1.35), 0.16),
        ((0.1, 0.2, 1.35), (0.2, 0.5, 1.0), 0.045),
        ((-0.1, -0.2, 1.35), (-0.15, -0.3, 0.8), 0.045),
        ((0.0, 0.0, 1.62), (0.0, 0.0, 1.66), 0.1),
    ):
        a, b = np.array(start), np.array(end)
        turn = trimesh.geometry.align_vectors([0.0, 0.0, 1.0], (b - a) / np.linalg.norm(b - a))
        part = trimesh.creation.capsule(height=float(np.linalg.norm(b - a)), radius=radius)
        part.apply_transform(turn)
        part.apply_translation(a)
        parts.append(part)
    vertices = np.concatenate([part.vertices for part in parts])
    first = np.cumsum([0, *(len(part.vertices) for part in parts)])
    faces = [part.faces + n for part, n in zip(parts, first, strict=False)]
    return vertices, np.concatenate(faces)


def filled(vertices: np.ndarray, faces: np.ndarray, tx: np.ndarray, rx: np.ndarray, px: float):
    """Silhouette on the plane across a straight path, as another library fills polygons.

    Each vertex stands where its Fresnel coordinate is the same at the mean depth.

    Returns:
        Coordinates of columns and rows [m], what is covered, and s = 1/d_1 + 1/d_2 [1/m].
    """
    length = np.linalg.norm(rx - tx)
    way = (rx - tx) / length
    across = np.cross([0.0, 0.0, 1.0], way)
    across /= np.linalg.norm(across)
    depth = (vertices - tx) @ way
    scale, at = 1 / depth + 1 / (length - depth), depth.mean()
    whole = 1 / at + 1 / (length - at)
    flat = np.stack([(vertices - tx) @ across, (vertices - tx) @ np.cross(way, across)], axis=1)
    flat *= np.sqrt(scale / whole)[:, None]
    low = flat.min(axis=0) - px
    size = np.ceil((flat.max(axis=0) + px - low) / px).astype(int)
    picture = Image.new("1", (int(size[0]), int(size[1])))
    draw = ImageDraw.Draw(picture)
    for triangle in (flat[faces] - low) / px - 0.5:
        draw.polygon([(float(x), float(y)) for x, y in triangle], fill=1)
    x, y = (low[i] + px * (np.arange(size[i]) + 0.5) for i in (0, 1))
    return x, y, np.asarray(picture).T, whole


@pytest.mark.parametrize("name", ["wifi24", "wifi", "uwb", "mmwave"])
@pytest.mark.parametrize("side", [(0.3, 0.2), (-0.45, -0.3), (0.1, 0.5)])
def test_a_figure_is_shaded_as_a_sum_over_its_picture_says(name: str, side) -> None:
    radio = preset(name)
    vertices, faces = figure()
    middle = np.array([0.0, side[0], 0.9 + side[1]])
    tx, rx = middle - np.array([1.9, 0.3, 0.1]), middle + np.array([2.6, -0.4, 0.2])
    paths, elements = straight(radio)
    paths = replace(paths, vertices=np.stack([tx, rx])[None])
    elements = replace(elements, tx_xyz=tx[None], rx_xyz=rx[None])
    outline = Outline(vertices, ShadowMesh.of(faces), np.ones((1, 1), bool))
    free = environment_channel(paths, radio, elements)[0, 0]
    grid = fine_grid(node_frequencies(radio))
    passed = transmission(paths, elements, [outline], grid, "kirchhoff")
    found = environment_channel(paths, radio, elements, passed)[0, 0] / free
    px = 1.2e-4 if name == "uwb" else 2.5e-4
    x, y, covered, scale = filled(vertices, faces, tx, rx, px)
    reach = max(np.abs(x).max(), np.abs(y).max())
    reach *= np.sqrt(2.0 * scale * radio.freq_max_hz / SPEED_OF_LIGHT)
    # What is beyond ν = 20 counts as unbounded, so that an edge there is not heard.
    limit = 0.003 + (1.0 / (np.sqrt(2.0) * np.pi * WINDOW) if reach > WINDOW else 0.0)
    chosen = [0, radio.num_subcarriers // 3, radio.num_subcarriers - 1]
    rate = scale * radio.freq_hz[chosen] / SPEED_OF_LIGHT
    along_x, along_y = (np.exp(-1j * np.pi * rate[:, None] * at**2) for at in (x, y))
    waves = np.concatenate([along_x.real, along_x.imag]).astype(np.float32)
    # In single precision: the picture in complex numbers would take gigabytes.
    rows = waves @ covered.astype(np.float32)
    total = np.sum((rows[:3] + 1j * rows[3:]) * along_y, axis=1)
    expected = 1.0 - 1j * rate * px**2 * total
    assert np.abs(found[chosen] - expected).max() < limit, (found[chosen], expected)


def one_plus(change: np.ndarray) -> np.ndarray:
    """Factors from what is changed, real and imaginary (2, frequency, pair), (pair, frequency)."""
    return (1.0 + change[0] + 1j * change[1]).T


def test_polynomials_tell_the_fresnel_integral() -> None:
    shift, per_m = 0.1, 5.6
    nu = np.concatenate([np.linspace(-40.0, 40.0, 20001), [-np.inf, np.inf]])
    edges = (nu / per_m + shift).astype(np.float32)
    found = np.zeros((2, len(edges)), dtype=np.float32)
    fill_fresnel(edges, shift, per_m, found)
    # Beyond 30 the limit is taken: the rest is at most 1/πν.
    limit = np.where(np.abs(nu) < 29.9, 2e-5, 1.01 / (np.pi * np.maximum(np.abs(nu), 1.0)))
    assert (np.abs(found[0] + 1j * found[1] - fresnel_integral(nu)) <= limit + 1e-6).all()
    assert found[:, -1].tolist() == [0.5, -0.5]


@pytest.mark.parametrize("name", ["wifi24", "wifi", "mmwave"])
@pytest.mark.parametrize("tilt_deg", [0.0, 35.0])
def test_an_array_sees_from_a_lattice_what_each_element_sees(name: str, tilt_deg: float) -> None:
    radio = preset(name)
    rng = np.random.default_rng(7)
    per_m = np.sqrt(2.0 * (1 / D_1 + 1 / D_2) * radio.freq_max_hz / SPEED_OF_LIGHT)
    low = rng.uniform(-9.0, 8.0, (60, 2)) / per_m
    runs = np.sort(np.concatenate([low[:, :1], low[:, :1] + rng.exponential(1.0, (60, 1))], 1), 1)
    runs[5, 1] = np.inf
    levels = np.linspace(-7.0, 6.0, 61) / per_m
    heights = np.stack([levels[:-1], levels[1:]], axis=1)
    heights[0, 0] = -np.inf
    # Eight by eight elements half a wave apart, seen from half way and turned about the path.
    grid = 0.25 * SPEED_OF_LIGHT / radio.freq_max_hz * (np.arange(8) - 3.5)
    tilt = np.radians(tilt_deg)
    turn = np.array([[np.cos(tilt), -np.sin(tilt)], [np.sin(tilt), np.cos(tilt)]])
    shifts = turn @ np.stack(np.meshgrid(grid, grid)).reshape(2, -1)
    at_hz = np.array([radio.freq_min_hz, radio.centre_hz, radio.freq_max_hz])
    per_m_at = np.sqrt(2.0 * (1 / D_1 + 1 / D_2) * at_hz / SPEED_OF_LIGHT)
    farthest_m = silhouette.farthest(runs, heights, shifts)[:2]
    halves = 0.5 * np.ptp(shifts, axis=1)
    counts = tuple(
        places_needed(half, far, per_m_at.max())
        for half, far in zip(halves, farthest_m, strict=True)
    )
    found = one_plus(lattice_factors(runs, heights, shifts, counts, per_m_at))
    alone = screen_factors(
        FRESNEL, runs, heights, np.repeat(shifts, 3, axis=1), np.tile(per_m_at, 64)
    ).reshape(64, 3)
    assert np.ptp(np.abs(alone), axis=0).min() > 0.01
    assert np.abs(found - alone).max() < 2e-3
    few = one_plus(lattice_factors(runs, heights, shifts, (2, 2), per_m_at))
    assert np.abs(few - alone).max() > 5e-3


def test_parts_that_overlap_count_once() -> None:
    # Two squares of either orientation over each other, as an arm before a body, and one beside.
    squares = [(-1.0, 1.0, 1), (0.5, 2.0, -1), (2.0, 3.0, 1), (4.0, 5.0, -1)]
    xy = np.concatenate([[[a, 0.0], [b, 0.0], [b, 1.0], [a, 1.0]] for a, b, _ in squares])
    faces = np.concatenate(
        [
            np.array([[0, 1, 2], [0, 2, 3]])[:, ::way] + 4 * n
            for n, (_, _, way) in enumerate(squares)
        ]
    )
    mesh = ShadowMesh.of(faces)
    runs, heights = silhouette.runs_of(
        xy.T.copy(), (mesh.faces, mesh.edges, mesh.sides), 10.0, 10.0, 0.1
    )
    rows = len(runs) // 2
    np.testing.assert_allclose(runs, [[-1.0, 3.0], [4.0, 5.0]] * rows, atol=1e-12)
    np.testing.assert_allclose(heights[::2, 0], np.arange(rows) / rows, atol=1e-12)
