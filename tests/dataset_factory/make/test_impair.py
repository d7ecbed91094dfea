# SPDX-License-Identifier: Apache-2.0
"""Impaired channels stand beside the clean ones, sealed, seeded and reversible."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dataset_factory.check.validate import checksum_faults, validate
from dataset_factory.make.generate import generate
from dataset_factory.make.impair import impair_dataset
from dataset_factory.plan.job import Job
from rfgs_core.dataset import open_dataset
from rfgs_core.dataset.impaired_store import impaired_chunk, writing_impaired
from rfgs_core.dataset.schema import read_dataset_info
from rfgs_core.dataset.writer import write_dataset_info
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.radio.impairments import IMPAIRMENT_PRESETS, Impairments, restore


def test_impaired_channels_stand_beside_untouched_clean_ones(
    tiny_copy: Path, tiny_dataset: Path, data_of: Callable[[Path], dict[str, bytes]]
) -> None:
    settings = IMPAIRMENT_PRESETS["commodity"]
    impair_dataset(tiny_copy, settings)
    assert checksum_faults(tiny_copy) == []
    before, after = data_of(tiny_dataset), data_of(tiny_copy)
    sealed = {"dataset.json", "MANIFEST.sha256"}
    assert {name for name in before if after[name] != before[name]} == sealed
    dataset = open_dataset(tiny_copy)
    sequence = dataset.sequence()
    assert "csi_impaired" in dataset.has
    known = sequence.impairments("wifi")
    assert known.settings == settings and known.seed == 0
    data = sequence.radio("wifi")
    assert {"cfo_hz", "sto_s", "gain_db", "packet_received"} <= set(data.coords)
    for index, frame in enumerate(sequence.frames):
        value = sequence.csi_samples("wifi", frame, impaired=True)
        assert np.array_equal(data["csi_impaired"].values[index], value[0], equal_nan=True)
        one = slice(index, index + 1)
        spec, layout = sequence.radio_spec("wifi"), sequence.layout("wifi")
        back = restore(value, known.draw, spec, layout, one, known.gain_db[one])[0]
        clean, heard = sequence.csi("wifi", frame), np.isfinite(back)
        error = np.abs(back[heard] - clean[heard]) ** 2
        # Eight bits and the noise leave some 40 dB.
        assert error.sum() < 1e-3 * (np.abs(clean[heard]) ** 2).sum()


def test_the_same_seed_gives_the_same_bytes(
    tiny_copy: Path, tmp_path: Path, data_of: Callable[[Path], dict[str, bytes]]
) -> None:
    other = Path(shutil.copytree(tiny_copy, tmp_path / "other"))
    settings = Impairments(thermal_noise=True, cfo_std_hz=10.0)
    impair_dataset(tiny_copy, settings)
    impair_dataset(other, settings)
    assert data_of(tiny_copy) == data_of(other)
    impair_dataset(other, settings, seed=1, replacing=True)
    assert data_of(tiny_copy) != data_of(other)
    impair_dataset(other, settings, replacing=True)
    assert data_of(tiny_copy) == data_of(other)


def test_existing_impaired_channels_are_not_replaced_unasked(tiny_copy: Path) -> None:
    impair_dataset(tiny_copy, Impairments(thermal_noise=True))
    with pytest.raises(RfgsError, match="use --replace"):
        impair_dataset(tiny_copy, Impairments())


def test_an_interrupted_run_leaves_nothing_and_is_taken_up(
    tiny_copy: Path, data_of: Callable[[Path], dict[str, bytes]]
) -> None:
    store = open_dataset(tiny_copy).sequence().files.csi("wifi")
    before = data_of(tiny_copy)
    with pytest.raises(KeyboardInterrupt), writing_impaired(store):
        raise KeyboardInterrupt
    assert data_of(tiny_copy) == before
    # Killed outright: the temporary arrays stay, and the next run sweeps them away.
    (store / ".tmp-csi_impaired").mkdir()
    (store / ".tmp-csi_impaired" / "zarr.json").write_text("{}")
    impair_dataset(tiny_copy, Impairments(thermal_noise=True))
    assert checksum_faults(tiny_copy) == []


def test_damage_is_not_sealed_over(tiny_copy: Path) -> None:
    file = tiny_copy / "tiny/mask/cam00/000001.png"
    file.write_bytes(file.read_bytes()[:-1] + b"x")
    with pytest.raises(RfgsError, match=r"000001\.png: altered"):
        impair_dataset(tiny_copy, Impairments(thermal_noise=True))


def test_damaged_impaired_channels_are_named(tiny_copy: Path) -> None:
    sequence = open_dataset(tiny_copy).sequence()
    with pytest.raises(RfgsError, match="no impaired channels; add them with: rfgs-factory impair"):
        sequence.csi("wifi", 1, impaired=True)
    impair_dataset(tiny_copy, Impairments(thermal_noise=True))
    chunk = impaired_chunk(sequence.files.csi("wifi"), 1)
    chunk.write_bytes(chunk.read_bytes()[:-9])
    with pytest.raises(RfgsFormatError, match="c/1/0/0/0"):
        sequence.csi("wifi", 2, impaired=True)
    assert any(str(chunk) in fault for fault in validate(tiny_copy))


def test_the_command_impairs_and_explains(
    factory_here: Callable[..., Any], tiny_copy: Path, tmp_path: Path
) -> None:
    file = tmp_path / "mine.json"
    file.write_text(json.dumps({"loss_rate": 2}))
    wrong = factory_here("impair", str(tiny_copy), "--impairments", str(file))
    assert wrong.returncode == 2 and "loss_rate: expected 0 to 0.99" in wrong.stderr
    right = factory_here("impair", str(tiny_copy), "--impairments", "lab", "--radio", "wifi")
    assert right.returncode == 0, right.stderr
    assert "csi_impaired" in open_dataset(tiny_copy).has


def test_generate_makes_the_same_impaired_channels(
    make_job: Callable[..., Job],
    box_copy: Path,
    tmp_path: Path,
    unfinish: Callable[[Path], None],
) -> None:
    settings = IMPAIRMENT_PRESETS["lab"]
    later = Path(shutil.copytree(box_copy, tmp_path / "later"))
    impair_dataset(later, settings)
    unfinish(box_copy)
    info = read_dataset_info(box_copy / "dataset.json")
    config = {**info.config, "impairments": asdict(settings)}
    write_dataset_info(box_copy, replace(info, config=config))
    job = make_job(box_copy)
    job.plan = replace(job.plan, impairments=asdict(settings))
    assert generate(job)
    assert validate(box_copy) == []
    first, second = open_dataset(box_copy), open_dataset(later)
    assert first.has == second.has
    one, two = first.sequence(), second.sequence()
    for frame in one.frames:
        here, there = (s.csi("wifi", frame, impaired=True) for s in (one, two))
        assert np.array_equal(here, there, equal_nan=True)
