# SPDX-License-Identifier: Apache-2.0
"""Numbers about a dataset agree with closed forms."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path

import capture_files as files
import numpy as np

from dataset_factory.check.stats import delay_spread_s, stats
from dataset_factory.cli.stats import StatsArgs, run
from rfgs_core.cli import main
from rfgs_core.dataset import open_dataset


def test_delay_spread_of_two_paths_is_half_their_distance() -> None:
    subcarriers, spacing_hz = 256, 1e6
    freq_hz = np.arange(subcarriers) * spacing_hz
    apart_s = 200e-9
    for first_s in (10e-9, 900e-9):
        paths = np.exp(-2j * np.pi * freq_hz * first_s)
        both = paths + np.exp(-2j * np.pi * freq_hz * (first_s + apart_s))
        one, two = delay_spread_s(np.stack([paths, both]), spacing_hz)
        assert one < 1 / (subcarriers * spacing_hz)
        # Two equal paths: σ = distance / 2, widened by the window's own width.
        assert np.isclose(two, np.hypot(apart_s / 2, one), rtol=0.02)


def test_numbers_of_a_known_dataset(tiny_dataset: Path) -> None:
    found = stats(tiny_dataset)["sequences"]["tiny"]
    assert (found["frames"], found["cameras"], found["fps"]) == (2, 4, 10.0)
    radio = found["radios"]["wifi"]
    assert (radio["devices"], radio["tx_elements"], radio["rx_elements"]) == (4, 4, 32)
    assert radio["links"] == 128 and radio["device_pairs"] == 16
    sequence = open_dataset(tiny_dataset).sequence()
    static = sequence.csi_static("wifi").astype(complex)
    ratios = [
        np.linalg.norm(sequence.csi("wifi", f) - static) / np.linalg.norm(static) for f in (1, 2)
    ]
    expected_db = 10 * np.log10(np.median(np.square(ratios)))
    assert np.isclose(radio["dynamic_to_static_db"], expected_db, atol=1e-3)
    # The strongest links are a device's own, 0.3 m apart: Friis.
    own_db = 20 * np.log10(299_792_458 / 5.8e9 / (4 * np.pi * 0.3))
    assert abs(radio["level_db"]["p99"] - own_db) < 1.0
    labels = found["labels"]
    assert labels["people"] == 1 and labels["actions_frames"] == {"stand": 2}
    assert np.isclose(labels["path_m"]["1"], 0.2)
    assert np.isclose(labels["floor_visited_share"], 2 / 144, atol=1e-4)


def test_an_aperture_has_no_empty_room(tmp_path: Path, capsys) -> None:
    files.afrl_file(tmp_path / "a.mat")
    assert main(["import", str(tmp_path / "a.mat"), "--out", str(tmp_path / "out")]) == 0
    capsys.readouterr()
    assert run(StatsArgs(tmp_path / "out", json=True)) == 0
    (sequence,) = json.loads(capsys.readouterr().out)["sequences"].values()
    assert sequence["radios"]["sar_capture"]["dynamic_to_static_db"] is None


def test_the_command_prints_a_table_and_json(
    factory_here: Callable[..., subprocess.CompletedProcess[str]], tiny_dataset: Path
) -> None:
    table = factory_here("stats", str(tiny_dataset))
    assert table.returncode == 0 and "radios.wifi.dynamic_to_static_db" in table.stdout
    value = json.loads(factory_here("stats", str(tiny_dataset), "--json").stdout)
    assert value["sequences"]["tiny"]["radios"]["wifi"]["subcarriers"] == 16
