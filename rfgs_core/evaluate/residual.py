# SPDX-License-Identifier: Apache-2.0
"""The method's prediction of hidden entries: Gaussians, what they leave, and how far to trust both.

Gaussians say what is far from all that was measured; neighbouring antennas and subcarriers say what
physics has missed (regression kriging), with the covariance of the baseline `spectrum`. Which of
the two to believe differs between radios and device pairs: three answers are mixed, the
Gaussians', the Gaussians' with their residual carried on, and the channel carried on as it is.
Weights come from visible entries that are left out beforehand (stacking, Wolpert, Neural Networks
5(2), 1992), one set per device pair and kind of entry, none below zero, one at most in sum: what
none of the three can tell is predicted as nothing. Reflectivities are solved without what is left
out; places and shapes of Gaussians had seen it. Where nothing can be left out, the second answer
stands; device pairs without a visible link keep the prediction.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Complex, Complex64, Float64
from scipy.optimize import nnls

from rfgs_core.evaluate.baselines.interpolation import completed, fill
from rfgs_core.evaluate.evidence import Evidence
from rfgs_core.measure.observations import Kept
from rfgs_core.measure.spectrum import spectral

#: Row of the prediction of the Gaussians by themselves.
GAUSSIANS_ALONE = "gaussians_alone"
#: Weights where nothing can be left out: Gaussians with their residual.
_UNTRIED = np.array([0.0, 1.0, 0.0])
#: How strictly weights keep to a sum of one.
_STRICT = 1e4


@dataclass(frozen=True)
class Answer:
    """What is visible and what the Gaussians say from it."""

    change: Complex[np.ndarray, "tx rx subcarrier"]
    """Csi − csi_static, NaN where hidden."""
    predicted: Complex[np.ndarray, "tx rx subcarrier"]
    """The Gaussians' own csi − csi_static."""


def with_residual(
    predicted: Complex[np.ndarray, "tx rx subcarrier"],
    evidence: Evidence,
    from_less: Callable[[Kept], Answer],
) -> Complex64[np.ndarray, "tx rx subcarrier"]:
    """The prediction of csi − csi_static, completed by what is visible.

    Args:
        predicted: What the Gaussians say.
        evidence: What may be looked at.
        from_less: What there would be of some links and subcarriers only.
    """
    links, subcarriers = kept = _kept_for_choosing(evidence)
    less = from_less(kept)
    fewer = replace(evidence, delta=less.change, link_visible=links, subcarrier_visible=subcarriers)
    tried, answers = _answers(less.predicted, fewer), _answers(predicted, evidence)
    out = np.array(predicted, dtype=np.complex64)
    layout = evidence.layout
    index, names = layout.pairs_of(layout.measured)
    for number in range(len(names)):
        pair = index == number
        seen = pair & evidence.link_visible
        if not seen.any():
            continue
        columns = (seen & ~links)[..., None] & subcarriers
        gaps = (seen & links)[..., None] & evidence.subcarrier_visible & ~subcarriers
        for where, left_out in ((seen, gaps), (pair & ~seen, columns)):
            weights = _weights(tried[:, left_out], evidence.delta[left_out])
            out[where] = np.einsum("a,a...->...", weights, answers[:, where])
    visible = np.isfinite(evidence.delta)
    out[visible] = evidence.delta[visible]
    out[~layout.measured] = 0.0
    return out


def _kept_for_choosing(evidence: Evidence) -> Kept:
    """Links and subcarriers less as many as are held out: last columns, inner subcarriers."""
    column = evidence.layout.rx_column
    seen = np.unique(column[evidence.link_visible.any(axis=0)])
    hidden = len(np.unique(column)) - len(seen)
    links = evidence.link_visible.copy()
    if hidden < len(seen):
        links[:, np.isin(column, seen[len(seen) - hidden :])] = False
    subcarriers = evidence.subcarrier_visible.copy()
    first, last = _longest_run(subcarriers)
    count = min(int((~subcarriers).sum()), (last - first) // 2)
    middle = (first + last - count) // 2
    subcarriers[middle : middle + count] = False
    return links, subcarriers


def _longest_run(subcarriers: Bool[np.ndarray, "subcarrier"]) -> tuple[int, int]:
    """First and last + 1 of the most visible subcarriers in a row."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], subcarriers.astype(int), [0]])))
    runs = edges.reshape(-1, 2)
    longest = runs[int(np.argmax(runs[:, 1] - runs[:, 0]))]
    return int(longest[0]), int(longest[1])


def _answers(
    predicted: Complex[np.ndarray, "tx rx subcarrier"], evidence: Evidence
) -> Complex64[np.ndarray, "answer tx rx subcarrier"]:
    """Gaussians, Gaussians with their residual, and the channel without Gaussians."""
    carried = completed(predicted, evidence.delta, evidence, spectral)
    plain = fill(evidence.delta, evidence, spectral)
    return np.stack([predicted, carried, plain]).astype(np.complex64)


def _weights(
    tried: Complex64[np.ndarray, "answer n"], true: Complex64[np.ndarray, "n"]
) -> Float64[np.ndarray, "answer"]:
    """Least squares with weights of at least zero and at most one in sum."""
    known = np.isfinite(true)
    if not known.any():
        return _UNTRIED
    scale = float(np.linalg.norm(true[known]))
    if scale == 0.0:
        return np.zeros(len(tried))
    columns, target = tried[:, known].T / scale, true[known] / scale
    columns = np.concatenate([columns.real, columns.imag]).astype(np.float64)
    target = np.concatenate([target.real, target.imag]).astype(np.float64)
    weights = nnls(columns, target)[0]
    if weights.sum() > 1.0:
        # Without the limit the sum is larger, so with it the sum is one.
        ones = np.full((1, columns.shape[1]), _STRICT)
        weights = nnls(np.vstack([columns, ones]), np.append(target, _STRICT))[0]
    return weights
