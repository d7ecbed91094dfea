# SPDX-License-Identifier: Apache-2.0
"""Runs the tests of `inside_*.py`, each file in a Python of its own."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.mark.parametrize("name", ["blender", "ply", "gaussians", "edited_clouds"])
def test_all_tests_inside_blender_pass(python, name: str) -> None:
    inner = Path(__file__).with_name(f"inside_{name}.py")
    done = python("-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", inner)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-2000:]
    assert " passed" in done.stdout
