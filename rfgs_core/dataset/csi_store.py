# SPDX-License-Identifier: Apache-2.0
"""Channel state information on disk: a Zarr store that several processes fill frame by frame."""

from __future__ import annotations

import hashlib
import os
import shutil
import uuid
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Complex64

from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.files import read_json, write_json
from rfgs_core.radio import Layout, Radio

if TYPE_CHECKING:
    import xarray

DIMENSIONS = ("time", "tx", "rx", "subcarrier")

_UNITS = {
    "csi": "1",
    "csi_static": "1",
    "freq_hz": "Hz",
    "time_s": "s",
    "tx_xyz": "m",
    "rx_xyz": "m",
}


def create_csi(
    path: Path, radio: Radio, layout: Layout, frames: list[int], time_s: list[float]
) -> None:
    """Creates an empty store in one step; an existing one is left as it is.

    Values that have not been written read as NaN, never as silence.

    Args:
        path: Folder of the store.
        radio: Gives the tones.
        layout: Gives the antenna elements.
        frames: Frame number of each time step.
        time_s: Time of each time step [s].
    """
    if path.exists():
        return
    temporary = path.with_name(f".tmp-{uuid.uuid4().hex[:8]}-{path.name}")
    temporary.parent.mkdir(parents=True, exist_ok=True)
    try:
        _create(temporary, radio, layout, frames, time_s)
        os.replace(temporary, path)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def write_csi(
    path: Path, index: int | None, value: Complex64[np.ndarray, "tx rx subcarrier"], marker: Path
) -> None:
    """Writes one frame's channel, then its marker.

    A frame is one chunk of its own, so processes that write different frames never meet.

    Args:
        path: The store.
        index: Time step; None writes the static channel.
        value: The channel; entries of links that do not exist are zero.
        marker: File that is written last, with the digest of the values.
    """
    import zarr

    array = zarr.open_array(str(path / ("csi_static" if index is None else "csi")), mode="r+")
    expected = array.shape if index is None else array.shape[1:]
    if value.shape != expected or value.dtype != np.complex64:
        raise ValueError(f"expected complex64 {expected}, got {value.dtype} {value.shape}")
    if not np.isfinite(value).all():
        raise RfgsError(f"{path}: step {index}: the traced channel is not finite")
    if index is None:
        array[...] = value
    else:
        array[index] = value
    write_json(marker, {"sha256": digest(value)})


def read_csi(
    path: Path, index: int | None, marker: Path | None
) -> Complex64[np.ndarray, "tx rx subcarrier"]:
    """Reads one frame's channel and checks it against its marker.

    Args:
        path: The store.
        index: Time step; None reads the static channel.
        marker: Marker to check against; None checks only that the chunk is whole.

    Raises:
        RfgsFormatError: The chunk is missing, truncated or altered; the message names its file.
    """
    import zarr

    name = "csi_static" if index is None else "csi"
    try:
        array = zarr.open_array(str(path / name), mode="r")
    except (FileNotFoundError, ValueError, KeyError, TypeError) as error:
        raise RfgsFormatError(f"{path / name}: damaged or missing array ({error})") from error
    file = chunk_file(path, index)
    if not file.is_file():
        raise RfgsFormatError(f"{file}: no such chunk; this frame was never finished")
    try:
        value = np.asarray(array[...] if index is None else array[index])
    except (RuntimeError, ValueError, OSError, IndexError) as error:
        raise RfgsFormatError(f"{file}: truncated or damaged CSI chunk ({error})") from error
    if value.dtype != np.complex64 or value.ndim != 3:
        raise RfgsFormatError(f"{file}: expected complex64 (tx, rx, subcarrier)")
    if marker is not None and _recorded(marker) != digest(value):
        raise RfgsFormatError(f"{file}: CSI chunk differs from the digest in {marker}")
    return value


def chunk_file(path: Path, index: int | None) -> Path:
    """File that holds one frame's channel, or the static one for None."""
    if index is None:
        return path / "csi_static" / "c" / "0" / "0" / "0"
    return path / "csi" / "c" / str(index) / "0" / "0" / "0"


def digest(value: np.ndarray) -> str:
    """SHA-256 of an array's values in C order."""
    return hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()


def open_csi(path: Path) -> xarray.Dataset:
    """Opens a store; channels are read when used.

    Raises:
        RfgsFormatError: It is missing, or its metadata or a coordinate is damaged.
    """
    import xarray

    name = ""
    try:
        data = xarray.open_zarr(path, consolidated=False, chunks=None, zarr_format=3)
        # Coordinates are small; reading them now finds damage here, not deep in a caller.
        for name in data.coords:
            data[name].load()
    except (OSError, ValueError, KeyError, TypeError, RuntimeError) as error:
        raise RfgsFormatError(f"{path / str(name)}: damaged or missing ({error})") from error
    return data


def _recorded(marker: Path) -> str:
    if not marker.is_file():
        raise RfgsFormatError(f"{marker}: no such marker; this frame was never finished")
    value = read_json(marker)
    return str(value.get("sha256")) if isinstance(value, dict) else ""


def _create(
    path: Path, radio: Radio, layout: Layout, frames: list[int], time_s: list[float]
) -> None:
    import xarray
    import zarr

    coordinates = {
        "frame": ("time", np.asarray(frames, np.int64)),
        "time_s": ("time", np.asarray(time_s, np.float64)),
        "tx_device": ("tx", layout.tx_device),
        "rx_device": ("rx", layout.rx_device),
        "rx_column": ("rx", layout.rx_column),
        "tx_xyz": (("tx", "xyz"), layout.tx_xyz),
        "rx_xyz": (("rx", "xyz"), layout.rx_xyz),
        "freq_hz": ("subcarrier", radio.freq_hz),
        "measured": (("tx", "rx"), layout.measured),
    }
    dataset = xarray.Dataset(coords=coordinates)
    for name, unit in _UNITS.items():
        if name in dataset:
            dataset[name].attrs["units"] = unit
    dataset.attrs["radio"] = radio.name
    dataset.to_zarr(path, mode="w", zarr_format=3, consolidated=False)
    group = zarr.open_group(str(path), mode="r+")
    links = (*layout.measured.shape, radio.num_subcarriers)
    for name, leading, dimensions in (
        ("csi", (len(frames),), DIMENSIONS),
        ("csi_static", (), DIMENSIONS[1:]),
    ):
        group.create_array(
            name,
            shape=(*leading, *links),
            chunks=(*(1 for _ in leading), *links),
            dtype="complex64",
            fill_value=complex(np.nan, np.nan),
            dimension_names=dimensions,
            attributes={"units": _UNITS[name]},
        )
