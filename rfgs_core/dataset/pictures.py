# SPDX-License-Identifier: Apache-2.0
"""Pictures without metadata: equal pixels give equal bytes."""

from __future__ import annotations

import io
import struct
import warnings
import zlib
from pathlib import Path

import numpy as np
from jaxtyping import Float, Float32, UInt8, UInt16
from PIL import Image, UnidentifiedImageError

from rfgs_core.dataset.exr import MOST_BYTES, decode_exr
from rfgs_core.errors import RfgsFormatError
from rfgs_core.files import replacing, write_bytes
from rfgs_core.links import refuse_link

#: Larger pictures than this many pixels are taken for a decompression bomb.
MAX_PIXELS = 64_000_000
_EXR_DAMAGE = (
    *(RuntimeError, ValueError, OSError, TypeError, KeyError, MemoryError, OverflowError),
    *(AttributeError, IndexError, struct.error, zlib.error),
)


def write_png(path: Path, pixels: UInt8[np.ndarray, "h w c"] | UInt16[np.ndarray, "h w"]) -> None:
    """Writes RGB or RGBA of 8 bit, or one channel of 16 bit."""
    stream = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(pixels)).save(stream, "PNG", compress_level=6)
    write_bytes(path, stream.getvalue())


def read_png_rgba(path: Path) -> UInt8[np.ndarray, "h w 4"]:
    """Reads a colour picture; alpha is 255 where the file has none.

    Raises:
        RfgsFormatError: The file is missing, truncated or not a picture.
    """
    return _read_png(path, "RGBA").astype(np.uint8)


def read_png_u16(path: Path) -> UInt16[np.ndarray, "h w"]:
    """Reads a picture of one 16-bit channel.

    Raises:
        RfgsFormatError: The file is missing, truncated or of another kind.
    """
    pixels = _read_png(path, "")
    if pixels.ndim != 2:
        raise RfgsFormatError(f"{path}: expected one channel, got shape {pixels.shape}")
    return pixels.astype(np.uint16)


def write_exr(path: Path, channels: dict[str, Float[np.ndarray, "h w"]]) -> None:
    """Writes float channels (float32 or float16, as given) without a date or host in the header."""
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    planes = {name: np.ascontiguousarray(plane) for name, plane in channels.items()}
    with replacing(path) as temporary:
        OpenEXR.File(header, planes).write(str(temporary))


def read_exr(path: Path) -> dict[str, Float32[np.ndarray, "h w"]]:
    """Reads every channel of an EXR file as float32, of any kind, as Blender writes them.

    Only for files that a program of ours has just made: a damaged header ends the library, and the
    process with it. Those of a dataset are for `read_planes`.

    Raises:
        RfgsFormatError: The file is missing, truncated or not an EXR.
    """
    import OpenEXR

    refuse_link(path)
    if not path.is_file():
        raise RfgsFormatError(f"{path}: no such picture; the dataset is incomplete")
    try:
        with OpenEXR.File(str(path), separate_channels=True) as file:
            stored = {
                name: np.array(channel.pixels, np.float32)
                for part in file.parts
                for name, channel in part.channels.items()
            }
    except _EXR_DAMAGE as error:
        raise RfgsFormatError(f"{path}: damaged or truncated EXR ({error})") from error
    if not stored:
        raise RfgsFormatError(f"{path}: EXR without channels")
    return stored


def read_planes(path: Path, names: str) -> list[Float32[np.ndarray, "h w"]]:
    """Reads channels of an EXR file of a dataset, by their names, a letter each.

    Raises:
        RfgsFormatError: The file is missing, truncated, too large or not such an EXR.
    """
    refuse_link(path)
    try:
        if path.stat().st_size > MOST_BYTES:
            raise ValueError("larger than any picture of a dataset")
        channels = decode_exr(path.read_bytes(), MAX_PIXELS)
    except FileNotFoundError as error:
        raise RfgsFormatError(f"{path}: no such picture; the dataset is incomplete") from error
    except _EXR_DAMAGE as error:
        raise RfgsFormatError(f"{path}: damaged or truncated EXR ({error})") from error
    missing = [name for name in names if name not in channels]
    if missing:
        found = ", ".join(channels)
        raise RfgsFormatError(f"{path}: expected channel {missing[0]!r}, got {found}")
    return [channels[name] for name in names]


def _refuse_large(path: Path, size: tuple[int, int]) -> None:
    """Refuses more pixels than any picture of ours has."""
    if not (0 < size[0] and 0 < size[1] and size[0] * size[1] <= MAX_PIXELS):
        raise RfgsFormatError(f"{path}: picture of {size} pixels is too large")


def _read_png(path: Path, mode: str) -> np.ndarray:
    refuse_link(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            # Other formats that Pillow knows are none of ours; some start programs.
            with Image.open(path, formats=["PNG"]) as image:
                _refuse_large(path, image.size)
                return np.asarray(image.convert(mode) if mode else image)
    except FileNotFoundError as error:
        raise RfgsFormatError(f"{path}: no such picture; the dataset is incomplete") from error
    except RfgsFormatError:
        raise
    except (
        UnidentifiedImageError,
        Image.DecompressionBombWarning,
        Image.DecompressionBombError,
        SyntaxError,
        OSError,
        EOFError,
        MemoryError,
        OverflowError,
        ValueError,
        zlib.error,
        struct.error,
    ) as error:
        raise RfgsFormatError(f"{path}: damaged or truncated picture ({error})") from error
