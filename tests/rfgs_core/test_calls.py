# SPDX-License-Identifier: Apache-2.0
"""Programs of ours that run beside another: watched to their end, and ended with it."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from rfgs_core.cli.calls import beside
from rfgs_core.errors import RfgsError

SLOW = (
    "timeit",
    "-n",
    "1",
    "-r",
    "1",
    "import time; time.sleep(1.5); print('at last', flush=True)",
)


def test_what_a_program_says_after_the_block_is_shown(tmp_path: Path, capsys) -> None:
    log = tmp_path / "a.log"
    with beside(*SLOW, log=log):
        assert "at last" not in log.read_text()
    assert "at last" in log.read_text() and "at last" in capsys.readouterr().err


def test_a_failure_names_the_file_that_says_why(tmp_path: Path) -> None:
    log = tmp_path / "b.log"
    with (
        pytest.raises(RfgsError, match=rf"failed \(exit code 2\); {log} says why"),
        beside("rfgs_core.cli", "eval", tmp_path / "none", log=log),
    ):
        pass
    assert log.read_text().startswith("error: ")


@pytest.mark.usefixtures("hears_ctrl_c")
def test_a_block_that_fails_ends_the_program(tmp_path: Path) -> None:
    before = {child.pid for child in psutil.Process().children()}
    start_s = time.monotonic()
    with (
        pytest.raises(ValueError, match="no more"),
        beside("timeit", "-n", "1", "-r", "1", "import time; time.sleep(60)", log=tmp_path / "c"),
    ):
        raise ValueError("no more")
    assert time.monotonic() - start_s < 20.0
    assert {child.pid for child in psutil.Process().children()} <= before


@pytest.mark.skipif(sys.platform != "linux", reason="told to children on Linux alone")
def test_a_called_program_ends_with_a_caller_that_is_killed() -> None:
    sleeping = "import time; time.sleep(60)"
    calling = f"from rfgs_core.cli.calls import call; call('timeit', '-n', '1', {sleeping!r})"
    with subprocess.Popen([sys.executable, "-c", calling]) as caller:
        called = []
        for _ in range(200):
            called = psutil.Process(caller.pid).children()
            if called and "timeit" in called[0].cmdline():
                break
            time.sleep(0.05)
        caller.kill()
    assert len(called) == 1
    assert psutil.wait_procs(called, timeout=10)[1] == []
