# SPDX-License-Identifier: Apache-2.0
"""Runs the tests of `inside_captures.py` in a Python of their own, on captures made here."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from capture_files import feitcsi_file

LAYOUT = """
name: lab
radio: wifi
centre_hz: 5.5e9
fps: 10
devices:
  - {name: tx, role: TRANSMITTER, position_m: [0, 0, 1.2]}
  - {name: r1, role: RECEIVER, position_m: [3, 0, 1.2]}
  - {name: r2, role: RECEIVER, position_m: [0, 3, 1.2]}
"""


def test_all_tests_of_captures_pass_inside_blender(
    pass_inside: Callable[[str], None],
    rfgs_python: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name in ("a.csi", "b.csi"):
        feitcsi_file(tmp_path / name, packets=20)
    (tmp_path / "radios.yaml").write_text(LAYOUT)
    monkeypatch.setenv("RFGS_CAPTURES", str(tmp_path))
    monkeypatch.setenv("RFGS_PYTHON", str(rfgs_python))
    pass_inside("captures")
