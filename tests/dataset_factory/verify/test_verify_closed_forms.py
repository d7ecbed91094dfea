# SPDX-License-Identifier: Apache-2.0
"""Closed forms of the card against their limits and against each other."""

from __future__ import annotations

import numpy as np
import pytest

from dataset_factory.verify.box import CONCRETE
from dataset_factory.verify.closed_forms import C, friis, sphere_path_m
from dataset_factory.verify.description import Camera
from dataset_factory.verify.energy import exponent
from dataset_factory.verify.images import (
    Box,
    box_channel,
    delays_s,
    half_space,
    image_paths,
    permittivity,
    slab,
)
from dataset_factory.verify.physical_optics import (
    cross_section,
    cuboid,
    scattered,
    sphere_spread_m2,
)
from dataset_factory.verify.rasteriser import raster
from dataset_factory.verify.shadow import knife_edge, strip
from rfgs_core.radio.reflection import material_permittivity

FREQ_HZ = np.array([2.4e9, 5.8e9, 62e9])
TX, RX = np.array([0.6, 0.7, 1.2]), np.array([3.1, 2.2, 1.9])


def test_friis_is_inverse_square_and_turns_once_per_wavelength() -> None:
    near, far = friis(FREQ_HZ, 1.0), friis(FREQ_HZ, 2.0)
    np.testing.assert_allclose(np.abs(near / far), 2.0)
    wavelength = C / 5.8e9
    again = friis(np.array([5.8e9]), np.array([1.0, 1.0 + wavelength]))[:, 0]
    assert np.angle(again[1] / again[0]) == pytest.approx(0.0, abs=1e-9)
    assert 20 * np.log10(abs(friis(np.array([2.4e9]), 1.0)[0])) == pytest.approx(-40.05, abs=0.01)


@pytest.mark.parametrize("material", ["concrete", "plasterboard", "wood", "glass"])
def test_permittivities_are_those_of_the_recommendation(material: str) -> None:
    found = permittivity(material, FREQ_HZ)
    np.testing.assert_allclose(found, material_permittivity(material, FREQ_HZ), rtol=1e-4)


def test_slab_has_its_limits() -> None:
    te, tm = slab("concrete", 0.0, FREQ_HZ, 0.6)
    np.testing.assert_allclose([te, tm], 0.0, atol=1e-12)
    # A thick lossy slab is a half-space, and metal is a mirror.
    thick, face = slab("concrete", 3.0, FREQ_HZ, 0.6), half_space("concrete", FREQ_HZ, 0.6)
    np.testing.assert_allclose(thick, face, atol=1e-6)
    np.testing.assert_allclose(slab("metal", 0.002, FREQ_HZ, 0.6), [[-1] * 3, [1] * 3], atol=2e-3)


def test_te_and_tm_agree_at_normal_incidence() -> None:
    te, tm = slab("glass", 0.006, FREQ_HZ, 1.0)
    np.testing.assert_allclose(te, -tm)


@pytest.mark.parametrize(("order", "count"), [(0, 1), (1, 7), (2, 25), (3, 63)])
def test_box_has_so_many_images(order: int, count: int) -> None:
    paths = image_paths(CONCRETE, TX, RX, order)
    assert len({tuple(np.round(way, 9)) for way, _ in paths}) == len(paths) == count
    assert max(len(axes) for _, axes in paths) == order


@pytest.mark.parametrize("polarisation", ["V", "H"])
def test_image_sum_is_reciprocal(polarisation: str) -> None:
    there, back = (box_channel(CONCRETE, *e, FREQ_HZ, polarisation) for e in ((TX, RX), (RX, TX)))
    np.testing.assert_allclose(there, back, rtol=1e-9)


def test_mirror_box_keeps_the_energy_of_a_single_reflection() -> None:
    """Of metal, the first-order image is as strong as free space over the same way."""
    box = Box((4.0, 3.0, 2.5), "metal", 0.002)
    first = box_channel(box, TX, RX, FREQ_HZ, "H", 1) - box_channel(box, TX, RX, FREQ_HZ, "H", 0)
    lengths = C * delays_s(box, TX, RX, 1)[1:]
    assert (np.abs(first) < np.abs(friis(FREQ_HZ, lengths)).sum(axis=0)).all()


def test_plate_has_its_cross_section_and_sphere_its_shadow() -> None:
    freq_hz, far = np.array([5.8e9]), np.array([0.0, 400.0, 0.0])
    echo = scattered([cuboid((0.3, 0.02, 0.3))], far, far, freq_hz)
    sigma = cross_section(echo, freq_hz, (400.0 - 0.01) ** 2)
    assert sigma[0] == pytest.approx(4 * np.pi * 0.09**2 / (C / 5.8e9) ** 2, rel=1e-3)
    assert sphere_spread_m2(0.3, 1e4) == pytest.approx(1e8, rel=1e-4)


def test_shortest_way_by_a_sphere() -> None:
    centre, place = np.array([1.0, 2.0, 3.0]), np.array([4.0, 2.0, 3.0])
    assert sphere_path_m(place, place, centre, 0.5) == pytest.approx(5.0)
    tx, rx = (centre + 3.0 * np.eye(3)[axis] for axis in (0, 1))
    point = centre + 0.5 * np.array([1.0, 1.0, 0.0]) / np.sqrt(2)
    expected = np.linalg.norm(tx - point) + np.linalg.norm(rx - point)
    assert sphere_path_m(tx, rx, centre, 0.5) == pytest.approx(expected)


def test_knife_edge_and_strip_have_their_limits() -> None:
    nu = np.array([-40.0, 0.0, 40.0])
    np.testing.assert_allclose(np.abs(knife_edge(nu)), [1.0, 0.5, 0.0], atol=0.01)
    # ITU-R P.526-15, equation 31, is within tenths of a decibel of the integral.
    for value in (-0.5, 0.5, 2.0):
        loss_db = 6.9 + 20 * np.log10(np.sqrt((value - 0.1) ** 2 + 1) + value - 0.1)
        found_db = -20 * np.log10(abs(knife_edge(np.array([value]))[0]))
        assert found_db == pytest.approx(loss_db, abs=0.3)
    # Babinet: two half planes are a strip's complement.
    upper, lower = knife_edge(np.array([0.7])), 1.0 - knife_edge(np.array([-0.4]))
    np.testing.assert_allclose(strip(np.array([-0.4]), np.array([0.7])), upper + lower)


def test_exponent_of_a_power_law() -> None:
    distance = np.geomspace(1.0, 9.0, 7)
    assert exponent(distance, 3.0 * distance**-2.5) == pytest.approx(2.5)


class _Sheets:
    """One wall across x at 3 m, and a moving triangle before it, as a bundle gives them."""

    class topology:
        faces = np.array([[0, 1, 2]])
        instance = np.array([4], np.int32)

    def frame(self, _frame: int):
        class frame:
            vertices = np.array([[2.0, -0.5, 0.5], [2.0, 0.5, 0.5], [2.0, 0.0, 1.5]], np.float32)

        return frame

    def static_meshes(self):
        class wall:
            vertices = np.array([[3, -9, -9], [3, 9, -9], [3, 9, 9], [3, -9, 9]], np.float32)
            faces = np.array([[0, 1, 2], [0, 2, 3]])

        return [wall]


def test_rasteriser_sees_planes_at_their_depth() -> None:
    seen = raster(_Sheets(), Camera("a", (0.0, 0.0, 1.0), (1.0, 0.0, 1.0), 60.0), 1, 40)
    np.testing.assert_allclose(seen.depth[seen.instance == 4], 2.0, atol=1e-6)
    np.testing.assert_allclose(seen.depth[seen.instance == 0], 3.0, atol=1e-6)
    np.testing.assert_allclose(seen.normal[0, 0], [-1.0, 0.0, 0.0], atol=1e-6)
    # Upright: the triangle's point is above the middle of the picture.
    rows = np.flatnonzero((seen.instance == 4).any(axis=1))
    assert rows.min() < 20 and not seen.inner[rows.min() - 1 : rows.min() + 1].all()
