# SPDX-License-Identifier: Apache-2.0
"""Trains an encoder on radio alone: hidden antennas and subcarriers are predicted from the others.

Part of a frame is hidden, the rest is encoded at sample points, and scatterers there radiate what
was hidden: for device pair j

    Ĥ_j = Σ_n π(φ(p_n)) y_j(p_n) e^{−j2πf (d_t + d_r)/c},

with the pair's own image y_j and a prior π ≥ 0 decoded from φ, which all pairs share. A pair alone
cannot tell where along its beam and range cell something is; φ, which has heard all of them, can.
The error is 1 − |⟨Ĥ_j, H_j⟩|²/(‖Ĥ_j‖²‖H_j‖²) on hidden entries: that of the best complex scale.
To it comes the mean squared correlation of different features over the points, which keeps all of
them from saying the same.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float, Float64
from torch import Tensor, nn

from rfgs_core.adam import Adam
from rfgs_core.encode import MATCHED_FILTER
from rfgs_core.encode.learned import LearnedEncoder, NetworkKind
from rfgs_core.encode.learned.blocks import Blocks
from rfgs_core.encode.learned.steering import radiate
from rfgs_core.encode.protocol import FEATURES
from rfgs_core.encode.spread import FeatureSpread
from rfgs_core.errors import RfgsError
from rfgs_core.fit.sampling import sample_points
from rfgs_core.measure.observations import Observations
from rfgs_core.radio.levels import decibels
from rfgs_core.seeds import sub_seed
from rfgs_core.threads import one_torch_thread

#: Adam's rate.
_RATE = 3e-3
#: Sample grid that points are drawn from: voxels per side, and refinements around energy.
_SIDE, _LEVELS = 20, 2
#: Points of a step; half of them where the energy is.
_POINTS = 256
#: Device pairs of a step.
_PAIRS = 3
#: Hidden share of subcarriers and of receiving antennas, each contiguous.
_HIDDEN_SUBCARRIERS, _HIDDEN_ANTENNAS = 1 / 8, 1 / 4
#: Weight of the correlation of features beside the error.
_DECORRELATION = 0.2
#: Draws of masks and points that an error is averaged over.
_DRAWS = 8


@dataclass(frozen=True)
class SelfSupervised:
    """A trained encoder, and what training gave."""

    encoder: LearnedEncoder
    """The encoder."""
    untrained_db: float
    """Error on hidden entries before training, relative to their power [dB]."""
    trained_db: float
    """The same after training."""
    unseen: bool
    """Whether the errors are of a frame that training never saw."""
    spread: FeatureSpread
    """How far features vary over the sample points of the first frame."""


class Prior(nn.Module):
    """π: how likely something scatters where the features are φ; used in training only."""

    def __init__(self) -> None:
        super().__init__()
        self.first, self.last = nn.Linear(FEATURES, 16), nn.Linear(16, 1)

    def forward(self, features: Float[Tensor, "N 32"]) -> Float[Tensor, "N"]:
        """Positive weights."""
        logs = torch.log(features + 1e-2)
        return nn.functional.softplus(self.last(torch.relu(self.first(logs))))[:, 0]


@dataclass(frozen=True)
class Example:
    """A frame, and points to draw from."""

    blocks: Blocks
    """All its device pairs."""
    points: Float64[np.ndarray, "N 3"]
    """Grid, refined points and points along the links [m]."""
    share: Float64[np.ndarray, "N"]
    """Probability of each point: half uniform, half by matched-filter energy."""

    @staticmethod
    def of(observations: Observations, seed: int) -> Example:
        """Points are found once per frame, from everything that training may see."""
        rng = np.random.default_rng(seed)
        points = sample_points(observations, _SIDE, rng, MATCHED_FILTER, _LEVELS)
        energy = (points.features.double() ** 2).sum(dim=1).numpy()
        share = 0.5 / len(energy) + 0.5 * energy / max(energy.sum(), 1e-300)
        return Example(Blocks.of(observations), points.xyz.double().numpy(), share / share.sum())

    def draw(self, rng: np.random.Generator) -> tuple[Blocks, Blocks, Float64[Tensor, "N 3"]]:
        """Some pairs, the same with a part hidden, and points."""
        count = min(_PAIRS, len(self.blocks))
        chosen = self.blocks.choose(np.sort(rng.choice(len(self.blocks), count, replace=False)))
        rows = rng.choice(len(self.points), min(_POINTS, len(self.points)), False, self.share)
        return chosen, chosen.hide(_mask(chosen, rng)), torch.from_numpy(self.points[rows])


def _mask(blocks: Blocks, rng: np.random.Generator) -> Bool[Tensor, "pair tx rx subcarrier"]:
    """A run of subcarriers on all links, and a run of receiving antennas on all subcarriers."""
    mask = torch.zeros(blocks.csi.shape, dtype=torch.bool)
    for axis, share in ((3, _HIDDEN_SUBCARRIERS), (2, _HIDDEN_ANTENNAS)):
        size = mask.shape[axis]
        width = min(max(1, round(share * size)), size - 1)
        for pair in range(len(mask)):
            first = int(rng.integers(size - width + 1))
            mask[pair].narrow(axis - 1, first, width).fill_(True)
    return mask


def masked_error(
    encoder: LearnedEncoder,
    prior: Prior,
    full: Blocks,
    seen: Blocks,
    points: Float64[Tensor, "N 3"],
) -> tuple[Float[Tensor, ""], Float[Tensor, "N 32"]]:
    """Mean over pairs of the relative error on what `seen` hides of `full`, and φ at the points."""
    features, pictures, steer = encoder.model.at_points(seen, points)
    weight = prior(features)
    errors = []
    for pair, image in enumerate(pictures):
        hidden = full.visible[pair] & ~seen.visible[pair]
        true = full.csi[pair][hidden]
        if not bool(hidden.any()) or float(true.abs().max()) == 0.0:
            continue
        predicted = radiate(weight * image, steer[pair])[hidden]
        match = torch.vdot(predicted, true).abs().square()
        powers = predicted.abs().square().sum() * true.abs().square().sum()
        errors.append(1.0 - match / (powers + 1e-30))
    mean = torch.stack(errors).mean() if errors else torch.zeros((), requires_grad=True)
    return mean, features


def correlation(features: Float[Tensor, "N 32"]) -> Float[Tensor, ""]:
    """Mean squared correlation of different features over points, 0 to 1."""
    centred = features - features.mean(dim=0)
    deviation = centred.square().mean(dim=0).sqrt()
    matrix = centred.T @ centred / len(features) / (deviation[:, None] * deviation + 1e-12)
    off_diagonal = matrix - torch.diag(torch.diagonal(matrix))
    return off_diagonal.square().sum() / (FEATURES * (FEATURES - 1))


def train_encoder(
    frames: Sequence[Observations],
    kind: NetworkKind,
    steps: int,
    seed: int,
    on_step: Callable[[float], None] | None = None,
) -> SelfSupervised:
    """Trains an encoder of a radio.

    The last of several frames is kept for the error that is reported.

    Args:
        frames: Frames of one radio; what they hide stays hidden.
        kind: Which network.
        steps: Adam steps.
        seed: Seed of weights, masks and points.
        on_step: Called with the error of each step.

    Raises:
        RfgsError: The network cannot read the radio, nothing changes in any frame, the loss is
            not a number, or the features collapsed.
    """
    with one_torch_thread():
        # Also refuses radios that the network cannot read, before any point is found.
        encoder = LearnedEncoder.untrained(kind, frames[0], sub_seed(seed, "weights"))
    examples = [Example.of(seen, sub_seed(seed, "points", k)) for k, seen in enumerate(frames)]
    if not any(bool((example.blocks.csi != 0).any()) for example in examples):
        raise RfgsError(
            "nothing moves in these frames: csi and csi_static are equal; choose others"
        )
    with one_torch_thread():
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(sub_seed(seed, "prior"))
            prior = Prior()
        untrained = _error_db(encoder, prior, examples[-1], seed)
        _descend(encoder, prior, examples[:-1] or examples, steps, seed, on_step)
        trained = _error_db(encoder, prior, examples[-1], seed)
    spread = FeatureSpread.of(encoder(frames[0], examples[0].points))
    if spread.collapsed:
        raise RfgsError(
            f"the features collapsed (deviation {spread.deviation:.2g}, rank {spread.rank:.2g} of "
            f"{FEATURES}): all points look alike; train on more frames or for fewer --steps"
        )
    return SelfSupervised(encoder, untrained, trained, len(frames) > 1, spread)


def _descend(
    encoder: LearnedEncoder,
    prior: Prior,
    examples: list[Example],
    steps: int,
    seed: int,
    on_step: Callable[[float], None] | None,
) -> None:
    optimiser = Adam.of([*encoder.model.parameters(), *prior.parameters()], _RATE)
    for step in range(steps):
        rng = np.random.default_rng(sub_seed(seed, "step", step))
        error, features = masked_error(encoder, prior, *examples[step % len(examples)].draw(rng))
        loss = error + _DECORRELATION * correlation(features)
        if not torch.isfinite(loss):
            raise RfgsError(
                f"the loss became {float(loss)} at step {step + 1}; a frame may be damaged "
                "(`rfgs-factory validate`)"
            )
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        if on_step is not None:
            on_step(float(error.detach()))


def _error_db(encoder: LearnedEncoder, prior: Prior, example: Example, seed: int) -> float:
    """Error on hidden entries over fixed draws [dB]."""
    with torch.no_grad():
        errors = [
            masked_error(
                encoder, prior, *example.draw(np.random.default_rng(sub_seed(seed, "check", draw)))
            )[0]
            for draw in range(_DRAWS)
        ]
    return decibels(float(torch.stack(errors).mean()))
