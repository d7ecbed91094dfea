# SPDX-License-Identifier: Apache-2.0
"""Learned encoders in .npz files: weights, and the radio they are for."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch

from rfgs_core.arrays import Shape, load_arrays, save_arrays
from rfgs_core.encode.learned.encoder import EncoderModel, LearnedEncoder
from rfgs_core.encode.learned.networks import NETWORKS
from rfgs_core.encode.learned.signature import RadioSignature
from rfgs_core.errors import RfgsError, RfgsFormatError

#: Schema of the file.
SCHEMA = "rfgs-encoder/2"
_REMEDY = "make it again with `rfgs encode`"
_SHAPES: dict[str, Shape | None] = {
    "schema": None,
    "network": None,
    "freq_hz": ("subcarrier",),
    "tx_offset_m": ("tx", 3),
    "rx_offset_m": ("rx", 3),
    "packets": (),
    "packet_interval_s": (),
}
_TYPES = {
    "packets": "i8",
    **dict.fromkeys(("freq_hz", "tx_offset_m", "rx_offset_m", "packet_interval_s"), "f8"),
}


def save_encoder(path: Path, encoder: LearnedEncoder) -> None:
    """Writes an encoder in one step; equal weights give equal bytes."""
    weights = encoder.model.state_dict().items()
    save_arrays(
        path,
        {
            "schema": np.array(SCHEMA),
            "network": np.array(encoder.kind),
            "freq_hz": encoder.radio.freq_hz,
            "tx_offset_m": encoder.radio.tx_offset_m,
            "rx_offset_m": encoder.radio.rx_offset_m,
            "packets": np.array(encoder.radio.packets),
            "packet_interval_s": np.array(encoder.radio.packet_interval_s),
            **{f"weights.{name}": value.numpy() for name, value in weights},
        },
    )


def load_encoder(path: Path) -> LearnedEncoder:
    """Reads what `save_encoder` wrote.

    Raises:
        RfgsError: There is no such file.
        RfgsFormatError: It is damaged, no encoder, or of another version.
    """
    if path.suffix != ".npz" and path.is_file():
        raise RfgsError(f"{path}: expected an encoder, a file that ends in .npz; {_REMEDY}")
    arrays = load_arrays(path, _REMEDY, _SHAPES, types=_TYPES, others=True)
    schema, kind = str(arrays["schema"]), str(arrays["network"])
    if schema != SCHEMA:
        raise RfgsFormatError(f"{path}: expected schema {SCHEMA}, found {schema}; {_REMEDY}")
    if kind not in NETWORKS:
        raise RfgsFormatError(f"{path}: network {kind!r} is unknown; {_REMEDY}")
    model = EncoderModel(kind, 0)
    expected = {f"weights.{name}": value for name, value in model.state_dict().items()}
    for name, value in expected.items():
        found = arrays.get(name)
        shape, dtype = tuple(value.shape), value.numpy().dtype
        fits = found is not None and (found.shape, found.dtype) == (shape, dtype)
        if found is None or not fits or not np.isfinite(found).all():
            raise RfgsFormatError(
                f"{path}: {name} is missing, not finite or not of shape {shape}, {dtype}; {_REMEDY}"
            )
    model.load_state_dict(
        {name.removeprefix("weights."): torch.from_numpy(arrays[name]) for name in expected}
    )
    radio = RadioSignature(
        freq_hz=arrays["freq_hz"],
        tx_offset_m=arrays["tx_offset_m"],
        rx_offset_m=arrays["rx_offset_m"],
        packets=int(arrays["packets"]),
        packet_interval_s=float(arrays["packet_interval_s"]),
    )
    return LearnedEncoder(kind, model, radio, str(path))
