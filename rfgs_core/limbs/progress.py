# SPDX-License-Identifier: Apache-2.0
"""A training that was interrupted: weights, the optimiser's moments, and how far it had come."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import torch
from safetensors import SafetensorError
from safetensors.torch import load_file, save

from rfgs_core.errors import RfgsFormatError
from rfgs_core.files import write_bytes
from rfgs_core.limbs.network import LimbNetwork

#: What AdamW keeps of every parameter.
_MOMENTS = ("step", "exp_avg", "exp_avg_sq")


class Progress(NamedTuple):
    """How far a training has come."""

    frames: int
    """Frames of random worlds so far."""
    spent_s: float
    """Time so far [s]."""


def keep(
    path: Path, network: LimbNetwork, optimiser: torch.optim.Optimizer, progress: Progress
) -> None:
    """Writes the state of a training in one step."""
    state = {f"weight.{name}": value for name, value in network.state_dict().items()}
    for name, parameter in network.named_parameters():
        for moment in _MOMENTS:
            state[f"{moment}.{name}"] = optimiser.state[parameter][moment]
    state["frames"] = torch.tensor(progress.frames)
    state["spent_s"] = torch.tensor(progress.spent_s, dtype=torch.float64)
    write_bytes(path, save(state))


def resume(path: Path, network: LimbNetwork, optimiser: torch.optim.Optimizer) -> Progress:
    """Reads what `keep` wrote into a network and its optimiser.

    Raises:
        RfgsFormatError: The file is damaged, or of another network.
    """
    try:
        state = load_file(path)
        network.load_state_dict({name: state[f"weight.{name}"] for name in network.state_dict()})
        for name, parameter in network.named_parameters():
            optimiser.state[parameter] = {moment: state[f"{moment}.{name}"] for moment in _MOMENTS}
        return Progress(int(state["frames"]), float(state["spent_s"]))
    except (SafetensorError, KeyError, RuntimeError) as error:
        raise RfgsFormatError(
            f"{path}: damaged, or of another network; delete it to begin anew"
        ) from error
