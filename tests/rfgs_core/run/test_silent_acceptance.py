# SPDX-License-Identifier: Apache-2.0
"""Runs that were once taken as they are although something in them cannot be."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rfgs_core.arrays import load_arrays, save_arrays
from rfgs_core.errors import RfgsError
from rfgs_core.run import Run, open_run
from rfgs_core.seals import BLANK, sealed


@pytest.fixture
def copy(small_run: Run, tiny_dataset: Path, tmp_path: Path) -> Path:
    copy = Path(shutil.copytree(small_run.path, tmp_path / "copy"))
    edit(copy, dataset=os.path.relpath(tiny_dataset, copy))
    return copy


def edit(run: Path, **changes: Any) -> None:
    file = run / "config.json"
    # As Python writes infinity, which no JSON knows.
    entries = {**json.loads(file.read_text()), **changes, "seal": BLANK}
    file.write_bytes(sealed(json.dumps(entries).encode()))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"grid_side": -1}, "--grid-side -1: expected at least 1"),
        ({"grid_side": 10**6}, "--grid-side 1000000: expected at most 1024"),
        ({"seed": float("inf")}, "expected JSON, got something else"),
        ({"seed": 1e300}, "seed: expected a whole number, found 1e"),
        ({"frames": [2, 1]}, r"frames: expected a list of ascending numbers, found \[2, 1\]"),
        ({"frames": []}, "frames: expected a list of ascending numbers"),
        ({"batch_entries": 0}, "--batch-entries 0: expected at least 1"),
        ({"unexplained": 7.0}, "--unexplained 7.0: expected at most 1.0"),
        ({"without": "prune"}, "without: expected a list, found 'prune'"),
        ({"train_s": None}, "train_s: expected a number, found null"),
    ],
)
def test_settings_out_of_range_are_refused(copy: Path, changes: dict, said: str) -> None:
    edit(copy, **changes)
    with pytest.raises(RfgsError, match=rf"config\.json: .*{said}"):
        open_run(copy)


def changed(file: Path, change: Callable[[dict[str, np.ndarray]], dict[str, Any]]) -> None:
    arrays = load_arrays(file, "")
    arrays |= change(arrays)
    save_arrays(file, {name: value for name, value in arrays.items() if value is not None})


def test_features_of_other_gaussians_are_refused(copy: Path) -> None:
    file = copy / "gaussians/000001.features.npz"
    changed(file, lambda arrays: {name: value[:-1] for name, value in arrays.items()})
    with pytest.raises(RfgsError, match="holds 40 Gaussians, but there are features of 39"):
        open_run(copy).attributes(1)


@pytest.mark.parametrize("name", ["gamma", "track_id", "body"])
def test_missing_attributes_are_refused(copy: Path, name: str) -> None:
    changed(copy / "gaussians/000001.features.npz", lambda _: {name: None})
    with pytest.raises(
        RfgsError, match=f"missing {name}; delete what is damaged and run the same `rfgs train`"
    ):
        open_run(copy).attributes(1)


def test_a_complex_head_is_refused(copy: Path) -> None:
    file = copy / "radio_head.npz"
    changed(file, lambda arrays: {"directions": arrays["directions"].astype(np.complex128)})
    with pytest.raises(RfgsError, match="directions: expected float32, got complex128"):
        _ = open_run(copy).head
