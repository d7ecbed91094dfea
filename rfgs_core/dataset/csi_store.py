# SPDX-License-Identifier: Apache-2.0
"""Channel state information on disk: a Zarr store that several processes fill frame by frame."""

from __future__ import annotations

import hashlib
import math
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Complex64

from rfgs_core.dataset.chunk_file import refuse_chunk
from rfgs_core.dataset.store_schema import (
    LARGEST_CHUNK_BYTES,
    Array,
    check_array,
    check_store,
    chunk_bytes,
)
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.files import replacing_folder, write_json
from rfgs_core.links import refuse_link
from rfgs_core.radio import FrameSamples, Layout, Radio
from rfgs_core.records import read_record

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
    "tx_slant_deg": "degree",
    "rx_slant_deg": "degree",
}


#: What Zarr, its codecs and xarray say of damaged files.
_DAMAGE = (
    *(OSError, ValueError, KeyError, TypeError, RuntimeError, IndexError, MemoryError),
    *(AttributeError, struct.error),
)


@dataclass(frozen=True)
class _Marker:
    """What a frame's marker holds."""

    sha256: str


def create_csi(
    path: Path,
    radio: Radio,
    layout: Layout,
    frames: list[int],
    time_s: list[float],
    samples: FrameSamples | None = None,
) -> None:
    """Creates an empty store in one step; an existing one is left as it is.

    Values that have not been written read as NaN, never as silence. `time` runs over the
    samples of all frames, frame by frame, with the coordinates `frame`, `time_s` and, where a
    frame has several samples, `sample_index` (which of its frame). Antennas that move within a
    frame have `tx_xyz` or `rx_xyz` over (time, element, xyz), and `csi_static` then has a
    leading axis `sample`, to be taken at `sample_index`.

    Args:
        path: Folder of the store.
        radio: Gives the subcarriers.
        layout: Gives the antenna elements.
        frames: Frame numbers.
        time_s: Time of each frame [s].
        samples: The samples of every frame; None for one per frame.

    Raises:
        RfgsError: A frame's samples are more than one chunk can hold.
    """
    samples = samples or FrameSamples()
    links = layout.measured.size * radio.num_subcarriers
    if len(samples) * links * np.dtype(np.complex64).itemsize > LARGEST_CHUNK_BYTES:
        raise RfgsError(
            f"radio {radio.name!r}: {len(samples)} samples per frame of {links} values exceed "
            f"{LARGEST_CHUNK_BYTES / 2**30:.0f} GiB; ask for fewer samples per frame"
        )
    if path.exists():
        return
    with replacing_folder(path) as temporary:
        _create(temporary, radio, layout, frames, time_s, samples)


def write_csi(path: Path, index: int | None, value: np.ndarray, marker: Path) -> None:
    """Writes one frame's channel, then its marker.

    A frame is one chunk of its own, so processes that write different frames never meet.

    Args:
        path: The store.
        index: Which frame of the store; None writes the static channel.
        value: The channel, complex64, (sample, tx, rx, subcarrier), or without `sample` for a
            frame of one sample or a static channel of antennas that stand still; entries of
            links that do not exist are zero.
        marker: File that is written last, with the digest of the values.
    """
    import zarr

    refuse_link(chunk_file(path, index))
    array = zarr.open_array(
        str(path / ("csi_static" if index is None else "csi")), mode="r+", zarr_format=3
    )
    count = 1 if array.ndim == 3 else int(array.chunks[0])
    value = value.reshape(-1, *value.shape[-3:])
    expected = (count, *array.shape[-3:])
    if value.shape != expected or value.dtype != np.complex64:
        raise ValueError(f"expected complex64 {expected}, got {value.dtype} {value.shape}")
    if not np.isfinite(value).all():
        raise RfgsError(f"{path}: frame {index}: the traced channel is not finite")
    if index is None:
        array[...] = value.reshape(array.shape)
    else:
        array[index * count : (index + 1) * count] = value
    write_json(marker, {"sha256": digest(value)})


def read_csi(
    path: Path,
    index: int | None,
    marker: Path | None,
    links: tuple[int, int, int],
    counts: tuple[int, ...],
    name: str = "",
) -> Complex64[np.ndarray, "sample tx rx subcarrier"]:
    """Reads one frame's channel and checks it against its marker.

    Args:
        path: The store.
        index: Which frame of the store; None reads the static channel.
        marker: Marker to check against; None checks only that the chunk is whole.
        links: Transmitting and receiving elements, and subcarriers, that it must hold.
        counts: How many samples a frame may have.
        name: Array to read; empty for `csi`, or `csi_static` for the static channel.

    Returns:
        All samples of the frame; one for a static channel of antennas that stand still.

    Raises:
        RfgsFormatError: The array is none of the schema, or its chunk is missing, truncated or
            altered; the message names its file.
    """
    import zarr

    name = name or ("csi_static" if index is None else "csi")
    lengths: dict[str, int] = dict(zip(DIMENSIONS[1:], links, strict=True))
    about = check_array(path, name, lengths)
    count = _samples(path / name, about, counts)
    file = chunk_file(path, index, name)
    refuse_link(file)
    if not file.is_file():
        raise RfgsFormatError(f"{file}: no such chunk; this frame was never finished")
    refuse_chunk(file, chunk_bytes(about))
    try:
        array = zarr.open_array(str(path / name), mode="r", zarr_format=3)
        which = ... if index is None else slice(index * count, (index + 1) * count)
        value = np.asarray(array[which])
    except _DAMAGE as error:
        raise RfgsFormatError(f"{file}: truncated or damaged CSI chunk ({error})") from error
    if value.size != count * math.prod(links):
        raise RfgsFormatError(f"{path / name}: holds no frame {index}; expected one per frame")
    if marker is not None and _recorded(marker) != digest(value):
        raise RfgsFormatError(f"{file}: CSI chunk differs from the digest in {marker}")
    return value.reshape(-1, *links)


def _samples(path: Path, array: Array, counts: tuple[int, ...]) -> int:
    """Samples in a chunk: one frame, all of its links."""
    *leading, tx, rx, subcarriers = array.chunk
    count = leading[0] if leading else 1
    if [tx, rx, subcarriers] != array.shape[-3:] or count not in counts:
        raise RfgsFormatError(
            f"{path}: expected a chunk of {' or '.join(map(str, counts))} samples of "
            f"{array.shape[-3:]}, found {array.chunk}"
        )
    return count


def chunk_file(path: Path, index: int | None, name: str = "csi") -> Path:
    """File that holds one frame's channel, or the static one for None."""
    if index is not None:
        return path / name / "c" / str(index) / "0" / "0" / "0"
    chunk = path / "csi_static" / "c" / "0" / "0" / "0"
    # Antennas that move within a frame give the static channel one axis more.
    return chunk / "0" if chunk.is_dir() else chunk


def digest(value: np.ndarray) -> str:
    """SHA-256 of an array's values in C order."""
    return hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()


def open_csi(path: Path, sizes: Mapping[str, int] | None = None) -> xarray.Dataset:
    """Opens a store; channels are read when used.

    Args:
        path: Folder of the store.
        sizes: How long its dimensions are, as far as that is known from elsewhere.

    Raises:
        RfgsFormatError: It is missing, or its metadata or a coordinate is damaged.
    """
    import xarray

    check_store(path, sizes)
    name = ""
    try:
        # Nothing of ours is a date or a text, whatever an attribute says.
        data = xarray.open_zarr(
            path, consolidated=False, chunks=None, zarr_format=3, concat_characters=False,
            decode_times=False, decode_timedelta=False,
        )  # fmt: skip
        # Coordinates are small; reading them now finds damage here, not deep in a caller.
        for name in data.coords:
            data.variables[name].load()
    except _DAMAGE as error:
        raise RfgsFormatError(f"{path / str(name)}: damaged or missing ({error})") from error
    return data


def _recorded(marker: Path) -> str:
    if not marker.is_file():
        raise RfgsFormatError(f"{marker}: no such marker; this frame was never finished")
    return read_record(marker, _Marker).sha256


def _create(
    path: Path,
    radio: Radio,
    layout: Layout,
    frames: list[int],
    time_s: list[float],
    samples: FrameSamples,
) -> None:
    import xarray
    import zarr

    dataset = xarray.Dataset(coords=_coordinates(radio, layout, frames, time_s, samples))
    for name, unit in _UNITS.items():
        if name in dataset:
            dataset[name].attrs["units"] = unit
    dataset.attrs["radio"] = radio.name
    dataset.attrs["pattern"], dataset.attrs["polarization"] = radio.pattern, radio.polarization
    dataset.to_zarr(path, mode="w", zarr_format=3, consolidated=False)
    group = zarr.open_group(str(path), mode="r+")
    links = (*layout.measured.shape, radio.num_subcarriers)
    count = len(samples)
    static = ("sample",) if samples.antennas_move else ()
    for name, leading, size, chunk in (
        ("csi", ("time",), (len(frames) * count,), (count,)),
        ("csi_static", static, (count,)[: len(static)], (count,)[: len(static)]),
    ):
        group.create_array(
            name,
            shape=(*size, *links),
            chunks=(*chunk, *links),
            dtype="complex64",
            fill_value=complex(np.nan, np.nan),
            dimension_names=(*leading, *DIMENSIONS[1:]),
            attributes={"units": _UNITS[name]},
        )


def _coordinates(
    radio: Radio, layout: Layout, frames: list[int], time_s: list[float], samples: FrameSamples
) -> dict[str, tuple[Any, np.ndarray]]:
    """Every coordinate of a store with its dimensions."""
    count = len(samples)
    time = np.asarray(time_s, np.float64)[:, None] + samples.offset_s
    found: dict[str, tuple[Any, np.ndarray]] = {
        "frame": ("time", np.repeat(np.asarray(frames, np.int64), count)),
        "time_s": ("time", time.ravel()),
        "tx_device": ("tx", layout.tx_device),
        "rx_device": ("rx", layout.rx_device),
        "rx_column": ("rx", layout.rx_column),
        "tx_slant_deg": ("tx", np.asarray(radio.slants_deg)[layout.tx_port]),
        "rx_slant_deg": ("rx", np.asarray(radio.slants_deg)[layout.rx_port]),
        "tx_quat_wxyz": (("tx", "wxyz"), layout.tx_quat_wxyz),
        "rx_quat_wxyz": (("rx", "wxyz"), layout.rx_quat_wxyz),
        "tx_xyz": (("tx", "xyz"), layout.tx_xyz),
        "rx_xyz": (("rx", "xyz"), layout.rx_xyz),
        "freq_hz": ("subcarrier", radio.freq_hz),
        "measured": (("tx", "rx"), layout.measured),
    }
    if count > 1:
        found["sample_index"] = ("time", np.tile(np.arange(count), len(frames)))
    for name, moved in (("tx", samples.tx_xyz), ("rx", samples.rx_xyz)):
        if moved is not None:
            found[f"{name}_xyz"] = (("time", name, "xyz"), np.tile(moved, (len(frames), 1, 1)))
    return found
