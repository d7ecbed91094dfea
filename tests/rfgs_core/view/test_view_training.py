# SPDX-License-Identifier: Apache-2.0
"""A run that is still being trained: frames come to the page as they are finished."""

from __future__ import annotations

import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest
from known_run import write_run
from viser_client import connected

from rfgs_core.run import Run, open_run
from rfgs_core.view.server import running_server
from rfgs_core.view.viewer import Viewer

ROOT = Path(__file__).resolve().parents[3]
LIMIT_S = 20.0


def test_frames_that_a_training_finishes_meanwhile_are_offered(
    known_run: Run, tiny_dataset: Path, tmp_path: Path
) -> None:
    run = open_run(write_run(tmp_path / "run", tiny_dataset))
    late = run.ply_path(2).rename(tmp_path / "late.ply")
    with running_server("127.0.0.1", 0) as server:
        viewer = Viewer(run, server, play=True)
        assert viewer.panel.next_frame() == (1, 1)
        late.rename(run.ply_path(2))
        viewer.step(limit_s=0.0)
        assert viewer.panel.next_frame() in ((1, 2), (2, 1))
        with connected(server) as client:
            client.read(lambda: "Frame" in client.controls)
            client.read(lambda: client.controls["Frame"]["max"] == 2)


def test_a_training_is_watched_from_its_first_frame_on(tiny_dataset: Path, tmp_path: Path) -> None:
    run = tmp_path / "run"
    program = (
        "import sys, time; from pathlib import Path; from rfgs_core.cli.calls import watched\n"
        "with watched(Path(sys.argv[1])):\n    sys.stdin.read()\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", program, str(run)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        cwd=ROOT,
        text=True,
    ) as training:
        assert training.stdin is not None and training.stdout is not None
        write_run(run, tiny_dataset)
        line = training.stdout.readline()
        assert " shows the run" in line
        with urllib.request.urlopen(line.split()[0], timeout=10) as answer:
            assert answer.status == 200
        training.stdin.close()
        assert training.wait(timeout=LIMIT_S) == 0
    with pytest.raises(OSError):
        urllib.request.urlopen(line.split()[0], timeout=10)
