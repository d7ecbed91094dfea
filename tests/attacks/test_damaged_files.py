# SPDX-License-Identifier: Apache-2.0
"""Damaged files of every format: refused in a line, within seconds and little memory, or found."""

from __future__ import annotations

import json
import subprocess
import sys
from collections import Counter
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

PROGRAM = Path(__file__).with_name("attack.py")
#: Most memory that reading damaged files may take, libraries included [GiB].
PEAK_GIB = 1.5


def attacked(folder: Path, count: int, seed: int, limit_s: float, *names: str) -> dict[str, Any]:
    done = subprocess.run(
        [sys.executable, str(PROGRAM), str(folder / "here"), str(count), str(seed), *names],
        capture_output=True,
        text=True,
        timeout=limit_s,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return json.loads(done.stdout.splitlines()[-1])


def check(result: dict[str, Any], count: int) -> None:
    total: Counter[str] = Counter()
    for name, row in result["formats"].items():
        sys.stdout.write(f"{name}: {row['counts']}, slowest {row['slowest_s']} s\n")
        assert sum(row["counts"].values()) == count
        total.update(row["counts"])
    sys.stdout.write(f"{sum(total.values())} in all: {dict(total)}, {result['peak_gib']:.2f} GiB\n")
    faults = {name: row["faults"] for name, row in result["formats"].items() if row["faults"]}
    assert not faults, json.dumps(faults, indent=1)
    assert max(row["slowest_s"] for row in result["formats"].values()) < 10.0
    assert result["peak_gib"] < PEAK_GIB
    assert result["written"] == []
    assert total["refused"] > 0.3 * sum(total.values())


def test_some_damage_to_every_format(tmp_path: Path) -> None:
    check(attacked(tmp_path, 6, 1, 300.0), 6)


@pytest.mark.skipif(find_spec("bpy") is None, reason="needs bpy")
@pytest.mark.parametrize("count", [20, pytest.param(300, marks=pytest.mark.slow)])
def test_damage_to_what_the_add_on_reads(tmp_path: Path, count: int) -> None:
    check(attacked(tmp_path, count, 3, 600.0, "add-on"), count)


@pytest.mark.slow
def test_three_hundred_damages_to_every_format(tmp_path: Path) -> None:
    check(attacked(tmp_path, 300, 2, 3000.0), 300)
