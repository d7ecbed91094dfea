# SPDX-License-Identifier: Apache-2.0
"""Impaired channels beside the clean ones: further arrays of the same Zarr store."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import msgspec
import numpy as np
from jaxtyping import Complex64, Float64

from rfgs_core.dataset.csi_store import chunk_file, digest, read_csi
from rfgs_core.dataset.store_schema import check_array, check_store
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.links import refuse_link
from rfgs_core.radio.impairments import Draw, Impairments, impairments_from_json
from rfgs_core.records import record

IMPAIRED = "csi_impaired"
_TEMPORARY = f".tmp-{IMPAIRED}"

#: Dimensions and unit of everything that is stored beside the impaired channels.
_ARRAYS: dict[str, tuple[tuple[str, ...], str]] = {
    "cfo_hz": (("device",), "Hz"),
    "sfo_ppm": (("device",), "1e-6"),
    "sto_s": (("time", "device"), "s"),
    "phase_noise_rad": (("time", "device"), "rad"),
    "rx_order": (("time", "rx"), "1"),
    "packet_received": (("time", "tx_unit", "rx_unit"), "1"),
    "timestamp_s": (("time", "device"), "s"),
    "gain_db": (("time", "tx_unit", "rx_unit"), "dB"),
}


@dataclass(frozen=True)
class Impaired:
    """Everything known about a store's impaired channels but the channels themselves."""

    settings: Impairments
    """How strong each impairment was."""
    seed: int
    """Root seed of the draw."""
    draw: Draw
    """What was drawn."""
    gain_db: Float64[np.ndarray, "time tx_unit rx_unit"]
    """Gain between each transmitting and receiving device [dB]."""


def has_impaired(path: Path) -> bool:
    """Whether a store holds impaired channels."""
    return (path / IMPAIRED / "zarr.json").is_file()


def impaired_folders(path: Path) -> list[Path]:
    """Every folder of a store that impaired channels and their draws may occupy."""
    return [path / name for name in (IMPAIRED, *_ARRAYS, _TEMPORARY)]


def remove_impaired(path: Path) -> None:
    """Removes impaired channels and what was drawn for them; the clean ones stay."""
    for folder in impaired_folders(path):
        refuse_link(folder)
        shutil.rmtree(folder, ignore_errors=True)


def is_of_impaired(name: str) -> bool:
    """Whether a file of a dataset, as its manifest names it, is one that impairments add."""
    return any(f"/csi.zarr/{folder}/" in name for folder in (IMPAIRED, *_ARRAYS))


@contextmanager
def writing_impaired(path: Path) -> Iterator[ImpairedWriter]:
    """Yields a writer; everything appears in the store when the block ends, the channels last.

    Args:
        path: The store, which holds all clean channels and no impaired ones.
    """
    temporary = path / _TEMPORARY
    refuse_link(temporary)
    shutil.rmtree(temporary, ignore_errors=True)
    try:
        writer = ImpairedWriter(path, temporary)
        yield writer
        for name in (*_ARRAYS, IMPAIRED):
            os.replace(temporary / name, path / name)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


class ImpairedWriter:
    """Fills a temporary group frame by frame."""

    def __init__(self, path: Path, temporary: Path) -> None:
        import zarr

        check_array(path, "csi")
        clean = zarr.open_array(str(path / "csi"), mode="r", zarr_format=3)
        self._samples = int(clean.chunks[0])
        self._group = zarr.open_group(str(temporary), mode="w", zarr_format=3)
        self._array = self._group.create_array(
            IMPAIRED,
            shape=clean.shape,
            chunks=clean.chunks,
            dtype="complex64",
            fill_value=complex(np.nan, np.nan),
            dimension_names=("time", "tx", "rx", "subcarrier"),
        )
        self._digests: list[str] = []

    def append(self, value: Complex64[np.ndarray, "sample tx rx subcarrier"]) -> None:
        """Writes the next frame's channels."""
        start = len(self._digests) * self._samples
        self._array[start : start + self._samples] = value
        self._digests.append(digest(value))

    def describe(self, known: Impaired) -> None:
        """Writes what was drawn, after all frames."""
        values = {spec.name: getattr(known.draw, spec.name) for spec in fields(known.draw)}
        values["gain_db"] = known.gain_db
        for name, (dimensions, unit) in _ARRAYS.items():
            self._group.create_array(
                name,
                data=np.ascontiguousarray(values[name]),
                dimension_names=dimensions,
                attributes={"units": unit},
            )
        self._array.update_attributes(
            {
                "units": "1",
                # xarray takes these for coordinates of the channels.
                "coordinates": " ".join(_ARRAYS),
                "impairments": json.dumps(asdict(known.settings), sort_keys=True),
                "seed": known.seed,
                "sha256": self._digests,
            }
        )


def read_impaired(
    path: Path, index: int, links: tuple[int, int, int], counts: tuple[int, ...]
) -> Complex64[np.ndarray, "sample tx rx subcarrier"]:
    """Impaired channels of one frame, checked against the digest written with them.

    Args:
        path: The store.
        index: Which frame of the store.
        links: Transmitting and receiving elements, and subcarriers, that it must hold.
        counts: How many samples a frame may have.

    Raises:
        RfgsError: The store holds no impaired channels.
        RfgsFormatError: The chunk is missing, truncated or altered.
    """
    digests = _about(path).sha256
    value = read_csi(path, index, None, links, counts, IMPAIRED)
    if len(digests) <= index or digests[index] != digest(value):
        file = impaired_chunk(path, index)
        raise RfgsFormatError(f"{file}: CSI chunk differs from the digest in {IMPAIRED}")
    return value


def impaired_chunk(path: Path, index: int) -> Path:
    """File that holds one frame's impaired channels."""
    return chunk_file(path, index, IMPAIRED)


def read_draw(path: Path, sizes: Mapping[str, int]) -> Impaired:
    """What was drawn for a store's impaired channels.

    Args:
        path: The store.
        sizes: How long its dimensions are.

    Raises:
        RfgsError: The store holds no impaired channels.
        RfgsFormatError: An array or its metadata is damaged.
    """
    import zarr

    about = _about(path)
    check_store(path, sizes)
    values = {}
    for name in (*_ARRAYS, "time_s"):
        try:
            array = zarr.open_array(str(path / name), mode="r", zarr_format=3)
            values[name] = np.asarray(array[...])
        except (RuntimeError, ValueError, OSError, MemoryError) as error:
            raise RfgsFormatError(f"{path / name}: truncated or damaged ({error})") from error
    try:
        settings = impairments_from_json(msgspec.json.decode(about.impairments))
    except (ValueError, RecursionError, RfgsError) as error:
        raise RfgsFormatError(f"{path / IMPAIRED}: damaged settings ({error})") from error
    gain_db = values.pop("gain_db")
    return Impaired(settings, about.seed, Draw(**values), gain_db)


@dataclass(frozen=True)
class _About:
    """Attributes of the impaired channels."""

    impairments: str
    """Their settings as JSON."""
    seed: int
    sha256: list[str]
    """Digest of each frame."""


def _about(path: Path) -> _About:
    if not has_impaired(path):
        raise RfgsError(f"{path}: holds no impaired channels; add them with: rfgs-factory impair")
    array = check_array(path, IMPAIRED)
    return record(path / IMPAIRED / "zarr.json", array.attributes, _About)
