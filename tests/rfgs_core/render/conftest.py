# SPDX-License-Identifier: Apache-2.0
"""Cameras, clouds and a run made by hand."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import torch

from rfgs_core.dataset import open_dataset
from rfgs_core.dataset.sequence import Sequence
from rfgs_core.gaussians import FEATURE_DIM, Gaussians
from rfgs_core.render.cameras import Camera

CameraMaker = Callable[..., Camera]
GaussianMaker = Callable[..., Gaussians]


def make_camera(size: tuple[int, int] = (32, 24), focal: float = 40.0, **changes: float) -> Camera:
    """At the origin, OpenGL axes equal to the world's: looks along -z, +y is up."""
    width, height = size
    values = {
        "name": "hand",
        "width": width,
        "height": height,
        "fl_x": focal,
        "fl_y": focal,
        "cx": width / 2,
        "cy": height / 2,
        "world_from_camera": np.eye(4).tolist(),
    }
    return Camera.from_dict({**values, **changes})


def make_gaussians(
    means: list[list[float]], sigma_m: float = 0.1, opacity: float = 0.5
) -> Gaussians:
    """Round Gaussians."""
    count = len(means)
    return Gaussians(
        means=torch.tensor(means, dtype=torch.float32).reshape(count, 3),
        quats=torch.tensor([1.0, 0.0, 0.0, 0.0]).repeat(count, 1),
        log_scales=torch.full((count, 3), float(np.log(sigma_m))),
        logit_opacities=torch.full((count,), float(np.log(opacity / (1.0 - opacity)))),
        features=torch.zeros(count, FEATURE_DIM),
    )


@pytest.fixture
def camera() -> CameraMaker:
    return make_camera


@pytest.fixture
def gaussians() -> GaussianMaker:
    return make_gaussians


@dataclass
class HandMadeRun:
    """What rendering needs of a run: Gaussians on the true sphere of the tiny dataset."""

    path: Path
    sequence: Sequence
    frames: list[int]
    clouds: dict[int, Gaussians]

    def gaussians(self, frame: int) -> Gaussians:
        return self.clouds[frame]

    def attributes(self, frame: int) -> dict[str, np.ndarray]:
        cloud = self.clouds[frame]
        return {
            "features": cloud.features.numpy(),
            "rf_power_db": np.linspace(-90, -60, len(cloud), dtype=np.float32),
        }


@pytest.fixture
def hand_made_run(tmp_path: Path, tiny_dataset: Path) -> HandMadeRun:
    """Gaussians at the sphere's vertices; features are the outward normal, then zeros."""
    sequence = open_dataset(tiny_dataset).sequence()
    clouds = {}
    for frame in sequence.frames:
        vertices, _, _ = sequence.moving_mesh(frame)
        cloud = make_gaussians(vertices.tolist(), sigma_m=0.06, opacity=0.8)
        cloud.features[:, :3] = torch.from_numpy(vertices - vertices.mean(axis=0)).float()
        cloud.features[:, 3] = 1e-3
        clouds[frame] = cloud
    folder = tmp_path / "run"
    folder.mkdir()
    return HandMadeRun(folder, sequence, sequence.frames, clouds)
