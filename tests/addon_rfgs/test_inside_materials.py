# SPDX-License-Identifier: Apache-2.0
"""Runs the tests of `inside_materials.py` in a Python of their own."""

from __future__ import annotations

from pathlib import Path


def test_all_tests_inside_blender_pass(python) -> None:
    inner = Path(__file__).with_name("inside_materials.py")
    done = python("-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", inner)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-2000:]
    assert " passed" in done.stdout
