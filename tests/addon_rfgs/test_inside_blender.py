# SPDX-License-Identifier: Apache-2.0
"""Runs the tests of `inside_*.py` in two Pythons: each start of Blender takes seconds."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

#: Others are given what they need by tests of their own: a run, a dataset, captures.
NAMES = sorted(
    path.stem.removeprefix("inside_")
    for path in Path(__file__).parent.glob("inside_*.py")
    if not path.with_name(f"test_{path.name}").exists()
)


@pytest.mark.parametrize("half", [0, 1])
def test_all_tests_inside_blender_pass(pass_inside: Callable[..., None], half: int) -> None:
    pass_inside(*NAMES[half::2])
