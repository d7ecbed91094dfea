# SPDX-License-Identifier: GPL-3.0-or-later
"""What a dataset tells of its traced paths; a twin of the reader in `rfgs_core.dataset`."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..array_file import array_file
from ..errors import AddonError
from ..json_file import Fields, read_json

#: What happens at a corner: code → name, those of Sionna RT and of `rfgs_core.radio.images`.
INTERACTIONS = {1: "specular", 2: "diffuse", 4: "refraction", 8: "diffraction", 16: "scattering"}

#: Largest `sequence.json` that is read [bytes].
_LARGEST_JSON = 64_000_000
_LAST_FRAME = 1_048_574
_NAME = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9_.-]{0,199}")
#: What paths need of `sequence.json`.
_FORM = Fields(
    {"frames": [int], "devices": {str: [Fields({"name": str})]}},
    {"objects": [Fields({"id": int, "name": str})]},
)
#: Axis → its greatest length; a table within them takes less than 2 GB.
_MOST = {"path": 2_000_000, "port": 16, "node": 512, "bounce": 14, "corner": 16, "xyz": 3}
_MOST_BYTES = 2_000_000_000
#: Array → type and axes; others of the file are not read.
_ARRAYS = {
    "tx_device": ("<i4", ("path",)),
    "rx_device": ("<i4", ("path",)),
    "delay_s": ("<f8", ("path",)),
    "node_hz": ("<f8", ("node",)),
    "amplitude": ("<c8", ("path", "port", "node")),
    "kind": ("|u1", ("path", "bounce")),
    "object": ("<i4", ("path", "bounce")),
    "vertices": ("<f4", ("path", "corner", "xyz")),
}


@dataclass(frozen=True)
class PathDataset:
    """A sequence of a dataset, as far as paths go."""

    folder: Path
    frames: list[int]
    devices: dict[str, list[str]]
    """Radio → names of its devices, in the order of their numbers."""
    objects: dict[int, str]
    """Number → name of what paths can meet."""

    def device(self, radio: str, number: int) -> str:
        """Name of a device."""
        names = self.devices[radio]
        return names[number] if 0 <= number < len(names) else f"device {number}"


@dataclass(frozen=True)
class Paths:
    """Paths of one frame, strongest first."""

    tx_device: np.ndarray
    rx_device: np.ndarray
    power_db: np.ndarray
    """Power of the amplitudes at the band's centre, summed over pairs of ports [dB]."""
    delay_s: np.ndarray
    kind: np.ndarray
    """Codes of `INTERACTIONS` at each corner, [path, bounce], 0 beyond the last."""
    object: np.ndarray
    vertices: np.ndarray
    """Corners from transmitter to receiver [m], [path, corner, 3], padded with the receiver."""

    def __len__(self) -> int:
        return len(self.power_db)

    def select(self, keep: np.ndarray) -> Paths:
        """The paths of a mask or of indices."""
        return Paths(**{name: values[keep] for name, values in vars(self).items()})

    def interactions(self, path: int) -> str:
        """What a path meets, as in `specular+scattering`; a straight one is `line of sight`."""
        names = [INTERACTIONS.get(int(code), str(code)) for code in self.kind[path] if code]
        return "+".join(names) or "line of sight"

    def corners(self, path: int) -> np.ndarray:
        """Corners of one path without the padding [m], [corner, 3]."""
        return self.vertices[path, : int((self.kind[path] != 0).sum()) + 2]


def open_path_dataset(folder: Path) -> PathDataset:
    """Reads what a dataset says of itself.

    Args:
        folder: The dataset, or one of its sequences.

    Raises:
        AddonError: There is none, or it is damaged.
    """
    found, info = read_sequence(folder, _FORM)
    file = found / "sequence.json"
    if not all(0 <= frame <= _LAST_FRAME for frame in info["frames"]):
        raise AddonError(f"{file}: expected frames from 0 to {_LAST_FRAME}; make the dataset anew")
    return PathDataset(
        found,
        info["frames"],
        {radio: [row["name"] for row in rows] for radio, rows in info["devices"].items()},
        {row["id"]: row["name"] for row in info.get("objects", [])},
    )


def read_sequence(folder: Path, form: Fields) -> tuple[Path, dict[str, Any]]:
    """Folder of a dataset's only sequence, and what its `sequence.json` holds.

    Args:
        folder: The dataset, or one of its sequences.
        form: What is read of that; its field `devices` names radios.

    Raises:
        AddonError: There is none or several, or it is not of that form.
    """
    found = [folder] if (folder / "sequence.json").is_file() else []
    found = found or sorted(file.parent for file in folder.glob("*/sequence.json"))
    if not found:
        raise AddonError(f"{folder}: no dataset there; expected a folder made by Generate Dataset")
    if len(found) > 1:
        names = ", ".join(path.name for path in found)
        raise AddonError(f"{folder}: several sequences; choose the folder of one: {names}")
    file = found[0] / "sequence.json"
    info = read_json(file, form, "make the dataset anew", _LARGEST_JSON)
    # A radio's name is that of a folder, too.
    strange = next((name for name in info["devices"] if not _NAME.fullmatch(name)), None)
    if strange is not None:
        raise AddonError(f"{file}: {strange[:60]!r} is no name of a radio; make the dataset anew")
    return found[0], info


def recorded_frames(dataset: PathDataset, radio: str) -> list[int]:
    """Frames with a path table.

    Raises:
        AddonError: There is no such radio, or it has no table.
    """
    _need_radio(dataset, radio)
    found = [frame for frame in sorted(dataset.frames) if _file(dataset, radio, frame).is_file()]
    if not found:
        folder = dataset.folder / "radio" / radio / "paths"
        raise AddonError(f"{folder}: no path table; generate the dataset with ray paths")
    return found


def read_paths(dataset: PathDataset, radio: str, frame: int | None) -> Paths:
    """The paths of a frame, strongest first.

    Args:
        dataset: From `open_path_dataset`.
        radio: One of its radios.
        frame: Frame number; None is the scene without anything that moves.

    Raises:
        AddonError: There is no such radio or frame, no table, or a damaged one.
    """
    _need_radio(dataset, radio)
    if frame is not None and frame not in dataset.frames:
        first, last = min(dataset.frames, default=0), max(dataset.frames, default=0)
        raise AddonError(
            f"{dataset.folder}: no frame {frame}; it has {len(dataset.frames)} of {first} to {last}"
        )
    file = _file(dataset, radio, frame)
    if not file.is_file():
        raise AddonError(f"{file}: no path table; generate the dataset with ray paths")
    return _table(file)


def _need_radio(dataset: PathDataset, radio: str) -> None:
    if radio not in dataset.devices:
        raise AddonError(
            f"{dataset.folder}: no radio {radio!r}; it has {', '.join(dataset.devices)}"
        )


def _file(dataset: PathDataset, radio: str, frame: int | None) -> Path:
    name = "static" if frame is None else f"{frame:06d}"
    return dataset.folder / "radio" / radio / "paths" / f"{name}.npz"


def _table(file: Path) -> Paths:
    sizes: dict[str, int] = {}
    with array_file(file) as arrays:
        rows = {
            name: arrays.read(name, lambda *found, name=name: _check(file, name, sizes, *found))
            for name in _ARRAYS
        }
    if sizes["corner"] != sizes["bounce"] + 2 or not sizes["node"]:
        raise AddonError(f"{file}: {sizes['corner']} corners for {sizes['bounce']} bounces")
    centre = rows["amplitude"][:, :, sizes["node"] // 2]
    power = (np.abs(centre).astype(np.float64) ** 2).sum(axis=1)
    if not all(np.isfinite(values).all() for values in (power, rows["vertices"], rows["delay_s"])):
        raise AddonError(f"{file}: holds numbers that are not finite; make the dataset anew")
    table = Paths(
        power_db=10 * np.log10(np.maximum(power, 1e-30)),
        **{key: rows[key] for key in ("tx_device", "rx_device", "delay_s")},
        **{key: rows[key] for key in ("kind", "object", "vertices")},
    )
    return table.select(np.argsort(-table.power_db, kind="stable"))


def _check(
    file: Path, name: str, sizes: dict[str, int], shape: tuple[int, ...], dtype: np.dtype
) -> None:
    """Allows an array of the right type whose axes agree with those before it."""
    expected, axes = _ARRAYS[name]
    if dtype.str != expected:
        raise AddonError(f"{file}: {name} holds {dtype}, expected {np.dtype(expected)}")
    agrees = len(shape) == len(axes) and all(
        size <= _MOST[axis] and sizes.setdefault(axis, size) == size
        for axis, size in zip(axes, shape, strict=True)
    )
    if not agrees or (axes[-1] == "xyz" and shape[-1] != 3):
        raise AddonError(f"{file}: {name} has shape {list(shape)}, expected {list(axes)}")
    if int(np.prod(shape, dtype=np.int64)) * dtype.itemsize > _MOST_BYTES:
        raise AddonError(f"{file}: {name} has shape {list(shape)}, which is too large to show")
