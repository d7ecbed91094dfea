# SPDX-License-Identifier: Apache-2.0
"""Pilots, nulls and the centre: what was not measured, filled from its neighbours."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Complex, Float, Int

#: Values that are filled at once.
_BLOCK = 1 << 20


def fill_gaps(
    values: Complex[np.ndarray, "*link bin"],
    valid: Bool[np.ndarray, "*any bin"],
    index: Int[np.ndarray, "bin"],
) -> Complex[np.ndarray, "*link bin"]:
    """Fills bins that were not measured, linearly between the nearest measured ones.

    Between measured bins a < k < b: H_k = e^{jsk} ((b − k) H_a e^{−jsa} + (k − a) H_b e^{−jsb}) /
    (b − a), with s the mean phase step per index, arg Σ H̄_m H_n of neighbours at index distance
    n − m. Complex numbers are interpolated, never wrapped phases, and without s, which the
    receiver's timing brings, a straight line between turning phasors would fade. Beyond the
    outermost measured bins the nearest one continues with the same step.

    Args:
        values: Channels.
        valid: Where they were measured; (bin,) where it is the same for all.
        index: True number of each bin, ascending; the grid may have holes.

    Returns:
        A copy; measured values are untouched, links without any measured bin stay as they are.
    """
    rows = values.reshape(-1, values.shape[-1]).copy()
    if valid.ndim == 1:
        step = max(_BLOCK // max(rows.shape[1], 1), 1)
        for first in range(0, len(rows), step):
            _fill(rows[first : first + step], slice(None), valid, index)
        return rows.reshape(values.shape)
    masks = np.broadcast_to(valid, values.shape).reshape(rows.shape)
    patterns, which = np.unique(np.packbits(masks, axis=1), axis=0, return_inverse=True)
    which = which.ravel()
    for number in range(len(patterns)):
        chosen = np.flatnonzero(which == number)
        _fill(rows, chosen, masks[chosen[0]], index)
    return rows.reshape(values.shape)


def phase_step(
    values: Complex[np.ndarray, "*link bin"],
    index: Int[np.ndarray, "bin"],
    *,
    shared: bool = False,
) -> Float[np.ndarray, "*link"]:
    """Mean phase step per index of each link [rad], arg Σ H̄_m H_n over neighbours m and n.

    Closest neighbours come first, as they turn least; what is left is then taken from all
    neighbours, of which a grid with holes has many more.

    Args:
        values: Channels.
        index: True number of each bin, ascending.
        shared: One step for all links of the last axis but one.
    """
    axis = (-2, -1) if shared else -1
    if len(index) < 2:
        return np.zeros(values.shape[:-2] if shared else values.shape[:-1])
    spacing = np.diff(index)
    near = np.flatnonzero(spacing == spacing.min())
    products = np.conj(values[..., near]) * values[..., near + 1]
    step = np.angle(products.sum(axis=axis)) / spacing.min()
    if 2 * len(near) >= len(spacing):
        return step
    # Pairs across a wide hole turn too far to tell by.
    close = np.flatnonzero(spacing <= 2 * spacing.min())
    products = np.conj(values[..., close]) * values[..., close + 1]
    shaped = step[..., None, None] if shared else step[..., None]
    left = products * np.exp(-1j * shaped * spacing[close])
    weight = np.abs(products)
    mean = (weight * spacing[close]).sum(axis=axis) / np.maximum(weight.sum(axis=axis), 1e-30)
    return step + np.angle(left.sum(axis=axis)) / np.maximum(mean, spacing.min())


def _fill(
    rows: Complex[np.ndarray, "row bin"],
    chosen: slice | Int[np.ndarray, "chosen"],
    mask: Bool[np.ndarray, "bin"],
    index: Int[np.ndarray, "bin"],
) -> None:
    """Fills the bins that one mask leaves out, in place."""
    known, gaps = np.flatnonzero(mask), np.flatnonzero(~mask)
    if not len(known) or not len(gaps):
        return
    step = phase_step(rows[chosen][:, known], index[known])[:, None]
    after = np.clip(np.searchsorted(known, gaps), 1, max(len(known) - 1, 1))
    left, right = known[after - 1], known[np.minimum(after, len(known) - 1)]
    span = np.maximum(index[right] - index[left], 1)
    weight = np.clip((index[gaps] - index[left]) / span, 0.0, 1.0)
    found = (1.0 - weight) * rows[chosen][:, left] * np.exp(1j * step * (index[gaps] - index[left]))
    found += weight * rows[chosen][:, right] * np.exp(1j * step * (index[gaps] - index[right]))
    every = np.arange(len(rows))[chosen]
    rows[np.ix_(every, gaps)] = found
