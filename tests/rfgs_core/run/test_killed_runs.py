# SPDX-License-Identifier: Apache-2.0
"""`kill -9` of training and evaluation at twenty random moments each: resumed, the same bytes."""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[3]
KILLS = 20
#: `rfgs` that keeps the state of a frame more often, so that kills find it half-refined.
PROGRAM = (
    "import sys, rfgs_core; from rfgs_core.fit import refine; refine.CHECKPOINT_EVERY = 20; "
    "from rfgs_core.cli import main; sys.exit(main(sys.argv[1:]))"
)
LIMIT_S = 300.0


def start(log: Path, *arguments: str | Path) -> subprocess.Popen[bytes]:
    with log.open("w") as stream:
        return subprocess.Popen(
            [sys.executable, "-c", PROGRAM, *map(str, arguments)],
            cwd=ROOT,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            stdout=stream,
            stderr=stream,
        )


def done(process: subprocess.Popen[bytes], log: Path) -> None:
    assert process.wait(timeout=LIMIT_S) == 0, log.read_text()[-3000:]
    assert "Traceback" not in log.read_text()


def strike(process: subprocess.Popen[bytes], log: Path, longest_s: float) -> bool:
    """Kills a program some time after its first word; whether it was still at work."""
    end = time.monotonic() + LIMIT_S
    while not log.stat().st_size and process.poll() is None:
        assert time.monotonic() < end
        time.sleep(0.01)
    end = time.monotonic() + random.uniform(0.0, longest_s)
    while process.poll() is None and time.monotonic() < end:
        time.sleep(0.005)
    at_work = process.poll() is None
    process.send_signal(signal.SIGKILL)
    process.wait()
    return at_work


def contents(run: Path) -> dict[str, Any]:
    """Bytes of a run's files; what tells the time of day or how long it took is left out."""
    found: dict[str, Any] = {
        file.relative_to(run).as_posix(): file.read_bytes()
        for file in run.rglob("*")
        if file.is_file() and "log" not in file.parts and not file.name.startswith(".tmp-")
    }
    for name, timed in (("config.json", ("train_s",)), ("metrics.json", ("eval_s", "date"))):
        if name in found:
            value = json.loads(found[name])
            found[name] = {key: part for key, part in value.items() if key not in (*timed, "seal")}
    return found


@pytest.fixture(scope="module")
def whole(tiny_dataset: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run that nobody disturbed, evaluated."""
    folder = tmp_path_factory.mktemp("whole")
    out, log = folder / "run", folder / "log.txt"
    done(start(log, *asked(tiny_dataset, out)), log)
    done(start(log, "eval", out), log)
    return out


def asked(data: Path, out: Path) -> tuple[str | Path, ...]:
    more = ("--iterations", "400", "--gaussians", "200", "--static-set", "20")
    return ("train", data, "--radio", "wifi", "--out", out, *more)


@pytest.mark.slow
def test_twenty_killed_trainings_end_in_the_same_bytes(
    whole: Path, tiny_dataset: Path, tmp_path: Path
) -> None:
    random.seed(9)
    out, log = whole.parent / "killed", tmp_path / "log.txt"
    kills = halves = 0
    while kills < KILLS:
        at_work = strike(start(log, *asked(tiny_dataset, out)), log, 9.0)
        assert "Traceback" not in log.read_text()
        halves += any(out.glob("checkpoints/*.partial.npz"))
        kills += at_work
        if not at_work:
            expected = {k: v for k, v in contents(whole).items() if k != "metrics.json"}
            assert contents(out) == expected
            shutil.rmtree(out)
    done(start(log, *asked(tiny_dataset, out)), log)
    assert contents(out) == {k: v for k, v in contents(whole).items() if k != "metrics.json"}
    assert not list(out.rglob(".tmp-*")) and not list(out.rglob("*.partial.npz"))
    # Otherwise no kill has hit a refinement.
    assert halves >= 3


@pytest.mark.slow
def test_twenty_killed_evaluations_end_in_the_same_bytes(whole: Path, tmp_path: Path) -> None:
    random.seed(10)
    out, log = whole.parent / "evaluated", tmp_path / "log.txt"
    shutil.copytree(whole, out)
    (out / "metrics.json").unlink()
    before, kills = contents(out), 0
    while kills < KILLS:
        kills += strike(start(log, "eval", out), log, 8.0)
        assert "Traceback" not in log.read_text()
        if (out / "metrics.json").exists():
            assert contents(out) == contents(whole)
            (out / "metrics.json").unlink()
        assert contents(out) == before
    done(start(log, "eval", out), log)
    assert contents(out) == contents(whole)
