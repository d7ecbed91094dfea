# SPDX-License-Identifier: Apache-2.0
"""Blender runs in Pythons of its own: it keeps one file open and cannot be unloaded."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]
Run = Callable[..., subprocess.CompletedProcess[str]]


def run_python(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *map(str, arguments)],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=280,
        check=False,
    )


@pytest.fixture(scope="session")
def python() -> Run:
    """Runs Python in the repository's folder."""
    return run_python


@pytest.fixture(scope="session")
def addon() -> Run:
    """Runs `python -m addon_rfgs --blend …`."""
    return lambda blend, *arguments: run_python("-m", "addon_rfgs", "--blend", blend, *arguments)


@pytest.fixture(scope="session")
def scenes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of small .blend files and their bundles."""
    folder = tmp_path_factory.mktemp("scenes")
    done = run_python(Path(__file__).with_name("build_scenes.py"), folder)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    return folder


@pytest.fixture(scope="session")
def results(scenes: Path) -> dict[str, Any]:
    """What happened to each scene."""
    return json.loads((scenes / "results.json").read_text())
