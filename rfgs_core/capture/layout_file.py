# SPDX-License-Identifier: Apache-2.0
"""Where the radios of a capture stood: a YAML file that its owner writes."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

from msgspec import Meta, Struct

from rfgs_core.dataset.rows import DeviceRow, Positive, Triple
from rfgs_core.dataset.schema import check_name
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.radio import DevicePose
from rfgs_core.records import record
from rfgs_core.rotations import of_unit_length
from rfgs_core.yaml_file import read_yaml

#: Files of as many receivers are no capture.
_MOST_DEVICES = 1024
_Length = Annotated[float, Meta(ge=0.0, le=1e6)]
#: Fields of a layout that are those of the file.
_SAME = ("name", "radio", "centre_hz", "fps", "rate_hz", "bounds_m", "rx_spacing_m", "tx_spacing_m")

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

    def senders(self, device: int) -> list[int]:
        """Devices that a receiving one may have heard: all others that send, or itself if alone."""
        if len(self.devices) == 1:
            return [device]
        sent = [i for i, other in enumerate(self.devices) if other.role != "RECEIVER"]
        return [i for i in sent if i != device]


class _Device(DeviceRow, kw_only=True, forbid_unknown_fields=True):
    """A device of the file."""

    quat_wxyz: tuple[float, float, float, float] | None = None  # type: ignore[assignment]
    file: str | None = None
    offset_s: Annotated[float, Meta(ge=-1e9, le=1e9)] = 0.0


class _File(Struct, forbid_unknown_fields=True):
    """What the file holds."""

    devices: Annotated[list[_Device], Meta(min_length=1, max_length=_MOST_DEVICES)]
    name: str = "capture"
    radio: str = "radio"
    centre_hz: Positive | None = None
    fps: Positive = 10.0
    rate_hz: Positive | None = None
    bounds_m: tuple[Triple, Triple] | None = None
    rx_spacing_m: _Length = 0.0
    tx_spacing_m: _Length = 0.0


def read_layout(path: Path) -> CaptureLayout:
    """Reads a layout; docs/captures.md explains its fields.

    Raises:
        RfgsError: There is no such file.
        RfgsFormatError: A field is unknown, missing or impossible; the message shows an example.
    """
    said: _File = record(path, read_yaml(path), _File, f"for example {EXAMPLE}")
    names = [row.name for row in said.devices]
    for name in (said.name, said.radio, *names):
        check_name(path, name)
    if len(set(names)) < len(names):
        raise RfgsFormatError(f"{path}: two devices are called {_twice(names)!r}")
    if said.bounds_m and any(low >= high for low, high in zip(*said.bounds_m, strict=True)):
        raise RfgsFormatError(f"{path}: bounds_m: expected [[min x, y, z], [max x, y, z]]")
    layout = CaptureLayout(
        devices=tuple(_pose(path, row) for row in said.devices),
        files=tuple(row.file for row in said.devices),
        offsets_s=tuple(row.offset_s for row in said.devices),
        guesses=tuple(_guess(row) for row in said.devices if row.quat_wxyz is None),
        **{name: getattr(said, name) for name in _SAME},
    )
    heard, sent = layout.receivers, [d for d in layout.devices if d.role != "RECEIVER"]
    if not heard or not sent:
        raise RfgsFormatError(
            f"{path}: expected a device that transmits and one that receives, or one that does "
            f"both (role ACCESS_POINT), for example {EXAMPLE}"
        )
    _need_one_sender(path, layout)
    return layout


def _need_one_sender(path: Path, layout: CaptureLayout) -> None:
    """Files do not say who sent, so each receiving device has to have a single one to hear."""
    for device in layout.receivers:
        name = layout.devices[device].name
        senders = [layout.devices[sender].name for sender in layout.senders(device)]
        if not senders:
            raise RfgsFormatError(
                f"{path}: {name!r} is the only device that transmits, so its own file would hold "
                "nothing of the others; give it role TRANSMITTER, and no file"
            )
        if len(senders) > 1:
            raise RfgsFormatError(
                f"{path}: {name!r} may have heard any of {', '.join(map(repr, senders))}, and its "
                "file does not say which; import the packets of each as a capture of its own, "
                "with a layout of one device with role TRANSMITTER and others with role RECEIVER"
            )


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


def _pose(path: Path, row: _Device) -> DevicePose:
    quat_wxyz = (1.0, 0.0, 0.0, 0.0) if row.quat_wxyz is None else row.quat_wxyz
    if not any(quat_wxyz):
        raise RfgsFormatError(f"{path}: {row.name}: quat_wxyz: expected a rotation, found zeros")
    return DevicePose(row.name, row.position_m, of_unit_length(quat_wxyz), row.role)


def _guess(row: _Device) -> dict[str, Any]:
    return {
        "object": row.name,
        "what": "orientation",
        "value": "along x",
        "reason": "the layout gives no quat_wxyz",
    }


def _twice(names: list[str]) -> str:
    return next(name for name in names if names.count(name) > 1)
