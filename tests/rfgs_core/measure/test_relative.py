# SPDX-License-Identifier: Apache-2.0
"""CSI ratios and conjugate products: plain twins, closed forms, gradients, and what they ignore."""

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
from rfgs_core.evaluate.metrics import evaluate_run
from rfgs_core.files import write_json
from rfgs_core.fit.task import Task, batch
from rfgs_core.measure.observations import Observations, observe
from rfgs_core.measure.phase_free import direct_wave
from rfgs_core.measure.relative import (
    RULES,
    on_direct_paths,
    product_change,
    ratio_change,
    relative_change,
)
from rfgs_core.model.comparison import comparison_of
from rfgs_core.settings import TrainConfig

KINDS = ["csi_ratio", "conjugate"]
#: Two device pairs of three links and one, so that one of them has no ratio.
PAIR = torch.tensor([0, 1, 0, 0])


def draws(seed: int, small: float = 0.3) -> tuple[torch.Tensor, torch.Tensor]:
    """An empty room and a packet of it, four links of five subcarriers."""
    rng = np.random.default_rng(seed)
    parts = rng.standard_normal((4, 4, 5))
    empty = torch.from_numpy(parts[0] + 1j * parts[1])
    return empty, empty + small * torch.from_numpy(parts[2] + 1j * parts[3])


def turn(rng: np.random.Generator, subcarriers: int) -> np.ndarray:
    """Gain, phase and timing that a packet between two devices has of its own."""
    phase = rng.uniform(0, 2 * np.pi) + rng.uniform(-0.5, 0.5) * np.arange(subcarriers)
    return rng.uniform(0.3, 3.0) * np.exp(1j * phase)


def test_the_ratio_is_that_of_single_antennas() -> None:
    empty, now = draws(1)
    found = ratio_change(now, empty, PAIR)
    links = [0, 2, 3]
    for f in range(5):
        for r in links:
            over = sum(empty[s, f].conj() * (now[s, f] / now[r, f]) for s in links)
            own = sum(abs(empty[s, f]) ** 2 for s in links)
            assert torch.isclose(found[r, f], own / over - empty[r, f])
    # One link alone has no ratio.
    assert found[1].abs().max() < 1e-12


def test_the_product_is_that_of_pairs_of_antennas() -> None:
    empty, now = draws(2)
    found = product_change(now, empty, PAIR)
    for links in ([0, 2, 3], [1]):
        own = (empty[links].abs() ** 2).sum() / (now[links].abs() ** 2).sum()
        for f in range(5):
            for r in links:
                product = sum(now[r, f] * now[s, f].conj() * empty[s, f] for s in links)
                weight = sum(abs(empty[s, f]) ** 2 for s in links)
                assert torch.isclose(found[r, f], own * product / weight - empty[r, f])


@pytest.mark.parametrize("kind", KINDS)
def test_gain_phase_and_timing_of_a_packet_change_nothing(kind) -> None:
    empty, now = draws(3)
    rng = np.random.default_rng(3)
    turns = torch.from_numpy(np.stack([turn(rng, 5), turn(rng, 5)]))[PAIR]
    change = RULES[kind][0]
    torch.testing.assert_close(change(now * turns, empty, PAIR), change(now, empty, PAIR))
    assert change(empty * turns, empty, PAIR).abs().max() < 1e-12


@pytest.mark.parametrize("kind", KINDS)
def test_the_linear_part_is_that_of_a_small_change(kind) -> None:
    empty, now = draws(4, small=1e-6)
    change, linear = RULES[kind]
    found = linear(now - empty, empty, PAIR)
    torch.testing.assert_close(found, change(now, empty, PAIR), rtol=1e-4, atol=1e-10)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("part", [0, 1])
def test_gradients_are_those_of_finite_differences(kind, part) -> None:
    empty, now = draws(5)
    inputs = (now if part == 0 else now - empty).requires_grad_(True)
    assert torch.autograd.gradcheck(lambda h: RULES[kind][part](h, empty, PAIR), (inputs,))


def test_a_fade_of_all_antennas_stays_finite() -> None:
    empty, now = draws(6)
    # At a right angle to the empty room, where a ratio has no bound.
    along = (empty[[0, 2, 3]].conj() * now[[0, 2, 3]]).sum(dim=0)
    now[[0, 2, 3]] -= empty[[0, 2, 3]] * along / (empty[[0, 2, 3]].abs() ** 2).sum(dim=0)
    assert ratio_change(now, empty, PAIR).isfinite().all()
    nothing = torch.zeros_like(empty)
    assert ratio_change(now, nothing, PAIR).isfinite().all()
    assert product_change(nothing, empty, PAIR).isfinite().all()


def turned(seen: Observations, csi: np.ndarray, seed: int) -> np.ndarray:
    """Channels of which every pair of different devices is a packet of its own."""
    pair, names = seen.layout.pairs_of(np.ones_like(seen.links))
    rng, out = np.random.default_rng(seed), csi.astype(np.complex128)
    for index, (a, b) in enumerate(names):
        if a != b:
            out[pair == index] *= turn(rng, csi.shape[-1])
    return out


def test_direct_paths_bring_back_phase_and_timing(make_observations) -> None:
    seen = make_observations(num_subcarriers=64, freq_min_hz=5.0e9, freq_max_hz=5.3e9)
    wave = direct_wave(seen.layout, seen.freq_hz)
    args = seen.links, seen.subcarriers, seen.layout, seen.freq_hz
    found = on_direct_paths(turned(seen, wave, 7), *args)
    error = np.angle((found * wave.conj())[seen.links][:, seen.subcarriers])
    # Half a step of delay, π/(64 · 64) per subcarrier, from the first to the last.
    assert np.abs(error).max() < np.pi / 64


@pytest.mark.parametrize("kind", KINDS)
def test_the_comparison_of_the_true_change_is_what_is_reported(make_observations, kind) -> None:
    seen = make_observations()
    rng = np.random.default_rng(8)
    noise = rng.standard_normal((2, *seen.delta.shape))
    level = 0.1 * np.abs(seen.static).max()
    delta = np.where(seen.links[..., None] & seen.subcarriers, noise[0] + 1j * noise[1], 0) * level
    args = seen.links, seen.subcarriers, seen.layout
    change = relative_change(kind, turned(seen, seen.static + delta, 8), seen.static, *args)
    comparison = comparison_of(replace(seen, delta=change, kind=kind))
    rows = torch.from_numpy(delta[seen.links][:, seen.subcarriers].astype(np.complex64))
    want = comparison.measured()
    every = np.arange(len(rows))
    near = {"rtol": 1e-3, "atol": 1e-4 * float(want.abs().max())}
    torch.testing.assert_close(comparison.predicted(rows, every), want, **near)
    # A batch holds whole pairs, and says the same of them.
    together = comparison.together
    assert together is not None
    some = np.flatnonzero(together != 0)
    torch.testing.assert_close(comparison.predicted(rows[some], some), want[some], **near)
    left = comparison.residual(replace(seen, delta=change, kind=kind), rows)
    assert np.abs(left.delta).max() < 1e-3 * np.abs(change).max()


def test_a_batch_holds_whole_device_pairs(make_observations) -> None:
    seen = make_observations()
    seen = replace(seen, delta=seen.static, kind="csi_ratio")
    config = TrainConfig(observe="csi_ratio", batch_entries=3 * int(seen.subcarriers.sum()))
    task = Task.of(seen, config, 0, lambda _seen, points: np.zeros((len(points), 32)))
    together = task.comparison.together
    assert together is not None
    drawn = set()
    for step in range(8):
        links, _ = batch(task, config, 0, step)
        chosen = np.unique(together[links])
        assert len(links) == np.isin(together, chosen).sum()
        assert len(links) < len(together)
        drawn |= set(chosen.tolist())
    assert len(drawn) > 1


def shake(dataset: Path) -> None:
    """Gives every stored packet, and the empty room, a gain, phase and timing per device pair."""
    files = SequenceFiles(dataset / "tiny")
    sequence = open_dataset(dataset).sequence()
    for frame in (1, 2, None):
        name = "csi" if frame else "csi_static"
        value = sequence.csi("wifi", frame) if frame else sequence.csi_static("wifi")
        seen = observe(sequence, "wifi", 1)
        out = turned(seen, value, frame or 9)
        if not frame:
            # The level of the empty room is that of a capture that may be averaged.
            out *= np.abs(value) / np.maximum(np.abs(out), 1e-30)
        out = out.astype(value.dtype)
        array = zarr.open_array(str(files.csi("wifi") / name), mode="r+")
        array[frame - 1 if frame else ...] = out
        write_json(files.csi_done("wifi", frame), {"sha256": digest(out)})


@pytest.mark.parametrize("kind", KINDS)
def test_no_stage_reads_what_a_packet_shares(
    tiny_dataset: Path, own_dataset: Path, train, quick_config, tmp_path, kind
) -> None:
    shake(own_dataset)
    plain, shaken = (open_dataset(d).sequence() for d in (tiny_dataset, own_dataset))
    assert not np.allclose(plain.csi("wifi", 1), shaken.csi("wifi", 1))
    before, after = (observe(s, "wifi", 1, kind=kind) for s in (plain, shaken))
    assert before.changed
    for name in ("delta", "static"):
        one, other = getattr(before, name), getattr(after, name)
        np.testing.assert_allclose(other, one, atol=0.06 * np.abs(one).max())
    run = train(own_dataset, tmp_path / "run", replace(quick_config, observe=kind), [1])
    centre = run.moving(1).means.mean(dim=0).numpy()
    assert np.linalg.norm(centre[:2] - [1.3, 1.4]) < 0.35
    metrics = evaluate_run(run, oracle=False)
    assert metrics["conditions"]["observe"] == kind
    assert "without the phases" in metrics["reasons"]["baselines.gaussian_process"]
    assert metrics["baselines"]["clean"]["geometry"]["f10"] is not None
