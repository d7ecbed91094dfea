# SPDX-License-Identifier: Apache-2.0
"""Gaussian radio fields as baselines of channels: fitted to what a frame's evidence shows."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import numpy as np
import torch
from jaxtyping import Bool, Complex64, Float64, Int64

from rfgs_core.evaluate.baselines.matched_filter import default_score
from rfgs_core.evaluate.baselines.scatterers import shown
from rfgs_core.evaluate.evidence import Baseline, BaselineResult, Evidence
from rfgs_core.evaluate.geometry import best_voxels
from rfgs_core.evaluate.metrics import METHOD, evaluate_answers
from rfgs_core.evaluate.pictures import Values
from rfgs_core.evaluate.residual import GAUSSIANS_ALONE, Answer, with_residual
from rfgs_core.evaluate.scene import EvaluatedRun
from rfgs_core.measure.observations import Kept
from rfgs_core.neural.direct_sum import DirectSum, Links, SumSettings, fit_direct_sum
from rfgs_core.neural.signal_fit import fit_channel
from rfgs_core.neural.signal_splat import SignalSplat, SplatSettings
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.seeds import sub_seed

#: Gaussians begin in this many times K voxels of the matched filter, as points of CLEAN and OMP do.
SEARCH_FACTOR = 3
WHY_NO_SCORE = "its Gaussians are seen from one receiver each, and stand for directions"


def channel_field(settings: SumSettings | SplatSettings, seed: int) -> Baseline:
    """The baseline that some settings are of: a direct sum, or signals splatted at each array."""

    def baseline(evidence: Evidence) -> BaselineResult:
        if not np.any(evidence.delta_or_zero) or len(_likely(evidence)) == 0:
            return BaselineResult(reason="the frame holds no energy")
        rng = np.random.default_rng(seed)
        if isinstance(settings, SumSettings):
            return _summed(evidence, settings, rng)
        return _splatted(evidence, settings, rng, seed)

    return baseline


def evaluate_channel_field(
    run: EvaluatedRun, settings: SumSettings | SplatSettings, seed: int
) -> tuple[dict[str, dict[str, Values]], float]:
    """Fits a field to every frame of a run that has nothing of its own, and judges it.

    As every field and every set of Gaussians, it stands with what it leaves of the visible channel
    carried on, and without.

    Args:
        run: Names data, radio and frames.
        settings: Which field.
        seed: Root seed.

    Returns:
        Groups of the field and of the field alone, and seconds of the fits.
    """
    spent = 0.0

    def answers(frame: int, evidence: Evidence) -> dict[str, BaselineResult]:
        nonlocal spent
        own = sub_seed(seed, run.sequence.name, run.config.radio, frame, "channel field")
        baseline, begin = channel_field(settings, own), time.perf_counter()
        alone = baseline(evidence)
        spent += time.perf_counter() - begin
        if alone.delta is None:
            return {METHOD: alone}
        whole = with_residual(alone.delta, evidence, lambda kept: _less(evidence, kept, baseline))
        return {METHOD: replace(alone, delta=whole), GAUSSIANS_ALONE: replace(alone, score=None)}

    groups = evaluate_answers(run, answers)
    return groups, round(spent, 2)


def _less(evidence: Evidence, kept: Kept, baseline: Baseline) -> Answer:
    """What a field says that is fitted to some links and subcarriers only."""
    links, subcarriers = kept
    seen = links[..., None] & subcarriers
    change = np.where(seen, evidence.delta, np.complex64(complex(np.nan, np.nan)))
    fewer = replace(
        evidence, delta=change, link_visible=links, subcarrier_visible=subcarriers, power_map=None
    )
    found = baseline(fewer).delta
    return Answer(change, np.zeros_like(evidence.delta) if found is None else found)


@lru_cache(maxsize=2)
def _likely(evidence: Evidence) -> Float64[np.ndarray, "N 3"]:
    """Middles of the best voxels of the matched filter [m]."""
    return evidence.grid.centres(
        best_voxels(default_score(evidence), SEARCH_FACTOR * evidence.voxels)
    )


def _draw(evidence: Evidence) -> Callable[[int, np.random.Generator], Float64[np.ndarray, "N 3"]]:
    def draw(count: int, rng: np.random.Generator) -> Float64[np.ndarray, "N 3"]:
        voxels, half = _likely(evidence), evidence.grid.voxel_m / 2.0
        chosen = voxels[rng.integers(len(voxels), size=count)]
        return chosen + rng.uniform(-half, half, (count, 3))

    return draw


def _summed(evidence: Evidence, settings: SumSettings, rng: np.random.Generator) -> BaselineResult:
    """A direct sum, each device pair with contributions of its own.

    Pairs that were never seen get the others' mean power and a phase of zero.
    """
    subcarriers = np.flatnonzero(evidence.subcarrier_visible)
    pair, pairs = evidence.layout.pairs_of(evidence.link_visible)
    tx, rx = np.nonzero(evidence.link_visible)
    csi = evidence.delta[tx, rx][:, subcarriers].astype(np.complex128)
    links = _links(evidence, tx, rx, pair[tx, rx], subcarriers)
    fitted = fit_direct_sum(links, torch.from_numpy(csi), _draw(evidence), settings, rng)
    every, names = evidence.layout.pairs_of(evidence.layout.measured)
    mean = fitted.contributions.abs().pow(2).mean(dim=0).sqrt().to(torch.complex128)
    rows = [fitted.contributions[pairs.index(n)] if n in pairs else mean for n in names]
    whole = DirectSum(fitted.means, fitted.log_scales, torch.stack(rows))
    tx, rx = np.nonzero(evidence.layout.measured)
    delta = np.zeros(evidence.delta.shape, dtype=np.complex64)
    everywhere = np.arange(len(evidence.freq_hz))
    delta[tx, rx] = whole.at(_links(evidence, tx, rx, every[tx, rx], everywhere)).numpy()
    score = shown(evidence.grid, fitted.means.numpy(), fitted.heard(links).numpy())
    return BaselineResult(score=score, delta=delta)


def _links(
    evidence: Evidence,
    tx: Int64[np.ndarray, "link"],
    rx: Int64[np.ndarray, "link"],
    group: Int64[np.ndarray, "link"],
    subcarriers: Int64[np.ndarray, "chosen"],
) -> Links:
    layout = evidence.layout
    wavenumber = 2.0 * np.pi * evidence.freq_hz[subcarriers] / SPEED_OF_LIGHT
    parts = (layout.rx_xyz[rx], layout.tx_xyz[tx], group, wavenumber)
    return Links(*(torch.from_numpy(np.ascontiguousarray(part)) for part in parts))


def _splatted(
    evidence: Evidence, settings: SplatSettings, rng: np.random.Generator, seed: int
) -> BaselineResult:
    """Splatted signals, a field for each receiving device; one that hears nothing stays silent."""
    layout = evidence.layout
    delta = np.zeros(evidence.delta.shape, dtype=np.complex64)
    for device in np.unique(layout.rx_device):
        own = layout.rx_device == device
        seen = evidence.link_visible & own
        if seen.any():
            delta[:, own] = _from_device(evidence, seen, own, settings, rng, seed)
    delta[~layout.measured] = 0.0
    return BaselineResult(delta=delta, reason=WHY_NO_SCORE)


def _from_device(
    evidence: Evidence,
    seen: Bool[np.ndarray, "tx rx"],
    own: Bool[np.ndarray, "rx"],
    settings: SplatSettings,
    rng: np.random.Generator,
    seed: int,
) -> Complex64[np.ndarray, "tx own subcarrier"]:
    """What all elements of a device hear of every transmitter, from the links that are seen."""
    layout, grid = evidence.layout, evidence.grid
    bounds_m = np.array([grid.axis_m(axis)[[0, -1]] for axis in range(3)]).T
    means = _draw(evidence)(settings.gaussians, rng)
    receiver = layout.rx_xyz[own].mean(axis=0)
    splat = SignalSplat(means, receiver, bounds_m, settings, seed)
    tx, rx = np.flatnonzero(seen.any(axis=1)), np.flatnonzero(seen.any(axis=0))
    subcarriers = np.flatnonzero(evidence.subcarrier_visible)
    wavenumber = torch.from_numpy(2.0 * np.pi * evidence.freq_hz / SPEED_OF_LIGHT)
    csi = torch.from_numpy(evidence.delta[np.ix_(tx, rx, subcarriers)])
    sent, elements = torch.from_numpy(layout.tx_xyz), torch.from_numpy(layout.rx_xyz)
    fit_channel(splat, sent[tx], elements[rx], wavenumber[subcarriers], csi, rng)
    with torch.no_grad():
        return splat.channel(sent, elements[own], wavenumber, float(wavenumber.mean())).numpy()
