# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial import KDTree

from blender_scenes.catalogue import scenes

#: Vehicle and radii of its front and rear wheels [m], by scene.
VEHICLES = {
    "parking_lot": ("car", 0.31, 0.31),
    "street": ("van", 0.34, 0.34),
    "warehouse": ("forklift", 0.31, 0.24),
}


@pytest.fixture(scope="module")
def surveyed(
    python: Callable[..., subprocess.CompletedProcess[str]],
    tmp_path_factory: pytest.TempPathFactory,
) -> dict[str, SimpleNamespace]:
    out = tmp_path_factory.mktemp("vehicles")
    script = Path(__file__).with_name("survey_vehicles.py")
    python(script, out, *(scenes()[name].path for name in VEHICLES), must_work=True)
    report = json.loads((out / "vehicles.json").read_text())
    return {
        name: SimpleNamespace(**np.load(out / f"{name}.npz"), report=report[name], name=name)
        for name in VEHICLES
    }


@pytest.fixture(params=sorted(VEHICLES))
def found(request: pytest.FixtureRequest, surveyed: dict[str, SimpleNamespace]) -> SimpleNamespace:
    return surveyed[request.param]


def test_wheels_have_turned_by_the_way_of_their_hubs(found: SimpleNamespace) -> None:
    _, front_m, rear_m = VEHICLES[found.name]
    for index, name in enumerate(found.report["wheels"]):
        wheel, root = found.wheels[:, index], found.roots[:, index]
        local = np.linalg.inv(root) @ wheel
        # Rz(steer) · Ry(spin): the axle keeps level in the vehicle, so its turn is in x and z.
        axle = local[:, :3, 1]
        level = np.cross(axle, [0.0, 0.0, 1.0])
        up = np.einsum("fi,fi->f", local[:, :3, 0], level)
        down = -local[:, 2, 0]
        spin = np.unwrap(np.arctan2(down, up))
        way = np.linalg.norm(np.diff(wheel[:, :2, 3], axis=0), axis=1).sum()
        radius = front_m if "front" in name else rear_m
        assert way > 3.0
        assert spin[-1] - spin[0] == pytest.approx(way / radius, rel=5e-3), name


def test_steered_wheels_follow_the_bend(found: SimpleNamespace) -> None:
    steered = {"parking_lot": "front", "street": "front", "warehouse": "rear"}[found.name]
    for index, name in enumerate(found.report["wheels"]):
        local = np.linalg.inv(found.roots[:, index]) @ found.wheels[:, index]
        steer = np.arctan2(-local[:, 0, 1], local[:, 1, 1])
        assert (np.abs(steer).max() > 0.2) == (steered in name), name


def test_wheels_stand_on_the_ground(found: SimpleNamespace) -> None:
    hump_m = 0.06 if found.name == "parking_lot" else 0.0
    # The tread has 20 to 24 corners, so its lowest point is up to 3 mm above the circle's.
    assert found.low.min() > -0.003 - (0.004 if hump_m else 0.0)
    assert found.low.max() < 0.005 + hump_m


def test_nobody_is_run_over(found: SimpleNamespace) -> None:
    for people, parts in zip(found.people, found.parts, strict=True):
        assert KDTree(parts).query(people)[0].min() > 0.4
        # The pallet on the forks may come close to the rack, nothing may touch.
        assert KDTree(found.still[found.still[:, 2] > 0.15]).query(parts)[0].min() > 0.03


def test_vehicles_are_metal_with_glass_and_one_instance(found: SimpleNamespace) -> None:
    name = VEHICLES[found.name][0]
    report = found.report
    assert set(report["parts"].values()) == {name}
    assert len(report["wheels"]) == 4
    kinds = {kind for row in report["materials"].values() for kind in row}
    assert {"metal", "glass", "wood"} <= kinds
    assert report["materials"][f"{name}_body"].count("metal") >= 3
    outer = report["area_m2"][f"{name}_body"]
    assert 0.5 < report["surface_m2"][name] / outer < 1.5


def test_scene_fits_the_radio_limits(found: SimpleNamespace) -> None:
    points = np.concatenate([found.still, found.parts.reshape(-1, 3)])
    assert np.ptp(points, axis=0).max() < 15.0


def test_cameras_are_no_fisheyes_and_lights_are_many(found: SimpleNamespace) -> None:
    assert len(found.report["sight_rad"]) >= 12
    assert np.degrees(max(found.report["sight_rad"])) < 125
    assert found.report["lights"] >= 4


def test_nothing_stands_where_a_camera_is(found: SimpleNamespace) -> None:
    for eye in np.array(found.report["eyes"]):
        for name, (low, high) in found.report["furniture"].items():
            outside = np.maximum(np.maximum(low - eye, eye - high), 0.0)
            assert np.linalg.norm(outside) > 0.05, (name, eye)
