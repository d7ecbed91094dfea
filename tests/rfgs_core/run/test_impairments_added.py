# SPDX-License-Identifier: Apache-2.0
"""Impairments that are added to a dataset after runs were trained on it."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from dataset_factory.make.impair import impair_dataset
from rfgs_core.dataset import open_dataset
from rfgs_core.errors import RfgsError
from rfgs_core.radio.impairments import Impairments
from rfgs_core.run import open_run
from rfgs_core.run.config import RunConfig
from rfgs_core.run.data import trained_sequence

NOISE = Impairments(thermal_noise=True, power_dbm=-40.0)
OTHER = Impairments(thermal_noise=True, power_dbm=-30.0)


def known_by(path: Path) -> dict[str, tuple[str, ...]]:
    """Digests by which runs may know a dataset, by their channel."""
    dataset = open_dataset(path)
    return {"clean": dataset.fingerprints("clean"), "impaired": dataset.fingerprints("impaired")}


def test_a_run_on_clean_channels_stays_valid(
    own_dataset: Path, tmp_path: Path, train, quick_config
) -> None:
    run = train(own_dataset, tmp_path / "run", quick_config, [1])
    assert run.config.dataset_fingerprint == open_dataset(own_dataset).fingerprint
    for settings in (NOISE, OTHER):
        impair_dataset(own_dataset, settings, replacing=True)
        assert open_dataset(own_dataset).fingerprint != run.config.dataset_fingerprint
        trained_sequence.cache_clear()
        assert open_run(run.path).sequence.frames
        # The same command goes on with it.
        again = train(own_dataset, run.path, quick_config, [1])
        assert again.config == run.config
    assert train(own_dataset, tmp_path / "later", quick_config, [1]).config.dataset_fingerprint == (
        run.config.dataset_fingerprint
    )


def test_a_clean_run_that_knows_the_digest_of_everything_stays_valid(
    own_dataset: Path, tmp_path: Path, train, quick_config
) -> None:
    """As runs have it that were trained before impairments were left out."""
    impair_dataset(own_dataset, NOISE)
    run = train(own_dataset, tmp_path / "run", quick_config, [1])
    whole = replace(run.config, dataset_fingerprint=open_dataset(own_dataset).fingerprint)
    assert whole != run.config
    whole.write(run.path)
    trained_sequence.cache_clear()
    assert open_run(run.path).sequence.frames
    train(own_dataset, run.path, quick_config, [1])
    assert RunConfig.read(run.path) == whole


def test_a_run_on_impaired_channels_notices_that_they_are_others(own_dataset: Path) -> None:
    impair_dataset(own_dataset, NOISE)
    (trained_on,) = known_by(own_dataset)["impaired"]
    place, run = own_dataset.resolve(), Path("run")
    assert trained_sequence(run, place, "tiny", trained_on, "impaired").frames
    impair_dataset(own_dataset, OTHER, replacing=True)
    trained_sequence.cache_clear()
    with pytest.raises(RfgsError, match="was trained on another dataset"):
        trained_sequence(run, place, "tiny", trained_on, "impaired")


def test_clean_channels_that_are_others_are_noticed(own_dataset: Path, tmp_path: Path) -> None:
    before = known_by(own_dataset)
    copy = Path(shutil.copytree(own_dataset, tmp_path / "copy"))
    store = copy / "tiny/radio/wifi/csi.zarr/csi"
    chunk = next(path for path in store.rglob("*") if path.is_file() and path.name != "zarr.json")
    chunk.write_bytes(chunk.read_bytes()[::-1])
    with pytest.raises(RfgsError, match="mend the dataset first"):
        impair_dataset(copy, NOISE)
    impair_dataset(own_dataset, NOISE)
    assert known_by(own_dataset)["clean"][0] == before["clean"][0]
    # A manifest that is not the dataset's own vouches for nothing.
    manifest = own_dataset / "MANIFEST.sha256"
    manifest.write_text(manifest.read_text() + "0  more\n")
    assert before["clean"][0] not in known_by(own_dataset)["clean"]
