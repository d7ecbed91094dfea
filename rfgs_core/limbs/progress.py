# SPDX-License-Identifier: Apache-2.0
"""A training that was interrupted: weights, the optimiser's moments, and how far it had come."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import NamedTuple

import torch
from safetensors.torch import save
from torch import nn

from rfgs_core.adam import Adam
from rfgs_core.errors import RfgsFormatError
from rfgs_core.files import write_bytes
from rfgs_core.limbs.tensor_file import read_tensors, refuse_misfit
from rfgs_core.seals import BLANK, sealed

#: What AdamW keeps of every parameter.
_MOMENTS = ("step", "exp_avg", "exp_avg_sq")
_REMEDY = "delete it to begin anew"


class Progress(NamedTuple):
    """How far a training has come."""

    frames: int
    """Frames so far."""
    spent_s: float
    """Time so far [s]."""


def keep(
    path: Path, network: nn.Module, optimiser: Adam, progress: Progress, asked: str = ""
) -> None:
    """Writes the state of a training in one step.

    Args:
        path: Where to.
        network: Its weights.
        optimiser: Its moments.
        progress: How far it has come.
        asked: Whatever decides how it goes on; it goes on with the same alone.
    """
    state = {f"weight.{name}": value.cpu() for name, value in network.state_dict().items()}
    for name, parameter in network.named_parameters():
        for moment in _MOMENTS:
            state[f"{moment}.{name}"] = optimiser.state[parameter][moment].cpu()
    state["frames"] = torch.tensor(progress.frames)
    state["spent_s"] = torch.tensor(progress.spent_s, dtype=torch.float64)
    state["asked"] = _digest(asked)
    write_bytes(path, sealed(save(state, {"seal": BLANK})))


def _digest(asked: str) -> torch.Tensor:
    return torch.tensor(list(hashlib.sha256(asked.encode()).digest()), dtype=torch.uint8)


def resume(path: Path, network: nn.Module, optimiser: Adam, asked: str = "") -> Progress:
    """Reads what `keep` wrote into a network and its optimiser.

    Raises:
        RfgsFormatError: The file is damaged, of another network, or of a training that was asked
            for something else.
    """
    state, _ = read_tensors(path, _REMEDY)
    if not torch.equal(state.pop("asked", torch.tensor(())), _digest(asked)):
        raise RfgsFormatError(
            f"{path}: is of a training with other options; give the same ones again, or {_REMEDY}"
        )
    told = {name: state.pop(name, torch.tensor(())) for name in ("frames", "spent_s")}
    if any(value.numel() != 1 or float(value) < 0.0 for value in told.values()):
        raise RfgsFormatError(f"{path}: expected how far it had come and how long; {_REMEDY}")
    weights, parameters = network.state_dict(), dict(network.named_parameters())
    wanted = {f"weight.{name}": value for name, value in weights.items()}
    for name, parameter in parameters.items():
        wanted |= {f"{moment}.{name}": parameter for moment in _MOMENTS}
        wanted[f"step.{name}"] = torch.tensor(0.0)
    refuse_misfit(path, state, wanted, _REMEDY)
    network.load_state_dict({name: state[f"weight.{name}"] for name in weights})
    for name, parameter in parameters.items():
        optimiser.state[parameter] = {
            moment: state[f"{moment}.{name}"].to(parameter.device) for moment in _MOMENTS
        }
    return Progress(int(told["frames"]), float(told["spent_s"]))
