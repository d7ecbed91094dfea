# SPDX-License-Identifier: Apache-2.0
"""Radios without phases: what they report in closed form, and that no stage sees more."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
import zarr

from rfgs_core.dataset import open_dataset
from rfgs_core.dataset.csi_store import digest
from rfgs_core.dataset.names import SequenceFiles
from rfgs_core.encode import MATCHED_FILTER, PAPER_FILTER, matched_filter_map
from rfgs_core.errors import RfgsError
from rfgs_core.evaluate.metrics import evaluate_run
from rfgs_core.files import write_json
from rfgs_core.fit.sampling import encode
from rfgs_core.measure.delay_maps import delay_power_map
from rfgs_core.measure.observations import Observations
from rfgs_core.measure.phase_free import delay_amplitude, direct_wave, hologram
from rfgs_core.model.comparison import comparison_of
from rfgs_core.radio.constants import SPEED_OF_LIGHT

PLACE_M = np.array([1.4, 2.2, 1.1])


def echo(seen: Observations, place_m: np.ndarray, amplitude: float) -> np.ndarray:
    """A point that returns the same amplitude on every link."""
    layout = seen.layout
    path_m = np.linalg.norm(layout.tx_xyz - place_m, axis=1)[:, None]
    path_m = path_m + np.linalg.norm(layout.rx_xyz - place_m, axis=1)
    turns = path_m[..., None] * seen.freq_hz / SPEED_OF_LIGHT
    return amplitude * np.exp(-2j * np.pi * turns)


def reports(seen: Observations, delta: np.ndarray, kind: str) -> Observations:
    """The observations of an empty room of direct paths that changed by `delta`."""
    now, empty = seen.static + delta, seen.static
    if kind == "power":
        wave = direct_wave(seen.layout, seen.freq_hz)
        change = hologram(np.abs(now), np.abs(empty), seen.subcarriers, wave)
        return replace(seen, delta=change, kind="power")
    change = np.abs(
        delay_amplitude(now, seen.subcarriers) - delay_amplitude(empty, seen.subcarriers)
    )
    return replace(seen, delay_change=change, kind="delay_power")


def test_a_hologram_is_the_change_and_its_twin(make_observations) -> None:
    """With one direct path of amplitude a: Δ + u²Δ* + u|Δ|²/a."""
    seen = make_observations()
    small = np.abs(seen.static).min() * 1e-2
    delta = echo(seen, PLACE_M, small)
    wave = direct_wave(seen.layout, seen.freq_hz)
    flat = np.abs(seen.static).mean(axis=2, keepdims=True) * wave
    got = hologram(np.abs(flat + delta), np.abs(flat), seen.subcarriers, wave)
    expected = delta + wave**2 * delta.conj() + wave * np.abs(delta) ** 2 / np.abs(flat)
    np.testing.assert_allclose(got, expected, atol=1e-3 * small)


def test_the_map_of_a_hologram_peaks_where_the_echo_is(make_observations) -> None:
    seen = make_observations(freq_min_hz=5.0e9, freq_max_hz=6.0e9, num_subcarriers=64)
    change = reports(seen, echo(seen, PLACE_M, 1e-5), "power")
    axes = [np.arange(0.2, high, 0.1) for high in (4.0, 3.5, 2.5)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    pair, _ = seen.pairs
    power = matched_filter_map(change.delta, seen.layout, pair, seen.freq_hz, points)
    best = points[np.log(power).mean(axis=0).argmax()]
    np.testing.assert_allclose(best, PLACE_M, atol=0.11)


def test_an_echo_in_a_silent_room_has_its_amplitude_at_its_delay(make_observations) -> None:
    seen = make_observations(num_subcarriers=64, freq_min_hz=5.0e9, freq_max_hz=6.0e9)
    seen = replace(seen, static=np.zeros_like(seen.static))
    change = reports(seen, echo(seen, PLACE_M, 2e-4), "delay_power")
    np.testing.assert_allclose(delay_power_map(change, PLACE_M[None]), 4e-8, rtol=0.03)
    away = delay_power_map(change, np.array([[3.5, 0.5, 1.1]]))
    assert (away < 0.05 * 4e-8).any()


@pytest.mark.parametrize("kind", ["power", "delay_power"])
def test_the_comparison_of_the_true_change_is_what_is_reported(make_observations, kind) -> None:
    """Of delays only where the empty room is silent: otherwise a bound."""
    seen = make_observations()
    if kind == "delay_power":
        seen = replace(seen, static=np.zeros_like(seen.static))
    delta = echo(seen, PLACE_M, 1e-3)
    comparison = comparison_of(reports(seen, delta, kind))
    rows = np.arange(int(seen.links.sum()))
    change = torch.from_numpy(delta[seen.links][:, seen.subcarriers].astype(np.complex64))
    got, want = comparison.predicted(change, rows), comparison.measured()
    torch.testing.assert_close(got, want, rtol=1e-3, atol=1e-3 * float(want.abs().max()))
    linear = comparison.linear(1e-3 * change)
    if kind == "power":
        # |Δ|² is negligible of a small change.
        torch.testing.assert_close(
            linear, comparison.predicted(1e-3 * change, rows), rtol=0.02, atol=1e-7
        )
    else:
        assert linear is None


def test_profiles_bound_the_change_from_below(make_observations) -> None:
    seen = make_observations()
    delta = echo(seen, PLACE_M, 1e-3)
    change = reports(seen, delta, "delay_power").delay_change
    bound = delay_amplitude(delta, seen.subcarriers)
    assert (change <= bound * (1 + 1e-4) + 1e-9).all()


def test_learned_encoders_are_refused_without_subcarriers(make_observations) -> None:
    seen = reports(make_observations(), echo(make_observations(), PLACE_M, 1e-3), "delay_power")

    def learned(_: object, points: np.ndarray) -> np.ndarray:
        """Stands for a learned one: it is no matched filter."""
        return np.zeros((len(points), 32), np.float32)

    with pytest.raises(RfgsError, match="learned encoder reads the channel over subcarriers"):
        encode(seen, PLACE_M[None], learned)
    plain, paper = (encode(seen, PLACE_M[None], one) for one in (MATCHED_FILTER, PAPER_FILTER))
    assert torch.equal(plain.features, paper.features)


def turn_phases(dataset: Path, per_subcarrier: bool) -> None:
    """Multiplies random quarter turns, which are exact, onto every stored channel."""
    files = SequenceFiles(dataset / "tiny")
    store, rng = files.csi("wifi"), np.random.default_rng(3)
    sequence = open_dataset(dataset).sequence()
    for frame in (1, 2, None):
        name = "csi" if frame else "csi_static"
        value = sequence.csi("wifi", frame) if frame else sequence.csi_static("wifi")
        shape = value.shape if per_subcarrier else (*value.shape[:-1], 1)
        value = (value * np.array([1, 1j, -1, -1j])[rng.integers(4, size=shape)]).astype(
            value.dtype
        )
        array = zarr.open_array(str(store / name), mode="r+")
        array[frame - 1 if frame else ...] = value
        write_json(files.csi_done("wifi", frame), {"sha256": digest(value)})


@pytest.mark.parametrize(("kind", "per_subcarrier"), [("power", True), ("delay_power", False)])
def test_no_stage_reads_a_phase(
    tiny_dataset: Path, own_dataset: Path, train, quick_config, tmp_path, kind, per_subcarrier
) -> None:
    config = replace(quick_config, observe=kind)
    run = train(tiny_dataset, tmp_path / "plain", config)
    turn_phases(own_dataset, per_subcarrier)
    turned = train(own_dataset, tmp_path / "turned", config)
    before, after = (open_dataset(d).sequence().csi("wifi", 1) for d in (tiny_dataset, own_dataset))
    assert not np.allclose(before, after)
    for path in sorted(run.path.rglob("*.*")):
        if path.suffix in (".npz", ".ply"):
            same = turned.path / path.relative_to(run.path)
            assert path.read_bytes() == same.read_bytes(), path.name
    assert np.abs(run.predict(1)).max() > 0
    centre = run.moving(1).means.mean(dim=0).numpy()
    assert np.linalg.norm(centre[:2] - [1.3, 1.4]) < 0.35
    # What an evaluation leaves out is the same of every frame.
    metrics = evaluate_run(train(tiny_dataset, tmp_path / "one", config, [1]), oracle=False)
    assert metrics["conditions"]["observe"] == kind
    assert "without the phases" in metrics["reasons"]["baselines.gaussian_process"]
    assert metrics["baselines"]["gaussian_process"]["rf"]["element_snr_db"] is None
    assert metrics["baselines"]["matched_filter"]["geometry"]["f10"] is not None
    assert (metrics["baselines"]["clean"]["geometry"]["f10"] is None) == (kind == "delay_power")
