# SPDX-License-Identifier: Apache-2.0
"""Jobs as commands of a real Blender without a window."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from pathlib import Path

import pytest

pytestmark = pytest.mark.blender


def test_ctrl_c_stops_the_job_and_what_it_started(blender, tmp_path: Path) -> None:
    polite = tmp_path / "python"
    polite.write_text(
        "#!/bin/bash\ntrap 'exit 130' INT\necho begun\nwhile :; do sleep 0.05; done\n"
    )
    polite.chmod(0o755)
    run = tmp_path / "run"
    arguments = ("--python", polite, "--dataset", tmp_path / "data", "--out", run)
    process = subprocess.Popen(
        [blender.program, "-b", "--command", "rfgs", "train", *arguments],
        env={**os.environ, "BLENDER_USER_RESOURCES": str(blender.resources)},
        stderr=subprocess.PIPE,
        text=True,
    )
    log = run / "log" / "job_train.log"
    end_s = time.monotonic() + 60
    while not (log.is_file() and "begun" in log.read_text()):
        assert process.poll() is None and time.monotonic() < end_s
        time.sleep(0.1)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=30)
    errors = [line for line in said.splitlines() if line.startswith("error:")]
    assert process.returncode == 2 and len(errors) == 1, said
    assert errors[0].startswith("error: stopped: finished work is kept")
    assert blender.run("-b", "--command", "rfgs", "stop", run).returncode == 2, "nothing runs"


def test_the_environment_is_tested_from_the_command_line(
    blender, programs: tuple[Path, Path], tmp_path: Path
) -> None:
    environment, _ = programs
    asked = ("-b", "--command", "rfgs", "environment", "--python")
    done = blender.run(*asked, environment)
    assert done.returncode == 0 and "ready: Python 3" in done.stdout, done.stdout + done.stderr
    assert f"Blender {blender.version}" in done.stdout
    done = blender.run(*asked, tmp_path / "nothing")
    assert done.returncode == 2 and "error: " in done.stderr and "no such file" in done.stderr
