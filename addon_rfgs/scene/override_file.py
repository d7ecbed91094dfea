# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads what a user says about a scene from a JSON file, and refuses what makes no sense."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import AddonError
from ..json_file import read_json
from ..naming import closest
from ..tables import MATERIALS
from .overrides import Overrides, RadioMaterial, Ring, Room

#: Largest file that is read [bytes].
_LARGEST = 4_000_000
#: What Blender holds without a word about it: it cuts other numbers off.
_FPS = (0.001, 32767)
_LAST_FRAME = 1_048_574
_ROLES = ("ACCESS_POINT", "TRANSMITTER", "RECEIVER")


def read_overrides(path: Path | None) -> Overrides:
    """Reads a JSON file of overrides; None gives none.

    Raises:
        AddonError: Naming the key that is unknown or the value that makes no sense.
    """
    if path is None:
        return Overrides()
    # What each key may hold depends on Blender's own limits; their readers say it.
    values = read_json(path, {str: object}, "expected overrides", _LARGEST)
    label = str(values.pop("label", path))
    known = [row.name for row in fields(Overrides) if row.name != "label"]
    _refuse_unknown(label, values, known)
    return Overrides(
        label, **{key: _READERS[key](f"{label}: {key}", value) for key, value in values.items()}
    )


def _refuse_unknown(label: str, values: dict[str, Any], known: list[str]) -> None:
    for key in values:
        if key not in known:
            raise AddonError(f"{label}: unknown key {key!r}{closest(str(key), known)}")


def _numbers(label: str, value: Any, count: int) -> tuple[float, ...]:
    fits = isinstance(value, (list, tuple)) and len(value) == count
    if not fits or not all(_is_number(item) for item in value):
        raise AddonError(f"{label}: expected {count} numbers, got {value!r}")
    return tuple(float(item) for item in value)


def _is_number(value: Any) -> bool:
    # Whole numbers may have any length in JSON; NumPy takes none beyond 64 bits.
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    return number and -1e300 < value < 1e300


def _positive(label: str, value: Any) -> float:
    if not _is_number(value) or value <= 0:
        raise AddonError(f"{label}: expected a number above 0, got {value!r}")
    return float(value)


def _fps(label: str, value: Any) -> float:
    if not _is_number(value) or not _FPS[0] <= value <= _FPS[1]:
        raise AddonError(f"{label}: expected a number from {_FPS[0]} to {_FPS[1]}, got {value!r}")
    return float(value)


def _frame_range(label: str, value: Any) -> tuple[int, int]:
    parts = value
    if isinstance(value, str):
        match = re.fullmatch(r"(-?[0-9]{1,9}):(-?[0-9]{1,9})", value)
        parts = [int(part) for part in match.groups()] if match else None
    if not isinstance(parts, list) or len(parts) != 2 or {type(part) for part in parts} != {int}:
        raise AddonError(f"{label}: expected FIRST:LAST, got {value!r:.60}")
    first, last = parts
    if last <= first:
        raise AddonError(f"{label}: expected FIRST < LAST, got {value!r:.60}")
    if first < 0 or last > _LAST_FRAME:
        raise AddonError(f"{label}: expected frames of 0 to {_LAST_FRAME}, got {value!r:.60}")
    return first, last


def _bounds(label: str, value: Any) -> tuple[tuple[float, ...], ...]:
    if not isinstance(value, (list, tuple)) or len(value) != 2:
        raise AddonError(f"{label}: expected [[x, y, z], [x, y, z]], got {value!r}")
    low, high = (_numbers(label, row, 3) for row in value)
    if any(b <= a for a, b in zip(low, high, strict=True)):
        raise AddonError(f"{label}: expected the lower corner first, got {value!r}")
    return low, high


def _patterns(label: str, value: Any) -> tuple[str, ...]:
    rows = [value] if isinstance(value, str) else value
    if not isinstance(rows, list) or not all(isinstance(row, str) and row for row in rows):
        raise AddonError(f"{label}: expected names or patterns of objects, got {value!r}")
    return tuple(rows)


def _record(label: str, value: Any, known: list[str]) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise AddonError(f"{label}: expected the keys {', '.join(known)}, got {value!r}")
    _refuse_unknown(label, value, known)
    return value


def _radio_material(label: str, value: Any) -> RadioMaterial:
    known = [row.name for row in fields(RadioMaterial)]
    row = _record(label, {"radio_material": value} if isinstance(value, str) else value, known)
    name = row.get("radio_material")
    if name not in MATERIALS:
        raise AddonError(f"{label}: unknown radio material {name!r}{closest(str(name), MATERIALS)}")
    share = row.get("scattering_coefficient", 0.0)
    if not _is_number(share) or not 0 <= share <= 1:
        raise AddonError(f"{label}: scattering_coefficient: expected 0 to 1, got {share!r}")
    thickness_m = row.get("thickness_m", 0.0)
    if thickness_m != 0.0:
        thickness_m = _positive(f"{label}: thickness_m", thickness_m)
    return RadioMaterial(name, thickness_m, float(share))


def _materials(label: str, value: Any) -> dict[str, RadioMaterial]:
    if not isinstance(value, dict):
        raise AddonError(f"{label}: expected PATTERN: MATERIAL, got {value!r}")
    return {str(name): _radio_material(f"{label}: {name}", row) for name, row in value.items()}


def _ring(label: str, value: Any) -> Ring:
    known = [row.name for row in fields(Ring)]
    row = _record(label, {"ring": value} if isinstance(value, int) else value, known)
    count = row.get("ring")
    if not isinstance(count, int) or isinstance(count, bool) or not 1 <= count <= 99:
        raise AddonError(f"{label}: ring: expected 1 to 99 cameras, got {count!r}")
    sizes = {key: _positive(f"{label}: {key}", row[key]) for key in row if key != "ring"}
    if sizes.get("fov_deg", 60.0) >= 170:
        raise AddonError(f"{label}: fov_deg: expected less than 170, got {sizes['fov_deg']:g}")
    return Ring(count, **sizes)


def _room(label: str, value: Any) -> Room | None:
    if value in ("none", None):
        return None
    known = [row.name for row in fields(Room)]
    if isinstance(value, str) and value != "box":
        raise AddonError(f"{label}: expected none, box or {', '.join(known)}, got {value!r}")
    row = _record(label, {} if value == "box" else value, known)
    material = _radio_material(f"{label}: material", row.get("material", "plasterboard"))
    size = _numbers(f"{label}: size_m", row["size_m"], 3) if "size_m" in row else None
    if size and min(size) <= 0:
        raise AddonError(f"{label}: size_m: expected numbers above 0, got {row['size_m']!r}")
    return Room(material.radio_material, size)


def _devices(label: str, value: Any) -> tuple[dict[str, Any], ...]:
    if not isinstance(value, list) or not value:
        raise AddonError(f"{label}: expected a list of devices, got {value!r}")
    rows = [_device(f"{label}[{index}]", row, index) for index, row in enumerate(value)]
    names = [row["name"] for row in rows]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise AddonError(f"{label}: two devices are named {twice[0]!r}")
    return tuple(rows)


def _device(label: str, value: Any, index: int) -> dict[str, Any]:
    known = ["name", "radio", "role", "position_m", "look_at_m", "quat_wxyz"]
    row = _record(label, value, known)
    # Radios may come from files of the user's own, so their names are not checked here.
    radio, role = str(row.get("radio", "any")), row.get("role", "ACCESS_POINT")
    if str(role).upper() not in _ROLES:
        raise AddonError(f"{label}: unknown role {role!r}{closest(str(role).upper(), _ROLES)}")
    if "position_m" not in row:
        raise AddonError(f"{label}: position_m is missing; expected [x, y, z]")
    place = _numbers(f"{label}: position_m", row["position_m"], 3)
    turn = (1.0, 0.0, 0.0, 0.0)
    if "quat_wxyz" in row:
        turn = _numbers(f"{label}: quat_wxyz", row["quat_wxyz"], 4)
        length = float(np.linalg.norm(turn))
        if length < 1e-6:
            raise AddonError(f"{label}: quat_wxyz: expected a rotation, got {row['quat_wxyz']!r}")
        turn = tuple(item / length for item in turn)
    elif "look_at_m" in row:
        turn = boresight(place, _numbers(f"{label}: look_at_m", row["look_at_m"], 3))
    return {
        "name": str(row.get("name", f"device_{index}")),
        "radio": radio,
        "role": str(role).upper(),
        "position_m": list(place),
        "quat_wxyz": list(turn),
    }


def boresight(place: tuple[float, ...], target: tuple[float, ...]) -> tuple[float, ...]:
    """Turn (w, x, y, z) that points local +X from `place` to `target` with local +Y level."""
    along = np.subtract(target, place)
    yaw = np.arctan2(along[1], along[0])
    pitch = -np.arctan2(along[2], np.hypot(along[0], along[1]))
    cy, sy, cp, sp = np.cos(yaw / 2), np.sin(yaw / 2), np.cos(pitch / 2), np.sin(pitch / 2)
    return float(cy * cp), float(-sy * sp), float(cy * sp), float(sy * cp)


_READERS: dict[str, Callable[[str, Any], Any]] = {
    "frame_range": _frame_range,
    "fps": _fps,
    "unit_scale": _positive,
    "bounds_m": _bounds,
    "drop": _patterns,
    "people": _patterns,
    "vehicles": _patterns,
    "moving": _patterns,
    "materials": _materials,
    "object_materials": _materials,
    "cameras": _ring,
    "devices": _devices,
    "room": _room,
}
