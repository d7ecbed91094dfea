# SPDX-License-Identifier: Apache-2.0
"""Filling hidden channel entries from visible ones: what all interpolating baselines share.

Three kinds of entries are hidden: array columns, subcarriers and whole device pairs. Subcarriers
and columns keep the phase; a pair of other devices has a phase of its own that nothing visible
determines, so only the level of the nearest visible pair's channel is adapted.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Complex

from rfgs_core.evaluate.evidence import BaselineResult, Evidence
from rfgs_core.measure.completion import Interpolator, fill_columns, fill_subcarriers
from rfgs_core.radio.levels import decibels, power_of

WHY_NO_SCORE = "interpolates channels and says nothing about space"


def interpolating_baseline(
    evidence: Evidence, along: Interpolator, level_db: Interpolator | None
) -> BaselineResult:
    """Fills csi − csi_static and csi_static alike.

    Args:
        evidence: The frame.
        along: Interpolates complex values along columns and along subcarriers.
        level_db: Interpolates mean power [dB] between device pairs, whose coordinates are both
            device positions [m]; None keeps the level of the nearest pair.
    """
    return BaselineResult(
        delta=fill(evidence.delta, evidence, along, level_db),
        static=fill(evidence.static, evidence, along, level_db),
        reason=WHY_NO_SCORE,
    )


def fill(
    field: Complex[np.ndarray, "tx rx subcarrier"],
    evidence: Evidence,
    along: Interpolator,
    level_db: Interpolator | None = None,
) -> Complex[np.ndarray, "tx rx subcarrier"]:
    """A field without NaN: hidden entries interpolated, links that are not measured zero."""
    layout, subcarrier_visible = evidence.layout, evidence.subcarrier_visible
    out = np.zeros_like(field)
    pairs: dict[tuple[int, int], np.ndarray] = {}
    for pair in layout.device_pairs:
        tx, rx = layout.block_of(*pair)
        seen = evidence.link_visible[tx, rx].any(axis=0)
        if not seen.any():
            continue
        block = fill_subcarriers(field[tx, rx[:, seen]], subcarrier_visible, along)
        block = fill_columns(block, layout.rx_column[rx[0]], seen, along)
        out[tx, rx] = pairs[pair] = block
    _fill_pairs(out, pairs, evidence, level_db)
    out[~layout.measured] = 0.0
    return out


def completed(
    predicted: Complex[np.ndarray, "tx rx subcarrier"],
    field: Complex[np.ndarray, "tx rx subcarrier"],
    evidence: Evidence,
    along: Interpolator,
) -> Complex[np.ndarray, "tx rx subcarrier"]:
    """A prediction and what it leaves of a field's visible entries, interpolated.

    Between devices that heard nothing of each other the prediction stays as it is.
    """
    unexplained = field - np.where(np.isnan(field), 0.0, predicted)
    residual = fill(unexplained.astype(np.complex64), evidence, along)
    for pair in evidence.layout.device_pairs:
        block = evidence.layout.block_of(*pair)
        if not evidence.link_visible[block].any():
            residual[block] = 0.0
    return predicted + residual


def _fill_pairs(
    out: Complex[np.ndarray, "tx rx subcarrier"],
    pairs: dict[tuple[int, int], np.ndarray],
    evidence: Evidence,
    level_db: Interpolator | None,
) -> None:
    """Fills hidden device pairs in place from the nearest visible one."""
    layout = evidence.layout
    hidden = [pair for pair in layout.device_pairs if pair not in pairs]
    if not hidden or not pairs:
        return
    where = {pair: np.concatenate(layout.centres_of(*pair)) for pair in layout.device_pairs}
    names = list(pairs)
    known = np.stack([where[name] for name in names])
    power = np.array([np.mean(np.abs(pairs[name]) ** 2) for name in names])
    for pair in hidden:
        nearest = int(np.argmin(np.linalg.norm(known - where[pair], axis=1)))
        value = pairs[names[nearest]]
        if level_db is not None and (power > 0.0).all():
            level = level_db(decibels(power, least=0.0)[:, None], known, where[pair][None])[0, 0]
            value = value * np.sqrt(power_of(level) / power[nearest])
        out[layout.block_of(*pair)] = value
