# SPDX-License-Identifier: Apache-2.0
"""Where the radios of a capture stood: a YAML file that its owner writes."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np

from rfgs_core.dataset.schema import check_name, device_pose
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.radio import DevicePose
from rfgs_core.yaml_file import read_yaml

#: Fields of a device beside its pose.
_DEVICE_FIELDS = ("name", "position_m", "quat_wxyz", "role", "file", "offset_s")

EXAMPLE = (
    "devices: [{name: tx, role: TRANSMITTER, position_m: [0, 0, 1]}, "
    "{name: rx, role: RECEIVER, position_m: [3, 0, 1]}]"
)


@dataclass(frozen=True)
class CaptureLayout:
    """Devices and what the files of a capture do not tell."""

    devices: tuple[DevicePose, ...]
    """Poses; of a radar one that both transmits and receives."""
    files: tuple[str | None, ...]
    """Name of each device's file, None where the order of the files decides."""
    offsets_s: tuple[float, ...]
    """Added to each device's times, for clocks that did not begin together [s]."""
    name: str = "capture"
    """Name of the scene and the sequence."""
    radio: str = "radio"
    """Name of the radio."""
    centre_hz: float | None = None
    """Centre of the channel [Hz], where the files do not tell it."""
    fps: float = 10.0
    """Frames per second; each holds all packets until the next one."""
    rate_hz: float | None = None
    """Packets per second of the common clock; the median rate of the files if None."""
    bounds_m: tuple[tuple[float, ...], ...] | None = None
    """Minimum and maximum of the scene [m]; the devices and 1 m around them if None."""
    rx_spacing_m: float = 0.0
    """Distance of neighbouring RX antennas of a device [m]; 0 is half a wavelength."""
    tx_spacing_m: float = 0.0
    """Distance of neighbouring TX antennas of a device [m]; 0 is half a wavelength."""
    guesses: tuple[dict[str, Any], ...] = field(default=())
    """What was not said and is guessed."""

    @property
    def receivers(self) -> list[int]:
        """Devices that hear, each of which has a file."""
        return [i for i, device in enumerate(self.devices) if device.role != "TRANSMITTER"]


_NUMBERS = ("centre_hz", "fps", "rate_hz", "rx_spacing_m", "tx_spacing_m")
_OPEN = ("rx_spacing_m", "tx_spacing_m")


def read_layout(path: Path) -> CaptureLayout:
    """Reads a layout; docs/captures.md explains its fields.

    Raises:
        RfgsError: There is no such file.
        RfgsFormatError: A field is unknown, missing or impossible; the message shows an example.
    """
    values = read_yaml(path)
    if not isinstance(values, dict) or not isinstance(values.get("devices"), list):
        raise RfgsFormatError(f"{path}: expected a list of devices, for example {EXAMPLE}")
    known = {spec.name for spec in fields(CaptureLayout)} - {"files", "offsets_s", "guesses"}
    unknown = sorted(set(values) - known)
    if unknown:
        raise RfgsFormatError(
            f"{path}: unknown field {unknown[0]!r}; expected some of {', '.join(sorted(known))}"
        )
    rows = [_device(path, row) for row in values.pop("devices")]
    names = [pose.name for pose, _, _, _ in rows]
    if len(set(names)) < len(names):
        raise RfgsFormatError(f"{path}: two devices are called {_twice(names)!r}")
    numbers = {key: _number(path, key, values.pop(key)) for key in _NUMBERS if key in values}
    bounds = _bounds(path, values.pop("bounds_m")) if "bounds_m" in values else None
    for key in values:
        check_name(path, values[key])
    layout = CaptureLayout(
        devices=tuple(row[0] for row in rows),
        files=tuple(row[1] for row in rows),
        offsets_s=tuple(row[2] for row in rows),
        bounds_m=bounds,
        guesses=tuple(row[3] for row in rows if row[3]),
        **numbers,
        **values,
    )
    heard, sent = layout.receivers, [d for d in layout.devices if d.role != "RECEIVER"]
    if not heard or not sent:
        raise RfgsFormatError(
            f"{path}: expected a device that transmits and one that receives, or one that does "
            f"both (role ACCESS_POINT), for example {EXAMPLE}"
        )
    return layout


def assign(layout: CaptureLayout, files: list[Path]) -> dict[int, Path]:
    """File of each receiving device: by the name that the layout gives, else in order.

    Raises:
        RfgsError: A device has no file, or a file no device.
    """
    unassigned = list(files)
    found: dict[int, Path] = {}
    for device in layout.receivers:
        wanted = layout.files[device]
        if wanted is not None:
            fitting = [file for file in unassigned if file.name == wanted]
            if not fitting:
                raise RfgsError(
                    f"device {layout.devices[device].name!r}: its file {wanted!r} was not given; "
                    f"given are {', '.join(file.name for file in files)}"
                )
            found[device] = fitting[0]
            unassigned.remove(fitting[0])
    for device in layout.receivers:
        if device not in found and unassigned:
            found[device] = unassigned.pop(0)
    missing = [layout.devices[d].name for d in layout.receivers if d not in found]
    if missing or unassigned:
        what = f"device {missing[0]!r} has no file" if missing else f"{unassigned[0]} has no device"
        raise RfgsError(
            f"{what}: {len(layout.receivers)} devices receive, {len(files)} files are given"
        )
    return dict(sorted(found.items()))


def _device(path: Path, row: Any) -> tuple[DevicePose, str | None, float, dict[str, Any] | None]:
    if not isinstance(row, dict) or set(row) - set(_DEVICE_FIELDS):
        odd = sorted(set(row) - set(_DEVICE_FIELDS))[0] if isinstance(row, dict) else row
        raise RfgsFormatError(
            f"{path}: devices: {odd!r}: expected some of {', '.join(_DEVICE_FIELDS)}"
        )
    guess = None
    if "quat_wxyz" not in row:
        row = {**row, "quat_wxyz": (1.0, 0.0, 0.0, 0.0)}
        guess = {
            **{"object": str(row.get("name")), "what": "orientation", "value": "along x"},
            "reason": "the layout gives no quat_wxyz",
        }
    try:
        pose = device_pose(row)
    except RfgsFormatError as error:
        raise RfgsFormatError(f"{path}: {error}") from error
    check_name(path, pose.name)
    file = row.get("file")
    if file is not None and not isinstance(file, str):
        raise RfgsFormatError(f"{path}: {pose.name}: file: expected a name, got {file!r}")
    offset_s = row.get("offset_s", 0.0)
    if type(offset_s) not in (int, float) or not np.isfinite(offset_s):
        raise RfgsFormatError(f"{path}: {pose.name}: offset_s: expected seconds, got {offset_s!r}")
    return pose, file, float(offset_s), guess


def _number(path: Path, key: str, value: Any) -> float:
    fits = type(value) in (int, float) and np.isfinite(value) and value >= 0
    if not fits or (value == 0 and key not in _OPEN):
        raise RfgsFormatError(f"{path}: {key}: expected a number above 0, got {value!r}")
    return float(value)


def _bounds(path: Path, value: Any) -> tuple[tuple[float, ...], ...]:
    try:
        low, high = np.asarray(value, np.float64).reshape(2, 3)
    except (TypeError, ValueError):
        low = high = np.zeros(3)
    if not np.isfinite([low, high]).all() or (low >= high).any():
        raise RfgsFormatError(f"{path}: bounds_m: expected [[min x, y, z], [max x, y, z]]")
    return tuple(map(float, low)), tuple(map(float, high))


def _twice(names: list[str]) -> str:
    return next(name for name in names if names.count(name) > 1)
