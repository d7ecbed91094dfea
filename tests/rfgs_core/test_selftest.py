# SPDX-License-Identifier: Apache-2.0
"""`rfgs selftest` finds kernels right that are right, and wrong that are wrong."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import torch

from rfgs_core import selftest
from rfgs_core.cli import main
from rfgs_core.propagation import propagate
from rfgs_core.selftest import Check, Throughput, checks


@pytest.fixture(autouse=True)
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """No speed, which tests do not measure."""
    monkeypatch.setattr(selftest, "throughput", lambda device: Throughput(0.5, 2e9, 4e9))


@pytest.mark.slow
def test_all_kernels_hold_and_the_numbers_are_kept(tmp_path: Path, capsys) -> None:
    assert main(["selftest", "--json", str(tmp_path / "a.json")]) == 0
    text = capsys.readouterr().out
    assert "WRONG" not in text and "(50% of a product of matrices)" in text
    kept = json.loads((tmp_path / "a.json").read_text())
    assert len(kept["checks"]) == text.count(": holds") == 38
    assert all(0.0 <= row["error"] < row["bound"] for row in kept["checks"])


@pytest.mark.parametrize("factor", [1.001, float("nan")])
def test_a_wrong_kernel_is_found(
    factor: float, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def altered(*arguments, backend=None):
        found = propagate(*arguments, backend=backend)
        return found if backend == "torch" else factor * found

    monkeypatch.setattr(selftest, "propagate", altered)
    assert main(["selftest"]) == 1
    said = capsys.readouterr()
    assert said.out.count("WRONG") == 25 and "error: 25 of 38 checks are wrong" in said.err


def test_an_error_that_is_no_number_does_not_hold() -> None:
    assert Check("a", 1e-5, 1e-4).holds and not Check("a", float("nan"), 1e-4).holds


@pytest.mark.gpu
def test_the_gpu_agrees() -> None:
    if not torch.cuda.is_available():
        pytest.skip("no GPU here")
    wrong = [check for check in checks("cuda") if not check.holds]
    assert not wrong, wrong
