# SPDX-License-Identifier: Apache-2.0
"""What a training run is asked to do."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from rfgs_core.dataset.observed import Observed
from rfgs_core.device import Device

Objective = Literal["paper", "csi", "both"]
Recipe = Literal["rfgs", "paper"]
EncoderKind = Literal["matched_filter", "cnn", "paths"]
#: complex: the channel itself; power: |csi|² per link and tone; delay_power: the power of each
#: link's delay profile.
Observe = Literal["complex", "power", "delay_power"]
#: all: every packet of a frame helps to tell its change from noise; first: the one at its own time.
Packets = Literal["all", "first"]
#: told: the likelier of standing and sitting, per frame; standing: everybody stands.
Posture = Literal["told", "standing"]
#: empty_room: the capture without anything that moves; learned: the median over the frames.
Background = Literal["empty_room", "learned"]
#: Offsets of devices that are estimated: none, of oscillators, of clocks, or of both.
Calibrate = Literal["none", "phase", "timing", "both"]
#: Parts of the paper's recipe that an ablation leaves out (its table 2): the weight ‖φ‖ in eq. 5,
#: new Gaussians, the frequency gradient as their condition, and pruning.
Part = Literal["rf_weights", "densify", "feature_gradients", "prune"]
#: none; paper: section 3.5; 3dgs: clone, split, prune, reset; residual: at peaks of the
#: back-projected residual; motion: between frames, as many as suit the pace of the bodies.
Density = Literal["none", "paper", "3dgs", "residual", "motion"]


@dataclass(frozen=True)
class TrainConfig:
    """Settings of the fit of one frame; saved as JSON beside every result."""

    objective: Objective = "csi"
    """paper: eq. 4–7; csi: the propagation model; both: their sum."""
    channel: Observed = "clean"
    """clean: the traced channel; impaired: what imperfect radios make of it."""
    observe: Observe = "complex"
    """What the radio reports of that channel; no stage sees more."""
    packets: Packets = "first"
    """Which packets of a frame are read; see `packets_to_read`."""
    background: Background = "empty_room"
    """What the moving part is told from."""
    static_set: int = 0
    """Gaussians of what stands still, fitted to the background; 0: none."""
    recipe: Recipe = "rfgs"
    """rfgs: our start, rates and steps; paper: the paper's numbers (sections 3.2–3.6)."""
    num_gaussians: int = 6000
    """Moving Gaussians at the start of the first frame."""
    bodies: int = 1
    """Moving bodies in the scene; taken from the dataset's instances."""
    posture: Posture = "told"
    """How bodies are taken to hold themselves; without phases they stand."""
    solver_steps: int = 8
    """Conjugate-gradient steps for the reflectivities."""
    iterations: int = 80
    """Adam steps per frame (the paper: 10,000)."""
    without: tuple[Part, ...] = ()
    """Parts of the paper's recipe that are left out."""
    temporal: float = 0.0
    """Weight of the pull of each Gaussian to its place on the body in the frame before."""
    density: Density | None = None
    """How Gaussians come and go while they are refined; None: as the objective does, the
    paper's rule with the paper's losses and none without."""
    batch_entries: int = 8192
    """Channel entries (links times tones) per Adam step of the channel loss."""
    batch_points: int = 1024
    """Sample points per Adam step of the paper's loss (section 3.6)."""
    grid_side: int = 64
    """Voxels per side of the paper's sample grid (section 3.2)."""
    refine_levels: int = 2
    """How often sample points are refined around energy (the paper: not at all)."""
    encoder: EncoderKind = "matched_filter"
    """What gives φ (eq. 2)."""
    encoder_sha256: str = ""
    """Digest of the learned encoder's file; empty for the others."""
    device: Device = "cpu"
    """Where reflectivities are solved and Gaussians refined."""
    unexplained: float = 0.5
    """Share of each device pair's power that the model is not asked to explain."""
    calibrate: Calibrate = "none"
    """Offsets of devices that are estimated and taken out before the fit."""
    seed: int = 0
    """Root seed."""

    @staticmethod
    def of_recipe(recipe: Recipe, objective: Objective, seed: int) -> TrainConfig:
        """Settings of a recipe."""
        if recipe == "paper":
            return TrainConfig(
                objective=objective,
                recipe=recipe,
                seed=seed,
                iterations=10_000,
                refine_levels=0,
            )
        return TrainConfig(objective=objective, recipe=recipe, seed=seed)
