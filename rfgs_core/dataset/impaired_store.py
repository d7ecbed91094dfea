# SPDX-License-Identifier: Apache-2.0
"""Impaired channels beside the clean ones: further arrays of the same Zarr store."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Complex64, Float64

from rfgs_core.dataset.csi_store import digest
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.radio.impairments import Draw, Impairments, impairments_from_json

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
        shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def writing_impaired(path: Path) -> Iterator[ImpairedWriter]:
    """Yields a writer; everything appears in the store when the block ends, the channels last.

    Args:
        path: The store, which holds all clean channels and no impaired ones.
    """
    temporary = path / _TEMPORARY
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

        clean = zarr.open_array(str(path / "csi"), mode="r")
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


def read_impaired(path: Path, index: int) -> Complex64[np.ndarray, "sample tx rx subcarrier"]:
    """Impaired channels of one frame, checked against the digest written with them.

    Raises:
        RfgsError: The store holds no impaired channels.
        RfgsFormatError: The chunk is missing, truncated or altered.
    """
    array = _open(path, IMPAIRED)
    file = impaired_chunk(path, index)
    count = int(array.chunks[0])
    try:
        value = np.asarray(array[index * count : (index + 1) * count])
    except (RuntimeError, ValueError, OSError, IndexError) as error:
        raise RfgsFormatError(f"{file}: truncated or damaged CSI chunk ({error})") from error
    digests = array.attrs.get("sha256")
    if not isinstance(digests, list) or len(digests) <= index or digests[index] != digest(value):
        raise RfgsFormatError(f"{file}: CSI chunk differs from the digest in {IMPAIRED}")
    return value


def impaired_chunk(path: Path, index: int) -> Path:
    """File that holds one frame's impaired channels."""
    return path / IMPAIRED / "c" / str(index) / "0" / "0" / "0"


def read_draw(path: Path) -> Impaired:
    """What was drawn for a store's impaired channels.

    Raises:
        RfgsError: The store holds no impaired channels.
        RfgsFormatError: An array or its metadata is damaged.
    """
    import zarr

    attributes: dict[str, Any] = dict(_open(path, IMPAIRED).attrs)
    values = {}
    for name in _ARRAYS:
        try:
            values[name] = np.asarray(_open(path, name)[...])
        except (RuntimeError, ValueError, OSError) as error:
            raise RfgsFormatError(f"{path / name}: truncated or damaged ({error})") from error
    values["time_s"] = np.asarray(zarr.open_array(str(path / "time_s"), mode="r")[...])
    try:
        settings = impairments_from_json(json.loads(str(attributes["impairments"])))
        seed = int(attributes["seed"])
    except (KeyError, ValueError, TypeError, RfgsError) as error:
        raise RfgsFormatError(f"{path / IMPAIRED}: damaged settings ({error})") from error
    gain_db = values.pop("gain_db")
    return Impaired(settings, seed, Draw(**values), gain_db)


def _open(path: Path, name: str) -> Any:
    import zarr

    if not has_impaired(path):
        raise RfgsError(f"{path}: holds no impaired channels; add them with: rfgs-factory impair")
    try:
        return zarr.open_array(str(path / name), mode="r")
    except (FileNotFoundError, ValueError, KeyError, TypeError) as error:
        raise RfgsFormatError(f"{path / name}: damaged or missing array ({error})") from error
