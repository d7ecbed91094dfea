# SPDX-License-Identifier: Apache-2.0
"""A run on the tiny dataset whose every Gaussian has known values."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch

from rfgs_core.arrays import save_arrays
from rfgs_core.dataset import Sequence, open_dataset
from rfgs_core.gaussians import FEATURE_DIM, Gaussians
from rfgs_core.gaussians.ply import cloud_of, write_ply
from rfgs_core.model.head import RadioHead
from rfgs_core.render.shader import Shader
from rfgs_core.run.config import RunConfig, relative_dataset
from rfgs_core.settings import TrainConfig

#: Static Gaussians, which have no radio values of their own.
STATIC = 3
#: Moving ones stand outside the true sphere by these distances, again and again [m].
OUTSIDE_M = np.array([0.0, 0.05, 0.1, 0.5])


def _gaussians(means: np.ndarray, opacities: np.ndarray) -> Gaussians:
    count = len(means)
    generator = torch.Generator().manual_seed(3)
    return Gaussians(
        means=torch.from_numpy(means).float(),
        quats=torch.tensor([1.0, 0.0, 0.0, 0.0]).repeat(count, 1),
        log_scales=torch.full((count, 3), float(np.log(0.05))),
        logit_opacities=torch.logit(torch.from_numpy(opacities).float()),
        features=torch.randn((count, FEATURE_DIM), generator=generator),
    )


def _write_frame(folder: Path, sequence: Sequence, frame: int) -> None:
    vertices, _, _ = sequence.moving_mesh(frame)
    centre = vertices.mean(axis=0)
    count = len(vertices)
    away = np.resize(OUTSIDE_M, count)[:, None]
    outward = (vertices - centre) / np.linalg.norm(vertices - centre, axis=1, keepdims=True)
    moving = _gaussians(vertices + away * outward, np.linspace(0.1, 0.8, count))
    power_db = np.linspace(-90.0, -60.0, count).astype(np.float32)
    phase_rad = np.linspace(-np.pi, np.pi, count, endpoint=False)
    head = RadioHead.create(5, wavelength_m=0.05, scale_m=0.05, gamma_scale_m=1.0)
    gamma = torch.from_numpy(np.exp(1j * phase_rad).astype(np.complex64))
    moving.features = head.with_gamma(moving.features, gamma)
    save_arrays(folder.parent / "radio_head.npz", head.arrays())
    write_ply(folder / f"{frame:06d}.ply", cloud_of(moving, rf_power_db=power_db))
    save_arrays(
        folder / f"{frame:06d}.features.npz",
        {
            "features": moving.features.numpy(),
            "gamma": head.gamma(moving.features).numpy().astype(np.complex64)[:, None],
            "rf_power_db": power_db,
            "track_id": np.arange(len(moving)),
            "body": np.zeros(len(moving), np.int64),
        },
    )


def write_run(folder: Path, dataset_path: Path, trained_on: Path | None = None) -> Path:
    """A run of two frames with a shader; `trained_on` may hold less than the dataset."""
    sequence = open_dataset(dataset_path).sequence()
    dataset = open_dataset(trained_on or dataset_path)
    RunConfig(
        dataset=relative_dataset(folder, dataset.path),
        dataset_fingerprint=dataset.fingerprint,
        sequence=sequence.name,
        radio="wifi",
        frames=sequence.frames,
        settings=TrainConfig(),
    ).write(folder)
    corner = np.array([[0.1, 0.1, z] for z in np.linspace(0.5, 1.5, STATIC)])
    write_ply(folder / "gaussians/static.ply", cloud_of(_gaussians(corner, np.full(STATIC, 0.9))))
    for frame in sequence.frames:
        _write_frame(folder / "gaussians", sequence, frame)
    generator = torch.Generator().manual_seed(4)
    shapes = {"W1": (64, FEATURE_DIM), "W2": (64, 64), "W3": (3, 64)}
    matrices = {name: torch.randn(shape, generator=generator) for name, shape in shapes.items()}
    Shader(**{name: value / 8.0 for name, value in matrices.items()}).save(folder / "shader.npz")
    return folder
