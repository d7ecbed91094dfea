# SPDX-License-Identifier: Apache-2.0
"""Blender measures the committed scene once; the tests read what it found."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from blender_scenes.catalogue import scenes

ROOT = Path(__file__).resolve().parents[2]
JOINT_BONES = [
    *("root", "spine01", "neck01", "head"),
    *(f"{bone}.{side}" for side in "LR" for bone in ("upperarm01", "lowerarm01", "wrist")),
    *(f"{bone}.{side}" for side in "LR" for bone in ("upperleg01", "lowerleg01", "foot", "toe1-1")),
]
Survey = Callable[[Path, Path], SimpleNamespace]


def run_python(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *map(str, arguments)],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=400,
        check=False,
    )


@pytest.fixture(scope="session")
def python() -> Callable[..., subprocess.CompletedProcess[str]]:
    """Runs Python in the repository's folder."""
    return run_python


@pytest.fixture(scope="session")
def survey() -> Survey:
    """Measures a .blend; `joints` is a dictionary of arrays [frame, xyz]."""

    def measure(blend: Path, folder: Path) -> SimpleNamespace:
        done = run_python(Path(__file__).with_name("survey_scene.py"), blend, folder)
        assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
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
