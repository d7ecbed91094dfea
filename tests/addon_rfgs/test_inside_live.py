# SPDX-License-Identifier: Apache-2.0
"""Runs the tests of `inside_live.py` in a Python of their own, on a dataset to replay."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest


def test_all_tests_of_live_clouds_pass_inside_blender(
    pass_inside: Callable[..., None],
    tiny_dataset: Path,
    rfgs_python: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("RFGS_DATASET", str(tiny_dataset))
    monkeypatch.setenv("RFGS_PYTHON", str(rfgs_python))
    pass_inside("live")
