# SPDX-License-Identifier: Apache-2.0
"""Blender runs in Pythons of its own: it keeps one file open and cannot be unloaded."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Run = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture(scope="session")
def addon(python: Run) -> Run:
    """Runs `python -m addon_rfgs --blend …`."""
    return lambda blend, *arguments: python("-m", "addon_rfgs", "--blend", blend, *arguments)


@pytest.fixture(scope="session")
def scenes(python: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of small .blend files and their bundles."""
    folder = tmp_path_factory.mktemp("scenes")
    python(Path(__file__).with_name("build_scenes.py"), folder, must_work=True)
    return folder


@pytest.fixture(scope="session")
def results(scenes: Path) -> dict[str, Any]:
    """What happened to each scene."""
    return json.loads((scenes / "results.json").read_text())
