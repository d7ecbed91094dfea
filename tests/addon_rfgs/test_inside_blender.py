# SPDX-License-Identifier: Apache-2.0
"""Runs the tests of `inside_*.py`, each file in a Python of its own."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

#: `test_inside_channels.py` gives one a run to draw, `test_inside_live.py` one a dataset to replay.
NAMES = sorted(
    path.stem.removeprefix("inside_")
    for path in Path(__file__).parent.glob("inside_*.py")
    if path.stem not in ("inside_channels", "inside_live")
)


@pytest.mark.parametrize("name", NAMES)
def test_all_tests_inside_blender_pass(pass_inside: Callable[[str], None], name: str) -> None:
    pass_inside(name)
