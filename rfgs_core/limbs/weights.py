# SPDX-License-Identifier: Apache-2.0
"""Trained networks in safetensors files, each with a card of how it was made."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save

from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.files import write_bytes
from rfgs_core.limbs.network import LimbNetwork
from rfgs_core.radio import Radio

#: Schema of the file.
SCHEMA = "rfgs-limbs/1"
#: Networks that come with the package, one per kind of radio.
OWN = Path(__file__).parent / "networks"
#: A network serves radios whose centre and bandwidth differ from its own by no more than this.
_SAME_CENTRE, _SAME_BANDWIDTH = 0.05, 0.3
#: Largest file that is read; ours have 2 MB.
_MOST_BYTES = 64 * 2**20


class Trained(NamedTuple):
    """A network and what is known of it."""

    network: LimbNetwork
    card: dict[str, Any]
    """Radio, data, seeds, hours, and how far it was off on unseen worlds."""


def save_network(path: Path, network: LimbNetwork, radio: Radio, card: dict[str, Any]) -> None:
    """Writes a network in one step, in half precision; equal weights give equal bytes."""
    weights = {name: value.half() for name, value in network.state_dict().items()}
    stated = {
        "radio": radio.name,
        "centre_hz": radio.centre_hz,
        "bandwidth_hz": radio.bandwidth_hz,
        "ranges": network.ranges,
        **card,
    }
    # One entry: the library writes several in an order of its own.
    metadata = {"card": json.dumps({"schema": SCHEMA, **stated}, sort_keys=True)}
    write_bytes(path, save(weights, metadata))


def load_network(path: Path) -> Trained:
    """Reads what `save_network` wrote.

    Raises:
        RfgsError: There is no such file.
        RfgsFormatError: It is damaged, no network of ours, or of another version.
    """
    if not path.is_file():
        raise RfgsError(f"{path}: no such file; expected one made by `rfgs limbs`")
    if path.stat().st_size > _MOST_BYTES:
        raise RfgsFormatError(f"{path}: larger than any network of ours; make it with `rfgs limbs`")
    try:
        with safe_open(path, framework="pt") as file:
            card = json.loads((file.metadata() or {}).get("card", "{}"))
            weights = {name: file.get_tensor(name).float() for name in file.keys()}
        if card.get("schema") != SCHEMA:
            raise RfgsFormatError(
                f"{path}: expected schema {SCHEMA}, found {card.get('schema')}; make it with "
                "`rfgs limbs`"
            )
        network = LimbNetwork(int(card["ranges"]))
        network.load_state_dict(weights)
    except (SafetensorError, KeyError, TypeError, ValueError, RuntimeError) as error:
        if isinstance(error, RfgsFormatError):
            raise
        raise RfgsFormatError(
            f"{path}: damaged, or not a network of `rfgs limbs` ({type(error).__name__}); make it "
            "again"
        ) from error
    if not all(bool(torch.isfinite(value).all()) for value in weights.values()):
        raise RfgsFormatError(f"{path}: holds NaN or infinity; make it again with `rfgs limbs`")
    network.eval()
    return Trained(network, card)


def own_network(freq_hz: np.ndarray) -> Trained | None:
    """The network that comes with the package for a band; None where none was trained."""
    bandwidth_hz = float(freq_hz[1] - freq_hz[0]) * len(freq_hz)
    centre_hz = float(freq_hz.mean())
    for path in sorted(OWN.glob("*.safetensors")):
        trained = load_network(path)
        centre, bandwidth = trained.card["centre_hz"], trained.card["bandwidth_hz"]
        if (
            abs(centre_hz / centre - 1.0) <= _SAME_CENTRE
            and abs(bandwidth_hz / bandwidth - 1.0) <= _SAME_BANDWIDTH
        ):
            return trained
    return None
