# SPDX-License-Identifier: Apache-2.0
"""What readers of public sets give: places that were heard, and where joints truly were."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np
from jaxtyping import Float64, Int64

from rfgs_core.skeleton import JOINTS


class HeardFrame(NamedTuple):
    """One frame, seen from a radar at the origin: x to its right, y ahead, z up [m]."""

    points: Float64[np.ndarray, "point 3"]
    """Where something was heard [m]."""
    amplitude: Float64[np.ndarray, "point"]
    """How strongly, in units of the set; equal where the set does not say what it means."""
    joints: Float64[np.ndarray, "17 3"] | None
    """True joints in the order of `skeleton.JOINTS` [m], NaN for those the set has not; None where
    only pictures of them are known."""
    pixels: Float64[np.ndarray, "17 2"] | None
    """Joints in a camera's picture, right and down, NaN for those the set has not."""


class Claim(NamedTuple):
    """A figure of somebody's paper, not reproduced here."""

    figure: str
    """What and how much."""
    source: str
    """Where it stands."""


class PeopleSet(Protocol):
    """One public set on disk."""

    @property
    def name(self) -> str:
        """Its name."""
        ...

    @property
    def claims(self) -> tuple[Claim, ...]:
        """What networks trained on it are said to reach."""
        ...

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What its files and loaders leave open, and what is taken for it."""
        ...

    @property
    def count(self) -> int:
        """Frames there are."""
        ...

    def frames(self, every: int) -> Iterator[HeardFrame]:
        """Every so manieth frame."""
        ...


@dataclass(frozen=True)
class Found:
    """Where frames lie."""

    folder: Path
    """Folder of the set."""
    parts: tuple[Path, ...]
    """Folders of its sequences."""


#: Cells of a cube that stand for a frame.
MOST_CELLS = 400


def strongest_cells(power: Float64[np.ndarray, "cell"]) -> Int64[np.ndarray, "strong"]:
    """Cells that stand for a frame, the strongest first: none that is silent."""
    best = np.argsort(power, kind="stable")[::-1][:MOST_CELLS]
    return best[power[best] > 0.0]


def joints_of(
    values: Float64[np.ndarray, "joint axis"], order: dict[str, int]
) -> Float64[np.ndarray, "17 axis"]:
    """A set's joints in our order, NaN for those it has not.

    Args:
        values: The set's joints.
        order: Row of each of our joints that the set has.
    """
    found = np.full((len(JOINTS), values.shape[1]), np.nan)
    for name, row in order.items():
        found[JOINTS.index(name)] = values[row]
    return found
