# SPDX-License-Identifier: Apache-2.0
"""The JSON files of a dataset as dataclasses, and the checks that make them trustworthy."""

from __future__ import annotations

import re
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float64

from rfgs_core.dataset.pictures import MAX_PIXELS
from rfgs_core.dataset.rows import DeviceRow, SequenceRows
from rfgs_core.dataset.store_schema import LARGEST_CHUNK_BYTES
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.files import read_json
from rfgs_core.radio import DevicePose, Radio
from rfgs_core.radio.antennas import PATTERNS, POLARIZATIONS
from rfgs_core.records import record, unknown_fields
from rfgs_core.rotations import of_unit_length

DATASET_SCHEMA = "rfgs-dataset/1"
SEQUENCE_SCHEMA = "rfgs-sequence/1"

#: Everything a dataset may hold; commands name what they miss.
CONTENTS = (
    "csi",
    "csi_static",
    "csi_impaired",
    "paths",
    "images",
    "depth",
    "normal",
    "mask",
    "geometry",
)

#: Outer surface of an adult that sets the size of a predicted point set [m²].
PERSON_SURFACE_M2 = 1.6

#: More rows, columns, subcarriers or samples than this are none of a radio's.
_MOST = 2**24
#: More elements than this, or links between them, are in no layout.
_MOST_ELEMENTS, _MOST_LINKS = 2**20, 2**24
_NAME = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9_.-]{0,199}")


@dataclass(frozen=True)
class DatasetInfo:
    """What `dataset.json` holds."""

    versions: dict[str, str]
    """Versions of the packages and of Blender that made the data."""
    config: dict[str, Any]
    """Everything asked of the program that made the data."""
    root_seed: int
    """Seed that all other seeds derive from."""
    has: list[str]
    """What is present, of `CONTENTS`."""
    sequences: list[str]
    """Names of the sequences, also their folders."""
    manifest_sha256: str = ""
    """Digest of `MANIFEST.sha256`; empty while the dataset is being made."""


@dataclass(frozen=True)
class SequenceInfo:
    """What `sequence.json` holds."""

    scene: str
    """Name of the scene."""
    blend_sha256: str
    """Digest of the Blender file."""
    frames: list[int]
    """Blender frame numbers, ascending."""
    frame_start: int
    """Frame whose time is zero."""
    fps: float
    """Frames per second."""
    bounds_m: list[list[float]]
    """Minimum and maximum of the scene [m], 2 x 3."""
    cameras: list[dict[str, Any]]
    """Name, intrinsics [px], `world_from_camera` and `split` of each camera."""
    devices: dict[str, list[dict[str, Any]]]
    """Name and pose of every device, by radio."""
    radios: dict[str, dict[str, Any]]
    """All fields of each radio, by name."""
    splits: dict[str, Any]
    """What is held out of training."""
    materials: list[dict[str, Any]] = field(default_factory=list)
    """Radio materials of the scene."""
    instances: list[dict[str, Any]] = field(default_factory=list)
    """Ids that masks use, with name, class and nominal surface [m²]."""
    objects: list[dict[str, Any]] = field(default_factory=list)
    """What paths can meet, with id, name, class and instance."""
    guesses: list[dict[str, Any]] = field(default_factory=list)
    """Every default that was guessed, with the reason."""
    trace_depth: int = 1
    """Interactions of a path that meets a person, that one included; of an ultra-wide band 1."""
    shadow: str = "kirchhoff"
    """How bodies shadow paths: kirchhoff or hard."""
    tracer: str = "sionna"
    """What traced the channels: sionna or fast."""


def info_json(info: DatasetInfo | SequenceInfo) -> dict[str, Any]:
    """The JSON object of a dataclass, with its schema."""
    schema = DATASET_SCHEMA if isinstance(info, DatasetInfo) else SEQUENCE_SCHEMA
    return {"schema": schema, **asdict(info)}


def read_dataset_info(path: Path) -> DatasetInfo:
    """Reads `dataset.json`.

    Raises:
        RfgsError: The file does not exist or is of a newer schema.
        RfgsFormatError: The file does not keep to its schema.
    """
    value = _of_schema(path, DATASET_SCHEMA)
    info = record(path, value, DatasetInfo)
    for name in info.sequences:
        check_name(path, name)
    unknown = sorted(set(info.has) - set(CONTENTS))
    if unknown:
        raise RfgsFormatError(f"{path}: has: unknown contents {', '.join(unknown)}")
    return info


def read_sequence_info(path: Path) -> SequenceInfo:
    """Reads `sequence.json`.

    Raises:
        RfgsError: The file does not exist or is of a newer schema.
        RfgsFormatError: The file does not keep to its schema.
    """
    value = _of_schema(path, SEQUENCE_SCHEMA)
    rows = record(path, value, SequenceRows)
    info = record(path, value, SequenceInfo)
    for name in [*info.radios, *(row.name for row in rows.cameras)]:
        check_name(path, name)
    if sorted(set(info.frames)) != info.frames:
        raise RfgsFormatError(f"{path}: expected ascending frame numbers and fps > 0")
    if not (np.diff(bounds_array(info), axis=0) > 0.0).all():
        raise RfgsFormatError(f"{path}: bounds_m: expected [[min xyz], [max xyz]]")
    if not set(info.radios) == set(info.devices) == set(rows.splits.rf):
        raise RfgsFormatError(f"{path}: radios, devices and splits.rf name different radios")
    for row in rows.cameras:
        if row.width * row.height > MAX_PIXELS:
            raise RfgsFormatError(f"{path}: camera {row.name!r}: expected up to {MAX_PIXELS} px")
    return info


def check_name(path: Path, name: Any) -> None:
    """Refuses names that could not be plain file names inside the dataset.

    Raises:
        RfgsFormatError: The name holds anything but letters, digits, `_`, `-` and inner dots,
            or is longer than file systems have names.
    """
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        raise RfgsFormatError(
            f"{path}: {str(name)[:60]!r} leads outside the dataset or is no plain file name; "
            "expected letters, digits, '_' and '-'"
        )


def radio_from_json(path: Path, values: dict[str, Any]) -> Radio:
    """Builds a radio from the fields stored in a sequence.

    Raises:
        RfgsFormatError: A field is missing, unknown, of another type or impossible.
    """
    source = f"{path}: radio {values.get('name')!r}"
    unknown = unknown_fields(values, Radio)
    if unknown:
        raise RfgsFormatError(f"{source}: unknown field {unknown[0]!r}")
    radio: Radio = record(source, values, Radio)
    counts = ("num_subcarriers", "tx_rows", "tx_cols", "rx_rows", "rx_cols", "samples_per_frame")
    wrong = [name for name in counts if not 1 <= getattr(radio, name) <= _MOST]
    wrong += [] if 0.0 < radio.freq_min_hz < radio.freq_max_hz else ["freq_max_hz"]
    wrong += [] if radio.pattern in PATTERNS else ["pattern"]
    wrong += [] if radio.polarization in POLARIZATIONS else ["polarization"]
    if wrong:
        value = getattr(radio, wrong[0])
        raise RfgsFormatError(f"{source}: {wrong[0]}: {value!r} is impossible")
    return radio


def check_size(path: Path, radio: Radio, devices: int) -> None:
    """Refuses a radio whose channel no frame could hold, before any of it is laid out.

    Raises:
        RfgsFormatError: It is larger than a chunk of the store.
    """
    ports = len(radio.slants_deg) * devices
    tx, rx = radio.tx_rows * radio.tx_cols * ports, radio.rx_rows * radio.rx_cols * ports
    values = radio.samples_per_frame * tx * rx * radio.num_subcarriers
    too_large = values * np.dtype(np.complex64).itemsize > LARGEST_CHUNK_BYTES
    if too_large or max(tx, rx) > _MOST_ELEMENTS or tx * rx > _MOST_LINKS:
        raise RfgsFormatError(
            f"{path}: radio {radio.name!r}: {radio.samples_per_frame} samples of {tx} x {rx} "
            f"elements and {radio.num_subcarriers} subcarriers; expected at most "
            f"{LARGEST_CHUNK_BYTES / 2**30:.0f} GiB per frame and {_MOST_LINKS} links"
        )


def device_pose(values: dict[str, Any]) -> DevicePose:
    """Builds a device's pose from the fields stored in a sequence or bundle.

    Raises:
        RfgsFormatError: A field is missing, or the numbers are no position and rotation.
    """
    row: DeviceRow = record("device", values, DeviceRow)
    if not any(row.quat_wxyz):
        raise RfgsFormatError(f"device {row.name!r}: expected finite numbers and a rotation")
    return DevicePose(row.name, row.position_m, of_unit_length(row.quat_wxyz), row.role)


def bounds_array(info: SequenceInfo) -> Float64[np.ndarray, "2 3"]:
    """Scene bounds [m] as an array."""
    return np.asarray(info.bounds_m, dtype=np.float64)


def _of_schema(path: Path, schema: str) -> dict[str, Any]:
    value = record(path, read_json(path), dict[str, Any])
    check_schema(path, value.get("schema"), schema)
    return value


def check_schema(path: Path, found: Any, expected: str) -> None:
    """Refuses other schemas and newer versions of the expected one.

    Raises:
        RfgsError: The file was written by a newer version of this software.
        RfgsFormatError: The file is of another kind.
    """
    family, _, version = expected.partition("/")
    got_family, _, got_version = str(found).partition("/")
    if got_family != family or not got_version.isdigit():
        raise RfgsFormatError(f"{path}: expected schema {expected!r}, got {found!r}")
    if int(got_version) > int(version):
        raise RfgsError(
            f"{path}: schema {found} is newer than {expected}, the newest this version reads; "
            "update RF-GS"
        )
