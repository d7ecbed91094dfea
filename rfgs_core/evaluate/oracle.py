# SPDX-License-Identifier: Apache-2.0
"""The ceiling baseline: the same fit, started on the true surface instead of the estimate."""

from __future__ import annotations

import numpy as np
import torch
from jaxtyping import Float32
from tqdm import tqdm

from rfgs_core.bodies.tracks import Tracks
from rfgs_core.encode import Encoder
from rfgs_core.evaluate.geometry import surface_samples
from rfgs_core.evaluate.grid import splat_gaussians
from rfgs_core.evaluate.scene import EvaluatedRun, Scene
from rfgs_core.fit.frame import FrameState, state_at
from rfgs_core.fit.stages import fit_frame
from rfgs_core.frames import spread_frames
from rfgs_core.measure.observations import Observations
from rfgs_core.run.encoders import run_encoder
from rfgs_core.seeds import sub_seed
from rfgs_core.settings import TrainConfig
from rfgs_core.threads import one_torch_thread

#: Frames that are fitted so, spread evenly: a fit takes longer than all other baselines together,
#: and from frame to frame they hardly differ.
MOST_FRAMES = 3


def start_on_surface(
    run: EvaluatedRun,
    observations: Observations,
    config: TrainConfig,
    frame: int,
    encoder: Encoder,
) -> FrameState:
    """The state that training starts from, had it been told the answer."""
    vertices, faces, _ = run.sequence.moving_mesh(frame)
    rng = np.random.default_rng(sub_seed(config.seed, "oracle", frame))
    points, normals = surface_samples(vertices, faces, config.num_gaussians, rng)
    tracks = Tracks.begun(points[:, :2].mean(axis=0, keepdims=True), observations.time_s)
    return state_at(points, normals, observations, config, tracks, encoder)


def _fit_from_surface(run: EvaluatedRun, config: TrainConfig, frame: int) -> FrameState:
    observations = run.observations(frame)
    encoder = run_encoder(run.path, run.config, run.sequence, frame)
    state = start_on_surface(run, observations, config, frame, encoder)
    seed = sub_seed(config.seed, "oracle", frame)
    return fit_frame(observations, state, config, seed, encoder=encoder)


def oracle_scores(scene: Scene) -> dict[int, Float32[np.ndarray, "x y z"]]:
    """Score volume of up to `MOST_FRAMES` frames after the run's own fit from the true surface."""
    run, grid = scene.run, scene.grid
    config = run.config.settings
    scores = {}
    for frame in tqdm(spread_frames(run.frames, MOST_FRAMES), desc="oracle_init", unit="frame"):
        with one_torch_thread():
            state = _fit_from_surface(run, config, frame)
        with torch.no_grad():
            g = state.gaussians
            scores[frame] = splat_gaussians(
                grid,
                g.means.numpy().astype(np.float64),
                g.covariances.numpy().astype(np.float64),
                state.power.numpy().astype(np.float64),
            )
    return scores
