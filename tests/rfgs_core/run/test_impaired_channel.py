# SPDX-License-Identifier: Apache-2.0
"""Fitting what imperfect radios report, held against the true channel."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dataset_factory.make.impair import impair_dataset
from rfgs_core.dataset import open_dataset
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.evaluate.metrics import evaluate_run
from rfgs_core.evaluate.scene import Scene
from rfgs_core.files import read_json
from rfgs_core.measure.observations import observe
from rfgs_core.radio.impairments import Impairments
from rfgs_core.run import open_run
from rfgs_core.seals import write_sealed_json


def test_the_gain_that_receivers_report_is_taken_out(own_dataset: Path) -> None:
    impair_dataset(own_dataset, Impairments(agc=True))
    sequence = open_dataset(own_dataset).sequence()
    gain_db = sequence.impairments("wifi").gain_db
    assert np.abs(gain_db).max() > 20 and np.ptp(gain_db[0][gain_db[0] != 0]) > 0
    for frame in sequence.frames:
        clean = observe(sequence, "wifi", frame)
        seen = observe(sequence, "wifi", frame, "impaired")
        scale = np.abs(sequence.csi("wifi", frame)).max()
        np.testing.assert_allclose(seen.delta, clean.delta, atol=1e-6 * scale)


def test_noise_reaches_the_fit_and_lost_packets_do_not(
    own_dataset: Path, tmp_path: Path, train, quick_config
) -> None:
    settings = Impairments(thermal_noise=True, power_dbm=-40.0, loss_rate=0.4)
    impair_dataset(own_dataset, settings, seed=1)
    config = replace(quick_config, channel="impaired")
    run = train(own_dataset, tmp_path / "run", config, [1])
    sequence, opened = run.sequence, open_run(run.path)
    assert opened.channel == "impaired"
    frame = sequence.frames[0]
    clean = observe(sequence, "wifi", frame)
    seen = observe(sequence, "wifi", frame, "impaired")
    lost = np.isnan(sequence.csi("wifi", frame, impaired=True)).all(axis=2)
    assert 0 < lost.sum() < lost.size
    np.testing.assert_array_equal(seen.links, clean.links & ~lost)
    heard = seen.links[..., None] & seen.subcarriers
    assert not np.allclose(seen.delta[heard], clean.delta[heard])
    assert np.isfinite(opened.predict(frame)).all()

    evidence = Scene.of(opened).evidence(frame, np.ones(Scene.of(opened).grid.shape, np.float32))
    np.testing.assert_array_equal(evidence.link_visible, seen.links)
    assert np.isnan(evidence.delta[lost]).all()
    np.testing.assert_array_equal(evidence.delta[heard], seen.delta[heard])

    metrics = evaluate_run(opened, oracle=True)
    assert metrics["conditions"]["label"].startswith("impaired, depth 1")
    assert "loss_rate 0.4" in metrics["conditions"]["impairments"]
    # The truth is the clean channel: predicting nothing misses exactly all of it.
    assert metrics["baselines"]["zero"]["rf"]["element_snr_db"] == pytest.approx(0.0, abs=1e-6)


def test_a_dataset_without_impaired_channels_is_refused(
    own_dataset: Path, tmp_path: Path, train, quick_config
) -> None:
    with pytest.raises(RfgsError, match="add them with: rfgs-factory impair"):
        train(own_dataset, tmp_path / "run", replace(quick_config, channel="impaired"))


def test_a_run_of_an_unknown_channel_is_refused(
    own_dataset: Path, tmp_path: Path, train, quick_config
) -> None:
    run = train(own_dataset, tmp_path / "run", quick_config)
    write_sealed_json(
        run.path / "config.json", {**read_json(run.path / "config.json"), "channel": "x"}
    )
    with pytest.raises(RfgsFormatError, match="channel: expected clean or impaired, found"):
        open_run(run.path)
