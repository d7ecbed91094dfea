# SPDX-License-Identifier: Apache-2.0
"""Bodies on each other's slopes are told apart."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from lit_bodies import lit

from rfgs_core.bodies.localise import locate_bodies, pair_maps
from rfgs_core.bodies.separation import each_alone, separated
from rfgs_core.measure.observations import Observations
from rfgs_core.radio import preset
from rfgs_core.settings import TrainConfig

ROOM_M = np.array([[0.0, 0.0, 0.0], [5.0, 4.6, 2.4]])
#: A metre apart, less than the two metres that 160 MHz resolve.
BODIES = [(1.6, 2.9), (2.5, 2.0)]


@pytest.fixture(scope="module")
def _cache() -> dict[str, Observations]:
    return {}


@pytest.fixture
def seen(make_observations: Callable[..., Observations], _cache: dict) -> Observations:
    if "seen" not in _cache:
        radio = replace(preset("wifi"), rx_rows=4, rx_cols=4, num_subcarriers=32)
        empty = make_observations(radio=radio, bounds_m=ROOM_M)
        _cache["seen"] = lit(empty, BODIES, seed=2)
    return _cache["seen"]


def test_a_body_on_the_slope_of_another_is_found(seen: Observations) -> None:
    maps, config = pair_maps(seen), TrainConfig(bodies=2)
    together = locate_bodies(maps, ROOM_M, 2)
    apart = separated(seen, maps, together, config, 0)
    errors_m = [
        np.linalg.norm(places[:, None] - np.array(BODIES), axis=2).min(axis=0)
        for places in (together, apart)
    ]
    assert errors_m[0].max() > 1.0
    assert errors_m[1].max() < 0.1


def test_bodies_keep_their_order_and_their_reach(seen: Observations) -> None:
    near, reach_m = np.add(BODIES[::-1], (0.15, -0.1)), np.array([0.5, 0.5])
    maps, config = pair_maps(seen), TrainConfig(bodies=2)
    together = locate_bodies(maps, ROOM_M, 2, near, reach_m)
    apart = separated(seen, maps, together, config, 0, near, reach_m)
    assert np.linalg.norm(apart - np.array(BODIES)[::-1], axis=1).max() < 0.1


def test_a_body_without_gaussians_takes_nothing_off(seen: Observations) -> None:
    """At one place twice, all of them are the first one's."""
    places = np.array(BODIES[:1] * 2)
    alone = each_alone(seen, pair_maps(seen), places, TrainConfig(bodies=2), 0)
    assert len(alone) == 2
    np.testing.assert_array_equal(alone[0].delta, seen.delta)
    assert np.linalg.norm(alone[1].delta) < np.linalg.norm(seen.delta)


@pytest.mark.parametrize("change", ["one body", "no phases"])
def test_nothing_is_sought_anew_where_nothing_can_be_told(seen: Observations, change: str) -> None:
    places = np.array(BODIES[:1] if change == "one body" else BODIES)
    observations = seen if change == "one body" else replace(seen, kind="power")
    maps, config = pair_maps(seen), TrainConfig(bodies=len(places))
    assert separated(observations, maps, places, config, 0) is places
