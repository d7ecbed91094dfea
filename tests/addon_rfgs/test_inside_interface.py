# SPDX-License-Identifier: Apache-2.0
"""Runs the tests of `inside_interface.py` in a Python of their own."""

from __future__ import annotations

from pathlib import Path


def test_all_tests_of_the_interface_pass_inside_blender(python) -> None:
    inner = Path(__file__).with_name("inside_interface.py")
    done = python("-m", "pytest", "-q", "-p", "no:cacheprovider", inner)
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-2000:]
    assert " passed" in done.stdout
