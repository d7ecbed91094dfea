# SPDX-License-Identifier: Apache-2.0
"""Scripts of the docs run in this process: a start of their own takes seconds."""

from __future__ import annotations

import runpy
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest


@pytest.fixture
def script(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> Callable[..., subprocess.CompletedProcess[str]]:
    """Runs a script with arguments, as `python SCRIPT ARGUMENT…` would."""

    def run(file: Path, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
        monkeypatch.setattr(sys, "argv", [str(file), *map(str, arguments)])
        capsys.readouterr()
        code = 0
        try:
            runpy.run_path(str(file), run_name="__main__")
        except SystemExit as end:
            code = int(end.code or 0)
        return subprocess.CompletedProcess(sys.argv, code, *capsys.readouterr())

    return run
