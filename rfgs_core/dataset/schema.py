# SPDX-License-Identifier: Apache-2.0
"""The JSON files of a dataset as dataclasses, and the checks that make them trustworthy."""

from __future__ import annotations

import re
from dataclasses import MISSING, asdict, dataclass, field, fields
from pathlib import Path
from typing import Any, get_args

import numpy as np
from jaxtyping import Float64

from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.files import read_json
from rfgs_core.radio import DevicePose, Radio
from rfgs_core.radio.antennas import PATTERNS, POLARIZATIONS
from rfgs_core.radio.layout import Role
from rfgs_core.radio.presets import OwnLinks

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

_NAME = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9_.-]*")
_TYPES: dict[str, type | tuple[type, ...]] = {
    "bool": bool,
    "int": int,
    "float": (int, float),
    "str": str,
    "list": list,
    "dict": dict,
    "tuple": (list, tuple),
}


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
    info = DatasetInfo(**_fields(path, DatasetInfo, DATASET_SCHEMA))
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
    info = SequenceInfo(**_fields(path, SequenceInfo, SEQUENCE_SCHEMA))
    if not all(isinstance(row, dict) for row in (*info.cameras, *info.radios.values())):
        raise RfgsFormatError(f"{path}: cameras and radios: expected JSON objects")
    for name in [*info.radios, *(row.get("name") for row in info.cameras)]:
        check_name(path, name)
    whole = all(type(frame) is int for frame in info.frames)
    if not whole or not info.frames or sorted(set(info.frames)) != info.frames or info.fps <= 0:
        raise RfgsFormatError(f"{path}: expected ascending frame numbers and fps > 0")
    if not _are_bounds(info.bounds_m):
        raise RfgsFormatError(f"{path}: bounds_m: expected [[min xyz], [max xyz]]")
    if set(info.radios) != set(info.devices):
        raise RfgsFormatError(f"{path}: radios and devices name different radios")
    return info


def _are_bounds(rows: list[Any]) -> bool:
    """Whether a JSON list is minimum and maximum of a box."""
    try:
        low, high = np.asarray(rows, dtype=np.float64).reshape(2, 3)
    except (TypeError, ValueError):
        return False
    return bool(np.isfinite([low, high]).all() and (low < high).all())


def check_name(path: Path, name: Any) -> None:
    """Refuses names that could not be plain file names inside the dataset.

    Raises:
        RfgsFormatError: The name holds anything but letters, digits, `_`, `-` and inner dots.
    """
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        raise RfgsFormatError(
            f"{path}: {name!r} leads outside the dataset or is no plain file name; "
            "expected letters, digits, '_' and '-'"
        )


def radio_from_json(path: Path, values: dict[str, Any]) -> Radio:
    """Builds a radio from the fields stored in a sequence.

    Raises:
        RfgsFormatError: A field is missing, unknown, of another type or impossible.
    """
    fixed: dict[str, Any] = {
        key: tuple(v) if isinstance(v, list) else v for key, v in values.items()
    }
    links = get_args(OwnLinks)
    for spec in fields(Radio):
        kind = str(spec.type).partition("[")[0]
        value = fixed.get(spec.name, spec.default)
        fits = value in links if kind == "OwnLinks" else isinstance(value, _TYPES.get(kind, object))
        if spec.name in fixed and not fits:
            raise RfgsFormatError(
                f"{path}: radio {fixed.get('name')!r}: {spec.name}: expected "
                f"{' or '.join(links) if kind == 'OwnLinks' else spec.type}, got {value!r}"
            )
    try:
        radio = Radio(**fixed)
    except TypeError as error:
        raise RfgsFormatError(f"{path}: radios: {error}") from error
    counts = ("num_subcarriers", "tx_rows", "tx_cols", "rx_rows", "rx_cols", "samples_per_frame")
    wrong = [name for name in counts if getattr(radio, name) < 1]
    wrong += [] if 0.0 < radio.freq_min_hz < radio.freq_max_hz else ["freq_max_hz"]
    wrong += [] if radio.pattern in PATTERNS else ["pattern"]
    wrong += [] if radio.polarization in POLARIZATIONS else ["polarization"]
    if wrong:
        value = getattr(radio, wrong[0])
        raise RfgsFormatError(f"{path}: radio {radio.name!r}: {wrong[0]}: {value!r} is impossible")
    return radio


def device_pose(values: dict[str, Any]) -> DevicePose:
    """Builds a device's pose from the fields stored in a sequence or bundle.

    Raises:
        RfgsFormatError: A field is missing, or the numbers are no position and rotation.
    """
    try:
        x, y, z = (float(value) for value in values["position_m"])
        w, i, j, k = (float(value) for value in values["quat_wxyz"])
        name = str(values["name"])
    except (KeyError, TypeError, ValueError) as error:
        raise RfgsFormatError(
            f"device {values!r}: expected name, position_m [m] and quat_wxyz ({error})"
        ) from error
    if not np.isfinite([x, y, z, w, i, j, k]).all() or not np.any([w, i, j, k]):
        raise RfgsFormatError(f"device {name!r}: expected finite numbers and a rotation")
    role = values.get("role", "ACCESS_POINT")
    if role not in get_args(Role):
        raise RfgsFormatError(f"device {name!r}: role: expected {' or '.join(get_args(Role))}")
    return DevicePose(name, (x, y, z), (w, i, j, k), role)


def bounds_array(info: SequenceInfo) -> Float64[np.ndarray, "2 3"]:
    """Scene bounds [m] as an array."""
    return np.asarray(info.bounds_m, dtype=np.float64)


def _fields(path: Path, kind: type, schema: str) -> dict[str, Any]:
    value = read_json(path)
    if not isinstance(value, dict):
        raise RfgsFormatError(f"{path}: expected a JSON object")
    check_schema(path, value.get("schema"), schema)
    known = {}
    for spec in fields(kind):
        if spec.name not in value:
            if spec.default is not MISSING or spec.default_factory is not MISSING:
                continue
            raise RfgsFormatError(f"{path}: field {spec.name!r} is missing")
        expected = _TYPES[str(spec.type).partition("[")[0]]
        if not isinstance(value[spec.name], expected):
            raise RfgsFormatError(
                f"{path}: field {spec.name!r}: expected {spec.type}, got "
                f"{type(value[spec.name]).__name__}"
            )
        known[spec.name] = value[spec.name]
    return known


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
