# SPDX-License-Identifier: Apache-2.0
"""Programs that stand where the environment's Python would, and jobs that run them."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest

from addon_rfgs.jobs import queue
from addon_rfgs.jobs.plans import TrainPlan
from addon_rfgs.seals import BLANK, sealed

#: Programs that stand where the environment's Python would: they are given a job's arguments.
PROGRAMS = {
    "quick": "#!/bin/bash\necho at work; exit 0",
    "failing": "#!/bin/bash\necho error: no wall anywhere; exit 2",
    # As rfgs does, it listens also where a shell has let its background jobs ignore Ctrl-C.
    "polite": f"#!{sys.executable}\nimport signal, sys, time\n"
    "signal.signal(signal.SIGINT, lambda *_: sys.exit(130))\n"
    "print('begun', flush=True)\nwhile True:\n    time.sleep(0.05)",
    "deaf": "#!/bin/bash\ntrap '' INT; echo begun; while :; do sleep 0.05; done",
}


@pytest.fixture
def program(tmp_path: Path):
    def make(name: str) -> Path:
        path = tmp_path / name
        path.write_text(f"{PROGRAMS[name]}\n")
        path.chmod(0o755)
        return path

    return make


@pytest.fixture
def jobs(tmp_path: Path) -> queue.Queue:
    return queue.Queue(lambda: tmp_path / "jobs.json")


def plan(tmp_path: Path, name: str) -> TrainPlan:
    return TrainPlan(out=str(tmp_path / name), dataset=str(tmp_path / "data"))


def rewrite(record: Path, row: Any) -> None:
    """Puts another row into a job's record, sealed as whoever means harm would."""
    text = json.dumps({**row, "seal": BLANK} if isinstance(row, dict) else row).encode()
    record.write_bytes(sealed(text) if isinstance(row, dict) else text)
