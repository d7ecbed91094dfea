# SPDX-License-Identifier: Apache-2.0
"""Antenna elements stand where the layout's conventions say."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from rfgs_core.radio import PRESETS, DevicePose, Layout, Radio, layout, place_devices, preset
from rfgs_core.radio.layout import element_offsets, rotation

BOUNDS_M = np.array([[-1.0, 0.5, 0.25], [5.0, 4.5, 2.95]])
UPRIGHT = DevicePose("ap", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))


def test_elements_go_down_each_column_from_minus_y_plus_z() -> None:
    offsets, column = element_offsets(2, 3, 0.1)
    expected = [
        [0, -0.1, 0.05],
        [0, -0.1, -0.05],
        [0, 0.0, 0.05],
        [0, 0.0, -0.05],
        [0, 0.1, 0.05],
        [0, 0.1, -0.05],
    ]
    np.testing.assert_allclose(offsets, expected, atol=1e-15)
    assert column.tolist() == [0, 0, 1, 1, 2, 2]


@pytest.mark.parametrize("name", PRESETS)
def test_neighbours_are_half_a_wavelength_apart_unless_told(name: str) -> None:
    radio = preset(name)
    half = 299_792_458.0 / (0.5 * (radio.freq_min_hz + radio.freq_max_hz)) / 2
    elements = layout(radio, [UPRIGHT])
    for xyz, given in (
        (elements.tx_xyz, radio.tx_spacing_m),
        (elements.rx_xyz, radio.rx_spacing_m),
    ):
        if len(xyz) == 1:
            continue
        apart = np.linalg.norm(xyz[:, None] - xyz, axis=-1)
        apart[np.diag_indices(len(xyz))] = np.inf
        np.testing.assert_allclose(apart.min(axis=1), given or half, rtol=1e-9)
    np.testing.assert_allclose(elements.rx_xyz.mean(axis=0), 0, atol=1e-12)
    np.testing.assert_allclose(elements.tx_xyz.mean(axis=0), radio.tx_offset_m, atol=1e-12)


def test_arrays_lie_across_the_boresight_and_turn_with_it() -> None:
    radio = preset("wifi")
    quarter = math.sqrt(0.5)
    # A quarter turn to the left: boresight +X becomes +Y, the array's +Y becomes -X.
    device = DevicePose("ap", (1.0, 2.0, 1.5), (quarter, 0.0, 0.0, quarter))
    turned, flat = layout(radio, [device]), layout(radio, [UPRIGHT])
    assert np.ptp(flat.rx_xyz[:, 0]) == 0.0
    np.testing.assert_allclose(
        turned.rx_xyz - device.position_m, flat.rx_xyz[:, [1, 0, 2]] * [-1, 1, 1], atol=1e-12
    )
    np.testing.assert_allclose(turned.tx_xyz, [[1.0, 2.0, 1.2]], atol=1e-12)


def test_rotations_are_proper_and_need_no_unit_quaternion() -> None:
    quat = (0.3, -1.2, 0.7, 2.0)
    matrix = rotation(quat)
    np.testing.assert_allclose(matrix @ matrix.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(matrix) == pytest.approx(1.0)
    np.testing.assert_allclose(rotation((0.6, -2.4, 1.4, 4.0)), matrix, atol=1e-12)
    # The axis of a quaternion stays where it is.
    axis = np.array(quat[1:])
    np.testing.assert_allclose(matrix @ axis, axis, atol=1e-12)


def test_devices_follow_each_other() -> None:
    radio = preset("mmwave")
    devices = place_devices(radio, BOUNDS_M)
    elements = layout(radio, devices)
    assert elements.tx_device.tolist() == [d for d in range(4) for _ in range(8)]
    assert elements.rx_device.tolist() == [d for d in range(4) for _ in range(8)]
    assert elements.rx_column.tolist() == list(range(8)) * 4
    one = layout(radio, devices[2:3])
    np.testing.assert_array_equal(elements.rx_xyz[16:24], one.rx_xyz)
    np.testing.assert_array_equal(elements.tx_xyz[16:24], one.tx_xyz)


@pytest.mark.parametrize(
    ("own", "expected"),
    [("included", [[1, 1], [1, 1]]), ("only", [[1, 0], [0, 1]]), ("excluded", [[0, 1], [1, 0]])],
)
def test_measured_links(own: str, expected: list[list[int]]) -> None:
    values = {"tx_rows": 1, "tx_cols": 2, "rx_rows": 3, "rx_cols": 1, "num_devices": 2}
    radio = replace(preset("wifi"), own_device_links=own, **values)
    elements = layout(radio, place_devices(radio, BOUNDS_M))
    by_device = np.kron(np.array(expected), np.ones((2, 3))) > 0
    np.testing.assert_array_equal(elements.measured, by_device)


def test_blocks_and_centres_of_a_device_pair() -> None:
    radio = preset("wifi")
    elements = layout(radio, place_devices(radio, BOUNDS_M))
    marked = np.zeros(elements.measured.shape, bool)
    marked[elements.block_of(1, 2)] = True
    np.testing.assert_array_equal(marked, elements.links_between(1, 2))
    sender, receiver = elements.centres_of(1, 2)
    np.testing.assert_allclose(sender, elements.tx_xyz[1])
    np.testing.assert_allclose(receiver, elements.rx_xyz[128:192].mean(axis=0))


def test_ports_of_an_element_share_its_place_and_site() -> None:
    radio = replace(preset("wifi_commodity"), polarization="VH")
    elements = layout(radio, place_devices(radio, BOUNDS_M))
    assert elements.measured.shape == (16, 16)
    assert elements.rx_port.tolist() == [0, 0, 1, 1] * 4
    assert elements.rx_column.tolist() == [0, 1, 0, 1] * 4
    assert elements.rx_site.tolist() == elements.rx_device.tolist()
    np.testing.assert_array_equal(elements.rx_xyz[[0, 1, 4]], elements.rx_xyz[[2, 3, 6]])


def test_elements_far_apart_are_sites_of_their_own() -> None:
    radio = replace(preset("uwb"), polarization="VH")
    elements = layout(radio, place_devices(radio, np.array([[0, 0, 0], [6.0, 5.0, 2.7]])))
    assert elements.tx_site.tolist() == [0, 0, 1, 1, 2, 2, 3, 3]
    for site in range(64):
        of_site = np.flatnonzero(elements.rx_site == site)
        assert elements.rx_port[of_site].tolist() == [0, 1]
        assert np.ptp(elements.rx_xyz[of_site], axis=0).max() == 0.0
    assert np.unique(elements.rx_site).tolist() == list(range(64))


def test_elements_of_a_radio_without_devices_in_the_scene_are_its_own() -> None:
    radio = Radio("x", 1e9, 2e9, 10, 2, 1, 1, 2, (0.0, 0.0, 0.0), num_devices=1)
    assert layout(radio, place_devices(radio, BOUNDS_M)).measured.shape == (2, 2)


def test_device_pairs_are_those_with_a_measured_link() -> None:
    pairs = {}
    for own in ("included", "only", "excluded"):
        radio = replace(preset("wifi"), own_device_links=own, num_devices=2)
        pairs[own] = layout(radio, place_devices(radio, BOUNDS_M)).device_pairs
    assert pairs["included"] == [(0, 0), (0, 1), (1, 0), (1, 1)]
    assert pairs["only"] == [(0, 0), (1, 1)]
    assert pairs["excluded"] == [(0, 1), (1, 0)]


def test_pairs_are_numbered_by_their_devices() -> None:
    elements = Layout(
        tx_xyz=np.zeros((3, 3)),
        rx_xyz=np.zeros((4, 3)),
        tx_device=np.array([0, 0, 1]),
        rx_device=np.array([0, 1, 1, 2]),
        rx_column=np.zeros(4, int),
        measured=np.ones((3, 4), bool),
        tx_port=np.zeros(3, int),
        rx_port=np.zeros(4, int),
        tx_site=np.zeros(3, int),
        rx_site=np.zeros(4, int),
        tx_quat_wxyz=np.zeros((3, 4)),
        rx_quat_wxyz=np.zeros((4, 4)),
    )
    use = np.ones((3, 4), bool)
    use[2, 0] = False
    use[0, 3] = False
    pair, names = elements.pairs_of(use)
    assert names == [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2)]
    assert pair.tolist() == [[0, 1, 1, -1], [0, 1, 1, 2], [-1, 3, 3, 4]]


@pytest.mark.parametrize(("columns", "places"), [(2, 1), (8, 8)])
def test_beams_that_turn_over_the_band_have_a_place_for_each_element(
    columns: int, places: int
) -> None:
    """Half a wavelength apart, but 0.15 m wide over 7.5 GHz: 6 rad from the band's middle on."""
    radio = replace(preset("uwb"), rx_cols=columns, rx_spacing_m=0.0)
    assert len(np.unique(layout(radio, [UPRIGHT]).rx_site)) == places
    narrow = replace(preset("mmwave"), rx_cols=32)
    assert len(np.unique(layout(narrow, [UPRIGHT]).rx_site)) == 1
