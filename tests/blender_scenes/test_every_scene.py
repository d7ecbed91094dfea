# SPDX-License-Identifier: Apache-2.0
"""What every committed scene promises: measured once, by one Blender, at seven frames each."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from blender_scenes.catalogue import scenes
from rfgs_core.radio.materials import MATERIALS
from rfgs_core.radio.presets import PRESETS

NAMES = sorted(scenes())


@pytest.fixture(scope="session")
def measured(
    python: Callable[..., subprocess.CompletedProcess[str]],
    tmp_path_factory: pytest.TempPathFactory,
) -> dict[str, dict]:
    out = tmp_path_factory.mktemp("catalogue") / "scenes.json"
    script = Path(__file__).with_name("survey_catalogue.py")
    python(script, out, *(scenes()[name].path for name in NAMES), must_work=True)
    return json.loads(out.read_text())


@pytest.fixture(params=NAMES)
def found(request: pytest.FixtureRequest, measured: dict[str, dict]) -> dict:
    return {"name": request.param, **measured[request.param]}


def gap(point: np.ndarray, low: list[float], high: list[float]) -> float:
    outside = np.maximum(np.maximum(low - point, point - high), 0.0)
    return float(np.linalg.norm(outside))


def test_catalogue_states_the_frames_of_the_file(found: dict) -> None:
    scene = scenes()[found["name"]]
    assert found["frames"] == [scene.frame_start, scene.frame_end, scene.fps]
    assert scene.frame_end - scene.frame_start + 1 >= 60


def test_materials_are_valid_for_wifi_and_mmwave(found: dict) -> None:
    for name, (kind, thickness_m) in found["materials"].items():
        assert kind in MATERIALS, f"{name} has no radio material"
        assert 0.0005 < thickness_m < 0.5, name
        assert all(MATERIALS[kind].covers(PRESETS[radio]) for radio in ("wifi", "mmwave")), name


def test_someone_moves_and_nobody_sinks_into_the_ground(found: dict) -> None:
    assert found["people"]
    for name, boxes in found["people"].items():
        lows, highs = np.array(boxes)[:, 0], np.array(boxes)[:, 1]
        assert lows[:, 2].min() > -0.02, name
        assert 0.3 < (highs - lows)[:, 2].max() < 2.1, name
    spans = [np.ptp(np.array(boxes), axis=0).max() for boxes in found["people"].values()]
    assert max(spans) > 0.05


def test_people_differ(found: dict) -> None:
    sizes = [
        (np.array(boxes)[0, 1] - np.array(boxes)[0, 0])[2] for boxes in found["people"].values()
    ]
    assert len({round(float(size), 3) for size in sizes}) == len(sizes)


def test_at_least_twelve_cameras_see_everybody_at_all_times(found: dict) -> None:
    seen = np.array(found["seen"])
    assert seen.shape[1] >= 12
    assert seen.all()


def test_access_points_keep_clear_of_things(found: dict) -> None:
    assert len(found["devices"]) >= 4
    for device, place in found["devices"].items():
        for name, (folder, low, high) in found["static"].items():
            if folder == "Furniture":
                assert gap(np.array(place), low, high) > 0.05, (device, name)


def test_furniture_keeps_a_centimetre_from_the_floor(found: dict) -> None:
    for name, (folder, low, _) in found["static"].items():
        if folder == "Furniture":
            assert low[2] > 0.01, name
