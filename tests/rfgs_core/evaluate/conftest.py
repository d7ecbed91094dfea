# SPDX-License-Identifier: Apache-2.0
"""A run whose Gaussians lie on the true surface, and evidence with known scatterers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from rfgs_core.bodies.body_prior import Bodies
from rfgs_core.dataset import Sequence, open_dataset
from rfgs_core.dataset.observed import Observed
from rfgs_core.dataset.splits import HeldOut, radio_split
from rfgs_core.evaluate.evidence import Evidence
from rfgs_core.evaluate.geometry import reference_points
from rfgs_core.evaluate.grid import Grid
from rfgs_core.evaluate.metrics import evaluate_run
from rfgs_core.gaussians.model import FEATURE_DIM, Gaussians
from rfgs_core.measure.observations import Kept, Observations, observe
from rfgs_core.radio import Radio, layout, place_devices
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.run.config import RunConfig
from rfgs_core.settings import TrainConfig

BOUNDS_M = np.array([[0.0, 0.0, 0.0], [4.0, 3.5, 2.5]])


@dataclass
class SurfaceRun:
    """Everything evaluation asks of a run, answered from the truth and shifted on request."""

    path: Path
    sequence: Sequence
    shift_m: np.ndarray = field(default_factory=lambda: np.zeros(3))
    frames: list[int] = field(default_factory=lambda: [1, 2])
    config: RunConfig = field(
        default_factory=lambda: RunConfig("", "a" * 64, "tiny", "wifi", [1, 2], TrainConfig(), 1.5)
    )
    channel: Observed = "clean"

    def gaussians(self, frame: int) -> Gaussians:
        vertices, faces, _ = self.sequence.moving_mesh(frame)
        means = reference_points(vertices, faces, n=600, seed=1) + self.shift_m
        quats = torch.zeros(len(means), 4)
        quats[:, 0] = 1.0
        return Gaussians(
            means=torch.from_numpy(means).float(),
            quats=quats,
            log_scales=torch.full((len(means), 3), float(np.log(0.03))),
            logit_opacities=torch.full((len(means),), 2.0),
            features=torch.ones(len(means), FEATURE_DIM),
        )

    def attributes(self, frame: int) -> dict[str, np.ndarray]:
        count = len(self.gaussians(frame))
        return {"features": np.ones((count, FEATURE_DIM)), "rf_power_db": np.zeros(count)}

    def bodies(self, frame: int) -> Bodies:
        centre = self.sequence.moving_mesh(frame)[0].mean(axis=0) + self.shift_m
        return Bodies.standing(centre[None, :2].astype(np.float64))

    def observations(self, frame: int, kept: Kept | None = None) -> Observations:
        kind = self.config.settings.observe
        return observe(self.sequence, "wifi", frame, kind=kind, kept=kept)

    def predict(self, frame: int) -> np.ndarray:
        return 0.9 * (self.sequence.csi("wifi", frame) - self.sequence.csi_static("wifi"))

    def refitted(self, frame: int, observations: Observations) -> np.ndarray:
        return self.predict(frame)

    def visible_change(self, frame: int, observations: Observations) -> np.ndarray:
        visible = observations.links[..., None] & observations.subcarriers
        return np.where(visible, observations.delta, np.nan)


@pytest.fixture
def surface_run(tiny_dataset: Path, tmp_path: Path) -> SurfaceRun:
    """A run on the tiny dataset that knows the surface and 90 % of the channel."""
    return SurfaceRun(tmp_path, open_dataset(tiny_dataset).sequence())


@pytest.fixture(scope="session")
def evaluated_run(tiny_dataset: Path, tmp_path_factory: pytest.TempPathFactory) -> SurfaceRun:
    """The same run, evaluated once; nothing in its folder is changed, a report is added."""
    run = SurfaceRun(tmp_path_factory.mktemp("run"), open_dataset(tiny_dataset).sequence())
    run.config.write(run.path)
    evaluate_run(run, oracle=False)
    return run


def small_radio(**changes: Any) -> Radio:
    """A radio of four devices with 1 TX and 2 x 8 RX elements each."""
    values: dict[str, Any] = {
        "name": "small",
        "freq_min_hz": 5.0e9,
        "freq_max_hz": 6.0e9,
        "num_subcarriers": 32,
        "tx_rows": 1,
        "tx_cols": 1,
        "rx_rows": 2,
        "rx_cols": 8,
        "tx_offset_m": (0.0, 0.0, -0.3),
    }
    return Radio(**(values | changes))


@dataclass(frozen=True)
class Synthetic:
    """Evidence of point scatterers, with the truth beside it."""

    evidence: Evidence
    delta: np.ndarray
    static: np.ndarray
    held_out: HeldOut


@pytest.fixture
def scatterers() -> Callable[..., Synthetic]:
    """Makes evidence of points with unit reflectivity; extra arguments change the radio."""

    def make(points: np.ndarray, voxels: int = 200, **changes: Any) -> Synthetic:
        radio = small_radio(**changes)
        elements = layout(radio, place_devices(radio, BOUNDS_M))
        k = 2 * np.pi * radio.freq_hz / SPEED_OF_LIGHT
        out = np.linalg.norm(elements.tx_xyz[:, None] - points, axis=-1)
        back = np.linalg.norm(elements.rx_xyz[:, None] - points, axis=-1)
        path = out[:, None] + back[None]
        wave = np.exp(-1j * path[..., None] * k) / (out[:, None] * back[None])[..., None]
        delta = (wave.sum(axis=2) * elements.measured[..., None]).astype(np.complex64)
        direct = np.linalg.norm(elements.tx_xyz[:, None] - elements.rx_xyz, axis=-1)[..., None]
        static = np.exp(-1j * direct * k) / direct * elements.measured[..., None]
        static = static.astype(np.complex64)
        held_out = HeldOut.of(radio_split(radio, elements, 0), elements, radio.num_subcarriers)
        evidence = Evidence.hide(
            delta + static, static, held_out, elements, radio.freq_hz, Grid.over(BOUNDS_M), voxels
        )
        return Synthetic(evidence, delta, static, held_out)

    return make
