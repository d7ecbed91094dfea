# SPDX-License-Identifier: Apache-2.0
"""Blender measures the committed scene once; the tests read what it found."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from blender_scenes.catalogue import scenes

JOINT_BONES = [
    *("root", "spine01", "neck01", "head"),
    *(f"{bone}.{side}" for side in "LR" for bone in ("upperarm01", "lowerarm01", "wrist")),
    *(f"{bone}.{side}" for side in "LR" for bone in ("upperleg01", "lowerleg01", "foot", "toe1-1")),
]
Run = Callable[..., subprocess.CompletedProcess[str]]
Survey = Callable[[Path, Path], SimpleNamespace]


@pytest.fixture(scope="session")
def survey(python: Run) -> Survey:
    """Measures a .blend; `joints` is a dictionary of arrays [frame, xyz]."""

    def measure(blend: Path, folder: Path) -> SimpleNamespace:
        python(Path(__file__).with_name("survey_scene.py"), blend, folder, must_work=True)
        arrays = np.load(folder / "person.npz")
        found = SimpleNamespace(**{name: arrays[name] for name in arrays.files})
        found.joints = {n: found.joints[:, i] for i, n in enumerate(JOINT_BONES)}
        found.report = json.loads((folder / "scene.json").read_text())
        return found

    return measure


@pytest.fixture(scope="session")
def walk(survey: Survey, tmp_path_factory: pytest.TempPathFactory) -> SimpleNamespace:
    """The committed living_room_walk, measured."""
    return survey(scenes()["living_room_walk"].path, tmp_path_factory.mktemp("living_room"))
