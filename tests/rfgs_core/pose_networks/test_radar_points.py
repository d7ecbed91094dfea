# SPDX-License-Identifier: Apache-2.0
"""Points of beam maps: where a scatterer is, and what does not depend on the order of pairs."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from rfgs_core.encode.body_maps import Ranges, body_maps, views_of
from rfgs_core.errors import RfgsError
from rfgs_core.limbs.tokens import Packed, pack
from rfgs_core.pose_networks.cloud import FEATURES, cloud_of
from rfgs_core.radio import layout
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.placement import place_devices
from rfgs_core.radio.presets import preset

CENTRE = np.array([0.3, -0.4, 0.95])
BOUNDS_M = np.array([[-2.5, -2.0, 0.0], [2.5, 2.0, 2.7]])


def packed_of(radio_name: str, places: np.ndarray) -> Packed:
    """Maps of equal scatterers at places [m]."""
    radio = preset(radio_name)
    elements = layout(radio, place_devices(radio, BOUNDS_M))
    legs = [
        np.linalg.norm(xyz[:, None] - places, axis=2) for xyz in (elements.tx_xyz, elements.rx_xyz)
    ]
    wavenumber = 2.0 * np.pi * radio.freq_hz / SPEED_OF_LIGHT
    delta = np.zeros((*elements.measured.shape, len(wavenumber)), np.complex128)
    for t, r in np.argwhere(elements.measured):
        way_m = legs[0][t] + legs[1][r]
        delta[t, r] = np.exp(-1j * np.outer(wavenumber, way_m)) @ (1.0 / (legs[0][t] * legs[1][r]))
    every = np.ones(len(wavenumber), dtype=bool)
    maps = body_maps(delta, elements, elements.measured, radio.freq_hz, every, CENTRE)
    views = views_of(elements, elements.measured)
    return pack([(views, maps, CENTRE)], len(views))


@pytest.mark.parametrize(("name", "within_m"), [("mmwave", 0.08), ("wifi", 0.5)])
def test_the_strongest_point_of_a_device_is_the_scatterer(name: str, within_m: float) -> None:
    """Within a range cell, of Wi-Fi half of c/2B = 0.94 m, and half a beam, which lie 0.15 apart.

    Only what a device hears of itself: near the line between two, paths hardly tell places.
    """
    place = CENTRE + np.array([0.15, 0.2, 0.25])
    packed, ranges = packed_of(name, place[None]), Ranges.of(preset(name).bandwidth_hz)
    cloud = cloud_of(packed, ranges, per_pair=4)
    points = cloud.points[0].reshape(packed.there.shape[1], 4, FEATURES)
    ends = packed.vectors[0, :, :2]
    own = ((ends[:, 0] - ends[:, 1]).norm(dim=-1) < 0.5).numpy()
    away_m = np.linalg.norm(points[:, 0, :3].numpy() - (place - CENTRE), axis=1)[own]
    half_beam_m = 0.11 * ends[:, 1].norm(dim=-1).numpy()[own]
    assert own.sum() == 4
    assert (away_m < within_m + half_beam_m).all()


@pytest.mark.parametrize("name", ["mmwave", "wifi"])
def test_points_lie_on_the_ellipsoid_of_their_path(name: str) -> None:
    packed = packed_of(name, CENTRE[None])
    cloud = cloud_of(packed, Ranges.of(preset(name).bandwidth_hz), per_pair=6)
    points = cloud.points[0].reshape(packed.there.shape[1], 6, FEATURES).double()
    there = cloud.there[0].reshape(packed.there.shape[1], 6)
    ends = packed.vectors[0, :, :2].double()
    path_m = sum((points[..., :3] - ends[:, k, None]).norm(dim=-1) for k in (0, 1))
    torch.testing.assert_close(path_m[there], 10.0 * points[..., 3][there], atol=2e-3, rtol=0.0)


def test_points_are_ranked_and_power_is_below_the_strongest() -> None:
    packed = packed_of("mmwave", CENTRE + np.array([[0.0, 0.0, 0.0], [0.2, 0.1, 0.3]]))
    cloud = cloud_of(packed, Ranges.of(preset("mmwave").bandwidth_hz))
    power = cloud.points[0, :, 4][cloud.there[0]]
    assert float(power.max()) == 0.0
    assert (cloud.points[~cloud.there] == 0.0).all()
    few = cloud_of(packed, Ranges.of(preset("mmwave").bandwidth_hz), per_pair=3)
    assert few.points.shape == (1, 3 * packed.there.shape[1], FEATURES)


def test_a_pair_that_is_not_there_gives_no_point() -> None:
    packed = packed_of("mmwave", CENTRE[None])
    there = packed.there.clone()
    there[:, 0] = False
    cloud = cloud_of(packed._replace(there=there), Ranges.of(preset("mmwave").bandwidth_hz), 5)
    assert not cloud.there[0, :5].any()
    assert cloud.there[0, 5:].any()
    assert bool(torch.isfinite(cloud.points).all())


def test_maps_of_another_band_are_refused() -> None:
    packed = packed_of("mmwave", CENTRE[None])
    with pytest.raises(RfgsError, match=r"expected \d+, those of the band"):
        cloud_of(packed, Ranges.of(preset("wifi").bandwidth_hz))
