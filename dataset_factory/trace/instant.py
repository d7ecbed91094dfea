# SPDX-License-Identifier: Apache-2.0
"""What rays have told of one instant; packets between two of them hold on to it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rfgs_core.simulate.paths.path_set import PathSet
from rfgs_core.simulate.shadow.outline import Outline
from rfgs_core.simulate.surface.direct import PosedPoints


@dataclass(frozen=True)
class Trace:
    """What needs rays, at one instant."""

    environment: np.ndarray
    """Channel of the environment, shadows included, shape (tx, rx, subcarrier)."""
    paths: PathSet
    """Paths of the environment, without shadows."""
    outlines: list[Outline]
    """What shades those paths."""
    points: PosedPoints | None = None
    """Scattering points; None if there are none."""
    seen: np.ndarray | None = None
    """Which points pairs of sites see, shape (tx site, rx site, point)."""
    bounced: PathSet | None = None
    """Paths by way of points and walls, of unit cross-section; None if not traced."""


def mixed(weighted: list[tuple[np.ndarray | None, float]]) -> np.ndarray:
    """Weighted sum of what several traces hold."""
    parts = [share * value for value, share in weighted if value is not None]
    return sum(parts[1:], start=parts[0])
