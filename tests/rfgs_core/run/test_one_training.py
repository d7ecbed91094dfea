# SPDX-License-Identifier: Apache-2.0
"""One training per folder, and a disk that fills up while it trains: a line each."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from rfgs_core.cli import main

#: What a training may leave out without writing less.
QUICK = ("--people", "told", "--posture", "standing", "--limbs", "off")
ROOT = Path(__file__).resolve().parents[3]
#: Bars, what the radio can tell apart, and the price.
TOLD = (
    r"(train wifi|counting people): +\d+%|counting people in up to \d+ frames first: about |"
    r"\d+ frames? to fit, |wifi(_\d)?: (paths|across)|\d+ links x \d+ subcarriers"
)


def asked(data: Path, out: Path, *more: str) -> list[str]:
    return ["train", str(data), "--radio", "wifi", "--out", str(out), *QUICK, *more]


def training(data: Path, out: Path, *more: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "rfgs_core.cli", *asked(data, out, *more)],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def complaints(said: str) -> list[str]:
    """What stands on the terminal beside progress bars, and what is told before a training."""
    lines = [line.rpartition("\r")[2] for line in said.splitlines()]
    return [line for line in lines if line and not re.match(TOLD, line)]


def test_the_second_training_is_refused_in_one_line(
    tiny_dataset: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run"
    first = training(tiny_dataset, out, "--iterations", "100000")
    try:
        end = time.monotonic() + 60.0
        while not (out / "config.json").exists():
            assert time.monotonic() < end and first.poll() is None
            time.sleep(0.05)
        assert main(asked(tiny_dataset, out, "--iterations", "1")) == 2
        assert complaints(capsys.readouterr().err) == [
            f"error: {out}: another rfgs train is working on it; wait until it ends, or choose "
            "another --out"
        ]
    finally:
        first.kill()
        first.communicate()
    # A killed one holds nothing.
    assert main(asked(tiny_dataset, out, "--iterations", "100000", "--seed", "3")) == 2
    assert "holds a run with another seed" in capsys.readouterr().err


@pytest.fixture(params=[20, 400])
def small_disk(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Path]:
    """A file system that is full after so many kB: at once, or at the first finished frame."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={request.param}k", "tmpfs", str(folder)]
    if subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("only root may mount a small disk")
    yield folder
    subprocess.run(["umount", "--lazy", str(folder)], check=True)


def check_full(code: int, said: str) -> None:
    assert code == 2, said
    assert "Traceback" not in said and "Exception ignored" not in said
    lines = complaints(said)
    assert [line.partition(";")[0].partition(" while")[0] for line in lines] == [
        "error: the disk is full"
    ]


def test_a_full_disk_is_one_line(
    tiny_dataset: Path, small_disk: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    more = ("--iterations", "2", "--gaussians", "2000")
    check_full(main(asked(tiny_dataset, small_disk / "run", *more)), capsys.readouterr().err)


def test_a_full_disk_is_one_line_with_a_log(tiny_dataset: Path, small_disk: Path) -> None:
    """In a process of its own: the log is written once more as Python ends."""
    more = ("--iterations", "2", "--gaussians", "2000", "--log")
    process = training(tiny_dataset, small_disk / "run", *more)
    _, said = process.communicate(timeout=120)
    check_full(process.returncode, said)
