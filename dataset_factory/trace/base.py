# SPDX-License-Identifier: Apache-2.0
"""What every tracer has: a scene, a radio, what moves, what it knows of an instant, times."""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import numpy as np

from dataset_factory.scene.bundle import Bundle
from dataset_factory.scene.radios import refuse_trace
from dataset_factory.scene.surroundings import room_of
from dataset_factory.trace.people.bodies import Bodies
from rfgs_core.radio import Radio
from rfgs_core.radio.layout import DevicePose
from rfgs_core.seeds import sub_seed
from rfgs_core.simulate.paths.path_set import PathSet
from rfgs_core.simulate.shadow.environment import node_frequencies
from rfgs_core.simulate.shadow.frequencies import fine_grid
from rfgs_core.simulate.shadow.kirchhoff import Shadow
from rfgs_core.simulate.shadow.outline import Outline
from rfgs_core.simulate.surface.direct import PosedPoints
from rfgs_core.timings import Timings

#: Dr.Jit keeps kernels and memory of every frame; they are dropped this often [frames].
FLUSH_EVERY = 10


class BaseTracer:
    """One radio in one bundle, ready to be traced."""

    def __init__(
        self,
        bundle: Bundle,
        radio: Radio,
        devices: list[DevicePose],
        *,
        depth: int = 2,
        shadow: Shadow = "kirchhoff",
        seed: int = 0,
    ) -> None:
        """Builds the scenes; tracing starts with the first call.

        Args:
            bundle: Scene bundle.
            radio: Radio to simulate.
            devices: Poses of its devices; of one that moves, its place at each sample.
            depth: Interactions of people's paths: 1 direct, 2 with one wall, 3 with two.
            shadow: "kirchhoff", or "hard" for Sionna's all-or-nothing shadow.
            seed: Root seed; rays and points depend on it, frames do not.

        Raises:
            RfgsError: A material does not hold in the radio's band, or the depth is not 1, 2
                or 3, or more than the radio can have.
        """
        refuse_trace(bundle, radio, depth)
        self._bundle, self._radio, self._devices = bundle, radio, devices
        self._shadow: Shadow = shadow
        self._rays = sub_seed(seed, "environment")
        # Frequencies of people's paths, which pass a slab on either leg, and of shadows.
        slab_s = room_of(bundle).slab_delay_s(radio.centre_hz)
        self._nodes = node_frequencies(radio, (depth - 1) * slab_s)
        self._grid = fine_grid(node_frequencies(radio, slab_s))
        self._bodies = Bodies(bundle, radio, sub_seed(seed, "points"))
        self._frames_done = 0
        self.timings = Timings("environment", "shadow", "people_direct", "people_bounces")

    def _flush(self) -> None:
        """Drops what Dr.Jit keeps of past frames, every few frames."""
        self._frames_done += 1
        if self._frames_done % FLUSH_EVERY == 0:
            dr.flush_kernel_cache()
            dr.flush_malloc_cache()


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
