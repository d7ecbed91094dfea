# SPDX-License-Identifier: Apache-2.0
"""Trained networks in safetensors files, each with a card of how it was made."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import msgspec
import numpy as np
from safetensors.torch import save

from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.files import write_bytes
from rfgs_core.limbs.network import LimbNetwork, Size
from rfgs_core.limbs.tensor_file import read_tensors, refuse_misfit
from rfgs_core.radio import Radio
from rfgs_core.records import record
from rfgs_core.seals import BLANK, sealed

#: Schema of the file.
SCHEMA = "rfgs-limbs/1"
#: Networks that come with the package, one per kind of radio.
OWN = Path(__file__).parent / "networks"
#: A network serves radios whose centre and bandwidth differ from its own by no more than this.
_SAME_CENTRE, _SAME_BANDWIDTH = 0.05, 0.3
_REMEDY = "make it with `rfgs limbs`"
_Hertz = Annotated[float, msgspec.Meta(gt=0.0, le=1e12)]


class _Card(msgspec.Struct):
    """What a card must say; it may say more."""

    radio: str
    centre_hz: _Hertz
    bandwidth_hz: _Hertz
    ranges: Annotated[int, msgspec.Meta(ge=1, le=4096)]
    size: Size = "small"


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
        "size": network.size,
        **card,
    }
    # One entry: the library writes several in an order of its own.
    metadata = {"card": json.dumps({"schema": SCHEMA, "seal": BLANK, **stated}, sort_keys=True)}
    write_bytes(path, sealed(save(weights, metadata)))


def load_network(path: Path) -> Trained:
    """Reads what `save_network` wrote.

    Raises:
        RfgsError: There is no such file.
        RfgsFormatError: It is damaged, no network of ours, or of another version.
    """
    if not path.is_file():
        raise RfgsError(f"{path}: no such file; expected one made by `rfgs limbs`")
    weights, texts = read_tensors(path, _REMEDY)
    try:
        value = msgspec.json.decode(texts.get("card", "{}"))
    except (msgspec.DecodeError, UnicodeEncodeError, RecursionError) as error:
        raise RfgsFormatError(f"{path}: card: expected JSON ({error}); {_REMEDY}") from error
    card: dict[str, Any] = record(f"{path}: card", value, dict[str, Any], _REMEDY)
    card.pop("seal", None)
    if card.get("schema") != SCHEMA:
        found = str(card.get("schema"))[:60]
        raise RfgsFormatError(f"{path}: expected schema {SCHEMA}, found {found}; {_REMEDY}")
    known: _Card = record(f"{path}: card", card, _Card, _REMEDY)
    network = LimbNetwork(known.ranges, known.size)
    refuse_misfit(path, weights, network.state_dict(), _REMEDY)
    network.load_state_dict({name: value.float() for name, value in weights.items()})
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
