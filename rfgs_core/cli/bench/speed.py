# SPDX-License-Identifier: Apache-2.0
"""Parts of `rfgs bench` that measure time."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rfgs_core.cli.bench.numbers import Part, need_at_least_one, note
from rfgs_core.device import Device


def _a_minute(part: str) -> None:
    note(f"timing {part}; the plain twin takes most of it, about a minute")


@dataclass(frozen=True, kw_only=True)
class Propagation(Part):
    """Scattering and shadows beside the plain twin: 64 links x 64 subcarriers, with gradients."""

    gaussians: int = 20_000
    """How many Gaussians."""
    device: Device = "cpu"
    """Where: cpu, or cuda, the current GPU."""

    def numbers(self) -> dict[str, Any]:
        """Times both."""
        from rfgs_core.bench import PropagationBench, bench_propagation
        from rfgs_core.device import need_device

        need_at_least_one(gaussians=self.gaussians)
        need_device(self.device)
        _a_minute("propagation")
        bench = PropagationBench(num_gaussians=self.gaussians, device=self.device)
        return bench_propagation(bench)


@dataclass(frozen=True, kw_only=True)
class Raster(Part):
    """Pictures of 20,000 Gaussians at 256 x 256 pixels beside the plain twin."""

    def numbers(self) -> dict[str, Any]:
        """Times both."""
        from rfgs_core.render.bench import bench_raster

        _a_minute("raster")
        return bench_raster()


@dataclass(frozen=True, kw_only=True)
class Training(Part):
    """A training on one frame of a dataset.

    Until the loss of links that are set aside changes by under 1 % over 50 steps, or as many steps
    as you say.
    """

    dataset: Path
    """The dataset, see `rfgs-factory generate`."""
    radio: str = "wifi"
    """Which of its radios."""
    frame: int | None = None
    """Which frame; the first one when left out."""
    gaussians: int = 20_000
    """How many Gaussians."""
    steps: int | None = None
    """Adam steps; left out: until the loss stands still."""
    device: Device = "cpu"
    """Where: cpu, or cuda, the current GPU."""

    def numbers(self) -> dict[str, Any]:
        """Times the training."""
        from rfgs_core.bench import hardware
        from rfgs_core.fit.bench import TrainingBench, bench_training

        need_at_least_one(gaussians=self.gaussians, steps=self.steps)
        bench = TrainingBench(self.gaussians, self.steps, self.device)
        return {**bench_training(self.dataset, self.radio, self.frame, bench), **hardware()}


@dataclass(frozen=True, kw_only=True)
class Readers(Part):
    """Our readers of captures: Intel 5300 beside csiread, and FeitCSI."""

    def numbers(self) -> dict[str, Any]:
        """Times them."""
        from rfgs_core.real.reading import bench_readers

        return bench_readers()


@dataclass(frozen=True, kw_only=True)
class Blender(Part):
    """1,000,000 Gaussians imported and 100,000 per frame played by the add-on in Blender."""

    blender: Path | None = None
    """Blender program; else $BLENDER, else pip's bpy."""

    def numbers(self) -> dict[str, Any]:
        """Times Blender, as a program of its own."""
        from rfgs_core.bench import hardware
        from rfgs_core.blender_bench import bench_blender

        _a_minute("blender")
        return {**bench_blender(self.blender), **hardware()}


@dataclass(frozen=True, kw_only=True)
class Scaling(Part):
    """How cost grows over two decades of facets, Gaussians, links and subcarriers.

    CPU seconds and exponents of the fast tracer and of propagation; some two minutes.
    """

    def numbers(self) -> dict[str, Any]:
        """Times all sizes."""
        from rfgs_core.scaling import bench_scaling

        return bench_scaling(lambda words: note(f"timing {words}"))


@dataclass(frozen=True, kw_only=True)
class Performance:
    """A page of how fast the kernels are on this machine; some five minutes."""

    device: Device = "cpu"
    """Where: cpu, or cuda, the current GPU."""
    out: Path | None = None
    """The page; left out, it is printed."""
    json: Path | None = None
    """Also write the numbers to this file."""

    def run(self) -> int:
        """Writes the page; exit code 0."""
        from dataclasses import asdict

        from rfgs_core.device import need_device
        from rfgs_core.evaluate.provenance import now
        from rfgs_core.extras import require
        from rfgs_core.files import write_json, write_text
        from rfgs_core.performance import measure, page

        need_device(self.device)
        if self.device == "cuda":
            require("gsplat")
        found = measure(self.device, lambda words: note(f"timing {words}"))
        text = page(found, now()[:10])
        if self.out is None:
            sys.stdout.write(text)
        else:
            write_text(self.out, text)
        if self.json is not None:
            write_json(self.json, asdict(found))
        return 0
