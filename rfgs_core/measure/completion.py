# SPDX-License-Identifier: Apache-2.0
"""Hidden entries of a frame's channel, told from the visible ones of the same device pair.

An array without its last columns has wider beams, a band with a hole has side lobes, and whoever
reads power in beams and ranges sees both. Echoes of a body come from few directions and delays, so
their spectra tell what the hidden entries hold, and beams are formed of all of them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Complex, Int

from rfgs_core.measure.observations import Observations
from rfgs_core.measure.spectrum import spectral

#: Values at `wanted` coordinates from values at `known` ones: (values [known, sample], known
#: [known, dim], wanted [wanted, dim]) to [wanted, sample].
Interpolator = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


def complete(observations: Observations) -> Observations:
    """The same frame with every subcarrier, and with whole receiving arrays where it sees a part.

    Nothing is put where all of a device pair is hidden, and an array stays as it is where fewer
    than two columns are visible, a column is visible in part, or not of each transmitting element.
    What is put there is made of visible entries alone and adds nothing to what they tell: it is for
    whoever reads power in beams and ranges, not for a likelihood.
    """
    layout, subcarriers = observations.layout, observations.subcarriers
    delta, links = observations.delta.copy(), observations.links.copy()
    for a, b in observations.pairs[1]:
        own = layout.links_between(a, b) & links
        delta[own] = fill_subcarriers(delta[own][None], subcarriers, spectral)[0]
        block = layout.block_of(a, b)
        column = layout.rx_column[block[1][0]]
        seen = own[block].any(axis=0)
        if layout.measured[block].all() and _columns_missing(own[block], column, seen):
            delta[block] = fill_columns(delta[block][:, seen], column, seen, spectral)
            links[block] = True
    return replace(observations, delta=delta, links=links, subcarriers=np.ones_like(subcarriers))


def _columns_missing(
    visible: Bool[np.ndarray, "tx rx"], column: Int[np.ndarray, "rx"], seen: Bool[np.ndarray, "rx"]
) -> bool:
    """Whether whole columns of equal size are hidden, of all transmitters, and two or more seen."""
    names, size = np.unique(column, return_counts=True)
    whole = np.array([seen[column == name].mean() for name in names])
    parts = ((whole > 0.0) & (whole < 1.0)).any() or (visible != seen).any()
    return not parts and len(set(size.tolist())) == 1 and bool(2 <= whole.sum() < len(names))


def fill_subcarriers(
    block: Complex[np.ndarray, "tx rx subcarrier"],
    subcarrier_visible: np.ndarray,
    along: Interpolator,
) -> Complex[np.ndarray, "tx rx subcarrier"]:
    """Fills hidden subcarriers of links that are otherwise visible."""
    subcarriers = np.arange(block.shape[2], dtype=np.float64)[:, None]
    out = np.nan_to_num(block, nan=0.0)
    if not subcarrier_visible.all():
        values = block[:, :, subcarrier_visible].reshape(-1, int(subcarrier_visible.sum())).T
        filled = along(values, subcarriers[subcarrier_visible], subcarriers[~subcarrier_visible])
        out[:, :, ~subcarrier_visible] = filled.T.reshape(*block.shape[:2], -1)
    return out


def fill_columns(
    visible: Complex[np.ndarray, "tx seen subcarrier"],
    column: Int[np.ndarray, "rx"],
    seen: np.ndarray,
    along: Interpolator,
) -> Complex[np.ndarray, "tx rx subcarrier"]:
    """Fills hidden columns of one device's array, each row from its own visible elements."""
    num_tx, _, num_subcarriers = visible.shape
    out = np.zeros((num_tx, len(column), num_subcarriers), dtype=visible.dtype)
    out[:, seen] = visible
    hidden = np.flatnonzero(~seen)
    if len(hidden) == 0:
        return out
    known_columns, wanted_columns = np.unique(column[seen]), np.unique(column[hidden])
    # Elements are numbered column by column, so reshaping gives rows in equal order.
    by_column = np.stack([out[:, column == c] for c in known_columns])
    filled = along(
        by_column.reshape(len(known_columns), -1),
        known_columns[:, None].astype(np.float64),
        wanted_columns[:, None].astype(np.float64),
    ).reshape(len(wanted_columns), *by_column.shape[1:])
    for index, c in enumerate(wanted_columns):
        out[:, column == c] = filled[index]
    return out
