# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import json
import math
import re
from typing import Any

import numpy as np
import pytest

from rfgs_core.evaluate.baselines import BASELINES
from rfgs_core.evaluate.geometry import GEOMETRY_KEYS
from rfgs_core.evaluate.image import IMAGE_KEYS
from rfgs_core.evaluate.metrics import evaluate_run
from rfgs_core.evaluate.price import price_line
from rfgs_core.evaluate.rf import RF_KEYS
from rfgs_core.evaluate.verdicts import LOST, WON, verdicts
from rfgs_core.past import count_in_words

REQUIRED = (
    "zero",
    "nearest_element",
    "matched_filter",
    "template",
    "empty_room",
    "silhouette",
    "oracle_init",
)


@pytest.fixture(scope="module")
def metrics(evaluated_run) -> dict[str, Any]:
    return json.loads((evaluated_run.path / "metrics.json").read_text())


def walk(value: Any, path: str = ""):
    if isinstance(value, dict):
        for key, part in value.items():
            yield from walk(part, f"{path}.{key}")
    elif isinstance(value, list):
        for index, part in enumerate(value):
            yield from walk(part, f"{path}[{index}]")
    else:
        yield path, value


def test_metrics_hold_every_promised_group(metrics) -> None:
    for groups in (metrics, *(metrics["baselines"][name] for name in (*REQUIRED, *BASELINES))):
        assert set(groups["geometry"]) == set(GEOMETRY_KEYS)
        assert set(RF_KEYS) <= set(groups["rf"])
        assert set(groups["image"]) == set(IMAGE_KEYS)
    assert set(metrics["limits"]) == {"range_resolution_m", "cross_range_m"}
    assert metrics["trace_depth"] == 1
    assert metrics["n_gaussians"] == 600
    assert metrics["train_s"] == 1.5
    assert [row["frame"] for row in metrics["frames"]] == [1, 2]
    for path, value in walk(metrics):
        assert not isinstance(value, float) or math.isfinite(value), path


def test_gaussians_on_the_surface_find_it_and_their_channel_counts(metrics) -> None:
    # The ball has 1.1 m² of surface, K follows from 1.6 m²: precision suffers a little.
    assert metrics["geometry"]["f10"] > 0.95
    assert metrics["geometry"]["centroid_m"] < 0.03
    alone = metrics["baselines"]["gaussians_alone"]["rf"]
    assert alone["element_snr_db"] == pytest.approx(20.0, abs=1e-3)
    assert alone["subcarrier_snr_db"] == pytest.approx(20.0, abs=1e-3)
    assert alone["device_gain_mae_db"] == pytest.approx(0.915, abs=1e-3)
    # What they leave is a tenth of a smooth channel, and is kriged.
    assert metrics["rf"]["element_snr_db"] > 30.0
    assert metrics["rf"]["subcarrier_snr_db"] > 30.0
    assert metrics["rf"]["device_gain_mae_db"] == pytest.approx(0.915, abs=1e-3)
    assert metrics["baselines"]["zero"]["rf"]["element_snr_db"] == pytest.approx(0.0, abs=1e-9)
    assert any(line.startswith(WON) and "matched_filter" in line for line in metrics["verdicts"])


def test_missing_values_have_reasons(metrics) -> None:
    assert "--no-oracle" in metrics["reasons"]["baselines.oracle_init"]
    if metrics["image"]["lpips"] is None:
        assert metrics["reasons"]["image.lpips"]
    assert metrics["baselines"]["linear"]["geometry"]["f10"] is None
    assert metrics["reasons"]["baselines.linear"]


def test_pictures_have_their_baselines(metrics) -> None:
    assert metrics["image"]["psnr"] is not None
    silhouette = metrics["baselines"]["silhouette"]["image"]
    empty = metrics["baselines"]["empty_room"]["image"]
    # The ball is one colour, so the silhouette is almost the true picture.
    assert silhouette["psnr_person"] > 35.0 > empty["psnr_person"]
    assert silhouette["psnr"] > empty["psnr"]


def test_a_displaced_fit_is_reported_as_losing(surface_run) -> None:
    surface_run.shift_m = np.array([0.8, 0.0, 0.0])
    surface_run.frames = [2]
    metrics = evaluate_run(surface_run, oracle=False)
    assert metrics["geometry"]["f10"] < 0.1
    assert metrics["geometry"]["tracked"] == 0.0
    assert metrics["geometry"]["centroid_m"] == pytest.approx(0.8, abs=0.05)
    line = metrics["verdicts"][0]
    assert line.startswith(LOST)
    assert "half a metre" in line


def judged(own: float, baseline: float, oracle: float | None) -> list[str]:
    def group(f10: float | None) -> dict[str, Any]:
        return {"geometry": {"f05": f10, "f10": f10}, "rf": {}, "image": {}}

    baselines = {name: group(None) for name in BASELINES} | {
        "matched_filter": group(baseline),
        "matched_filter_different_sum": group(baseline),
        "oracle_init": group(oracle),
    }
    limits = {"range_resolution_m": 0.9, "cross_range_m": 0.6}
    return verdicts({**group(own), "baselines": baselines, "limits": limits})


def test_a_lost_comparison_says_whether_the_optimisation_is_at_fault() -> None:
    assert judged(0.5, 0.4, None)[0] == "Won: F10 0.500 against 0.400 of matched_filter (+0.100)."
    assert "optimisation is at fault" in judged(0.4, 0.5, 0.8)[0]
    assert "data and the model set the limit" in judged(0.4, 0.5, 0.45)[0]
    assert "not known" in judged(0.4, 0.5, None)[0]


def test_a_baseline_ahead_in_either_score_is_named() -> None:
    def group(f05: float | None, f10: float | None) -> dict[str, Any]:
        return {"geometry": {"f05": f05, "f10": f10}, "rf": {}, "image": {}}

    baselines = {name: group(None, None) for name in BASELINES} | {
        "matched_filter": group(0.6, 0.4), "body_prior": group(0.58, 0.8),
    }  # fmt: skip
    limits = {"range_resolution_m": 0.9, "cross_range_m": 0.6}
    said = verdicts({**group(0.57, 0.84), "baselines": baselines, "limits": limits})
    assert "Lost: F5 0.570 against matched_filter (0.600), body_prior (0.580)." in said
    assert not any(line.startswith("Lost: F10") for line in said)


def test_frames_in_which_nothing_was_found_are_told() -> None:
    """Their F-score is zero, but there is no distance to be counted."""
    found = {"geometry": {"f10": 0.5, "centroid_m": 0.1}}
    empty = {"geometry": {"f10": 0.0, "centroid_m": None}}
    for frames, line in (
        ([found, empty, found], "in 1 of 3 frames nothing was found"),
        ([found], None),
    ):
        nobody = {name: {"geometry": {}, "rf": {}, "image": {}} for name in BASELINES}
        metrics = {"geometry": {}, "rf": {}, "image": {}, "baselines": nobody, "frames": frames}
        metrics["limits"] = {"range_resolution_m": 0.9, "cross_range_m": 0.6}
        told = [one for one in verdicts(metrics) if "nothing was found" in one]
        assert len(told) == (line is not None) and all(line in one for one in told)


@pytest.mark.parametrize(
    ("own", "sentence"),
    [
        (0.8, "Won: 60 % of what the radar image lacks to a full match (1 − F10) is gained; the"),
        (0.6, "Lost: 20 % of what the radar image lacks to a full match (1 − F10) is gained; the"),
        (
            0.235,
            "Lost: 53 % more is lacking to a full match (1 − F10) than with the radar image; the",
        ),
    ],
)
def test_an_error_that_grew_is_not_removed(own: float, sentence: str) -> None:
    assert judged(own, 0.5, 0.8)[1].startswith(sentence)


def test_an_evaluation_says_its_price_and_learns_from_it(
    surface_run, capsys, tmp_path, monkeypatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    without, fit = (price_line(surface_run, 2, oracle=oracle) for oracle in (False, True))
    assert "usual speeds of two cores" in without and "--no-oracle" not in without
    assert f"{len(surface_run.frames)} fits from the true surface" in fit
    assert fit.endswith("--no-oracle is less")
    evaluate_run(surface_run, oracle=False)
    said = capsys.readouterr().err
    frames = count_in_words(len(surface_run.frames), "frame")
    assert f"{frames} beside {len(BASELINES)} baselines" in said
    assert "evaluate" not in price_line(surface_run, 0, oracle=False)
    assert "as measured here before" in price_line(surface_run, 0, oracle=False)
    # The first frame waits for kernels too: no time left is made of it.
    bars = re.findall(r"evaluate: .*?(\d+)/\d+ \[([^\]]*)\]", said)
    first = [clock for steps, clock in bars if 0 < int(steps) <= len(BASELINES)]
    assert first and not any("<" in clock for clock in first)
    assert "<" in bars[-1][1]


def test_evaluation_is_repeatable(metrics, surface_run) -> None:
    surface_run.frames = [2]
    again = evaluate_run(surface_run, oracle=False)
    assert again["frames"] == metrics["frames"][1:]
