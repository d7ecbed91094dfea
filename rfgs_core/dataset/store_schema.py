# SPDX-License-Identifier: Apache-2.0
"""What a store of channels may be made of: Zarr 3 with these arrays, types and codecs alone.

Everything is compared before anything is decoded or allocated, so no codec of another kind (pickle
is one) and no shape that the file cannot hold ever reaches the libraries behind.
"""

from __future__ import annotations

import itertools
import math
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec

from rfgs_core.dataset.chunk_file import MOST_BYTES, refuse_chunk
from rfgs_core.errors import RfgsFormatError
from rfgs_core.files import read_json
from rfgs_core.links import refuse_link, strange_entries
from rfgs_core.radio import Layout, Radio
from rfgs_core.records import read_record, record

#: A frame is one chunk, and the codec takes no larger one [bytes].
LARGEST_CHUNK_BYTES = 2**31 - 2**20
#: Coordinates are read whole; those of a million samples have some hundred such pieces.
_MOST_CHUNKS = 10_000

_BYTES = {"bool": 1, "int64": 8, "float64": 8, "complex64": 8}
#: Type and dimensions of every array; `sample` leads what antennas that move have more of.
_ARRAYS: dict[str, tuple[str, tuple[tuple[str, ...], ...]]] = {
    **dict.fromkeys(("csi", "csi_impaired"), ("complex64", (("time", "tx", "rx", "subcarrier"),))),
    "csi_static": (
        "complex64",
        (("tx", "rx", "subcarrier"), ("sample", "tx", "rx", "subcarrier")),
    ),
    "frame": ("int64", (("time",),)),
    "sample_index": ("int64", (("time",),)),
    "time_s": ("float64", (("time",),)),
    "tx_device": ("int64", (("tx",),)),
    **dict.fromkeys(("rx_device", "rx_column"), ("int64", (("rx",),))),
    "tx_slant_deg": ("float64", (("tx",),)),
    "rx_slant_deg": ("float64", (("rx",),)),
    "tx_quat_wxyz": ("float64", (("tx", "wxyz"),)),
    "rx_quat_wxyz": ("float64", (("rx", "wxyz"),)),
    "tx_xyz": ("float64", (("tx", "xyz"), ("time", "tx", "xyz"))),
    "rx_xyz": ("float64", (("rx", "xyz"), ("time", "rx", "xyz"))),
    "freq_hz": ("float64", (("subcarrier",),)),
    "measured": ("bool", (("tx", "rx"),)),
    **dict.fromkeys(("cfo_hz", "sfo_ppm"), ("float64", (("device",),))),
    **dict.fromkeys(
        ("sto_s", "phase_noise_rad", "timestamp_s"), ("float64", (("time", "device"),))
    ),
    "rx_order": ("int64", (("time", "rx"),)),
    "packet_received": ("bool", (("time", "tx_unit", "rx_unit"),)),
    "gain_db": ("float64", (("time", "tx_unit", "rx_unit"),)),
}
#: What no store is without.
_NEEDED = (
    *("csi", "frame", "time_s", "freq_hz", "measured", "tx_xyz", "rx_xyz"),
    *("tx_device", "rx_device"),
)

_Size = Annotated[int, msgspec.Meta(ge=0, le=2**40)]
_Step = Annotated[int, msgspec.Meta(ge=1, le=2**40)]


class _Strict(msgspec.Struct, forbid_unknown_fields=True):
    """An object of `zarr.json` that holds nothing but what its class names."""


class _Endian(_Strict):
    endian: Literal["little"]


class _Bytes(_Strict):
    name: Literal["bytes"]
    configuration: _Endian | None = None


class _Level(_Strict):
    level: int
    checksum: bool


class _Zstd(_Strict):
    name: Literal["zstd"]
    configuration: _Level


class _Chunks(_Strict):
    chunk_shape: list[_Step]


class _Grid(_Strict):
    name: Literal["regular"]
    configuration: _Chunks


class _Separator(_Strict):
    separator: Literal["/"]


class _Keys(_Strict):
    name: Literal["default"]
    configuration: _Separator


class _Attributes(_Strict, rename={"fill_value": "_FillValue"}):
    """What is said of an array beside its values; xarray reads more out of other names."""

    units: str = ""
    fill_value: str | float | int | bool | None = None
    coordinates: str = ""
    impairments: str = ""
    seed: int = 0
    sha256: list[str] = []


class Array(_Strict):
    """What `zarr.json` says of an array."""

    zarr_format: Literal[3]
    node_type: Literal["array"]
    shape: list[_Size]
    data_type: Literal["bool", "int64", "float64", "complex64"]
    chunk_grid: _Grid
    chunk_key_encoding: _Keys
    fill_value: Any
    codecs: tuple[_Bytes, _Zstd]
    dimension_names: list[str]
    attributes: dict[str, Any] = {}
    storage_transformers: Annotated[list[Any], msgspec.Meta(max_length=0)] = []

    @property
    def chunk(self) -> list[int]:
        """Shape of a chunk."""
        return self.chunk_grid.configuration.chunk_shape


class _Group(msgspec.Struct):
    zarr_format: Literal[3]
    node_type: Literal["group"]


def check_store(path: Path, sizes: Mapping[str, int] | None = None) -> None:
    """Refuses a store that is made of anything but what the schema knows.

    Args:
        path: Folder of the store.
        sizes: How long dimensions are, as far as that is known from elsewhere.

    Raises:
        RfgsError: There is no store.
        RfgsFormatError: An array is missing, unknown, or of another type, shape or codec.
    """
    read_record(path / "zarr.json", _Group)
    with os.scandir(path) as entries:
        present = {entry.name for entry in entries if entry.is_dir() or entry.is_symlink()}
    known = {name for name in present if not name.startswith(".tmp-")}
    missing, unknown = set(_NEEDED) - known, known - set(_ARRAYS)
    if missing or unknown:
        words = (("missing", missing), ("unknown", unknown))
        found = "; ".join(f"{', '.join(sorted(names))} {word}" for word, names in words if names)
        raise RfgsFormatError(f"{path}: expected the arrays of a radio, found {found}")
    lengths = dict(sizes or {})
    # Everything else is read here and now; a channel's chunk is looked at when it is read.
    channels = [name for name in _ARRAYS if is_channel(name)]
    for entry in strange_entries(path, channels):
        refuse_link(entry)
    total = 0
    for name in sorted(known):
        array = check_array(path, name, lengths, links_known=name not in channels)
        if name in channels:
            continue
        total += math.prod(array.shape) * _BYTES[array.data_type]
        if total > MOST_BYTES:
            raise RfgsFormatError(f"{path}: expected coordinates up to {MOST_BYTES} bytes in all")
        _check_chunks(f"{path}/{name}", array)


def is_channel(name: str) -> bool:
    """Whether an array holds channels, of which every frame is a chunk; others are coordinates."""
    return _ARRAYS[name][0] == "complex64"


def chunk_bytes(array: Array) -> int:
    """What the values of a chunk take [bytes]."""
    return math.prod(array.chunk) * _BYTES[array.data_type]


def store_sizes(frames: int, radio: Radio, layout: Layout) -> dict[str, int]:
    """How long the dimensions of a radio's store are."""
    tx, rx = layout.measured.shape
    devices = 1 + int(max(layout.tx_device.max(), layout.rx_device.max()))
    return {
        "time": frames * radio.samples_per_frame,
        "tx": tx,
        "rx": rx,
        "subcarrier": radio.num_subcarriers,
        "sample": radio.samples_per_frame,
        **dict.fromkeys(("device", "tx_unit", "rx_unit"), devices),
    }


def check_array(
    path: Path, name: str, lengths: dict[str, int] | None = None, *, links_known: bool = False
) -> Array:
    """What `zarr.json` says of an array, compared with the schema.

    Args:
        path: Folder of the store.
        name: Which array.
        lengths: How long dimensions are; those that are not known yet are added.
        links_known: Whether it has been seen already that no link leads out of its folder.

    Raises:
        RfgsError: There is no such array.
        RfgsFormatError: It is of another type, shape or codec than the schema says.
    """
    file = path.joinpath(name, "zarr.json")
    array = record(file, read_json(file, links_known=links_known), Array)
    record(f"{file}: attributes", array.attributes, _Attributes)
    kind, dimensions = _ARRAYS[name]
    if array.data_type != kind or tuple(array.dimension_names) not in dimensions:
        raise RfgsFormatError(
            f"{file}: expected {kind} over {' or '.join(map(', '.join, dimensions))}, found "
            f"{array.data_type} over {', '.join(array.dimension_names)}"
        )
    lengths = {} if lengths is None else lengths
    found = dict(zip(array.dimension_names, array.shape, strict=False))
    for dimension, length in found.items():
        if lengths.setdefault(dimension, length) != length:
            raise RfgsFormatError(
                f"{file}: {dimension}: expected {lengths[dimension]}, found {length}"
            )
    if not len(array.shape) == len(array.chunk) == len(array.dimension_names):
        raise RfgsFormatError(f"{file}: expected a size and a chunk for every dimension")
    largest = LARGEST_CHUNK_BYTES if is_channel(name) else MOST_BYTES
    if chunk_bytes(array) > largest:
        raise RfgsFormatError(
            f"{file}: expected chunks up to {largest / 2**20:.0f} MiB, found {array.chunk}"
        )
    return array


def _check_chunks(path: str, array: Array) -> None:
    """Refuses coordinates whose chunks are too many, or packed otherwise than they should be."""
    grid = [-(-size // step) for size, step in zip(array.shape, array.chunk, strict=True)]
    if math.prod(grid) > _MOST_CHUNKS:
        raise RfgsFormatError(
            f"{path}/zarr.json: expected up to {_MOST_CHUNKS} chunks, found {array.shape} in "
            f"chunks of {array.chunk}"
        )
    size = chunk_bytes(array)
    for place in itertools.product(*map(range, grid)):
        # What was never written reads as the fill value. Names are joined as text: a store has
        # many, and they are looked at whenever it is opened.
        with suppress(FileNotFoundError):
            refuse_chunk("/".join((path, "c", *map(str, place))), size)
