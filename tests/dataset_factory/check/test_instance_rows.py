# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from typing import Any

import pytest

from dataset_factory.make.sequence import instance_row
from rfgs_core.evaluate.geometry import voxel_budget


@pytest.mark.parametrize(
    ("row", "surface_m2"),
    [
        ({"person": True}, 1.6),
        ({"person": True, "nominal_surface_m2": None}, 1.6),
        ({"person": True, "nominal_surface_m2": 1.1}, 1.1),
        ({"person": False, "nominal_surface_m2": 22.0}, 22.0),
        ({"person": False, "nominal_surface_m2": None}, None),
    ],
)
def test_nominal_surface_comes_from_the_scene(row: dict[str, Any], surface_m2: float) -> None:
    assert instance_row({"id": 1, **row})["nominal_surface_m2"] == surface_m2


def test_budget_of_a_street_counts_vehicles() -> None:
    rows = [{"person": True}, {"person": False, "nominal_surface_m2": 22.0}]
    both = voxel_budget([instance_row({"id": i, **row}) for i, row in enumerate(rows)])
    assert both == pytest.approx(1.5 * 23.6 / 0.04**2, abs=1)
