# SPDX-License-Identifier: Apache-2.0
"""A progress bar in a log is a few lines, not one for every tenth of a second."""

from __future__ import annotations

import subprocess
import sys

_WORK = """
import sys, time
from rfgs_core.cli import main
main(["--version"])
from tqdm import tqdm
for _ in tqdm(range(8)):
    time.sleep(0.15)
"""


def test_nobody_watches_a_log() -> None:
    ran = subprocess.run([sys.executable, "-c", _WORK], capture_output=True, text=True, check=True)
    states = [line for line in ran.stderr.replace("\r", "\n").split("\n") if "it/s" in line]
    assert "8/8" in states[-1]
    assert len(states) <= 2
