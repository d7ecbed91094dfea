# SPDX-License-Identifier: Apache-2.0
"""Datasets of the fast tracer: beside those of Sionna RT, and the same bytes from any worker."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dataset_factory.check.validate import validate
from dataset_factory.make.generate import generate
from dataset_factory.plan.job import Job
from rfgs_core.dataset import open_dataset

MakeJob = Callable[..., Job]


def fast(job: Job) -> Job:
    return replace(job, plan=replace(job.plan, tracer="fast"))


def test_a_fast_dataset_is_sionnas_from_any_number_of_workers(
    make_job: MakeJob,
    box_dataset: Path,
    tmp_path: Path,
    data_of: Callable[[Path], dict[str, bytes]],
) -> None:
    for name, workers in (("1", 1), ("2", 2)):
        out = tmp_path / name
        assert generate(fast(make_job(out, images=False, workers=workers)))
        assert validate(out) == []
    # numba would refuse to compile anything more in this process.
    assert "NUMBA_NUM_THREADS" not in os.environ
    assert data_of(tmp_path / "1") == data_of(tmp_path / "2")
    sequences = [open_dataset(path).sequence() for path in (box_dataset, tmp_path / "1")]
    assert [sequence.info.tracer for sequence in sequences] == ["sionna", "fast"]
    channels = [sequence.radio("wifi") for sequence in sequences]
    for name, limit_db in (("csi_static", -60.0), ("csi", -40.0)):
        exact, found = (channel[name].to_numpy().astype(complex) for channel in channels)
        error = np.sum(np.abs(found - exact) ** 2) / np.sum(np.abs(exact) ** 2)
        assert 10 * np.log10(error) < limit_db


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (("--radio", "sar"), "--tracer fast: radio 'sar' has antennas that move"),
        (("--radio", "wifi", "--paths"), "--tracer fast keeps no tables of paths"),
    ],
)
def test_what_it_does_not_do_is_refused_before_anything_is_made(
    factory_here: Callable[..., Any],
    box_room: Path,
    tmp_path: Path,
    more: tuple[str, ...],
    said: str,
) -> None:
    out = tmp_path / "out"
    done = factory_here("generate", str(box_room), "--out", str(out), "--tracer", "fast", *more)
    assert done.returncode and said in done.stderr and not out.exists()
