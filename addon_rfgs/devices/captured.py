# SPDX-License-Identifier: GPL-3.0-or-later
"""Captures of real radios as a dataset, made by `rfgs import`, and their devices as Empties."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import bpy
import mathutils
import numpy as np

from ..command import Command
from ..errors import AddonError
from ..jobs.preferences import InEnvironment
from ..jobs.progress import reason, split_output
from ..jobs.question import Question
from ..json_file import Fields
from ..path_options import path_setting
from ..paths.dataset import read_sequence
from ..reporting import Progress, Undoable, chosen_path
from ..tables import RADIO_CHOICES, RADIO_DEFAULTS, RADIO_FIELDS
from . import empties

#: Devices beyond which a dataset is taken for damaged.
_MOST_DEVICES = 2000
#: Devices farther out than this are taken for damaged [m].
_FARTHEST_M = 1e6
_ROLES = ("ACCESS_POINT", "TRANSMITTER", "RECEIVER")
#: What devices need of `sequence.json`.
_POSED = Fields({"name": str, "position_m": [float], "quat_wxyz": [float]}, {"role": str})
FORM = Fields({"radios": {str: {str: object}}, "devices": {str: [_POSED]}})


class RFGS_OT_import_devices(Undoable, bpy.types.Operator):
    """Add the radio devices of a dataset, also of one that `rfgs import` made of real captures.

    They stand where the dataset has them, each with the band and arrays of its radio
    """

    bl_label = "Import Devices"
    command = Command(
        "devices import", words={"directory": "dataset"}, needs=("directory",), saves=True
    )

    directory: path_setting("Dataset", "Folder of a dataset, or of one of its sequences")
    radio: bpy.props.StringProperty(
        name="Radio",
        description="Which radio of the dataset; empty takes all",
        options={"SKIP_SAVE"},
    )

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[Any]:
        """Asks for the folder."""
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def work(self, context: bpy.types.Context, _progress: Progress) -> str:
        """Adds an Empty for each device."""
        folder, info = read_sequence(chosen_path(self.directory), FORM)
        count, radios = add_recorded(context.scene, folder, info, self.radio)
        return f"Added {count} devices of {', '.join(radios)}"


def add_recorded(
    scene: bpy.types.Scene, folder: Path, info: dict[str, Any], radio: str
) -> tuple[int, list[str]]:
    """Adds an Empty for each device of a sequence; see `recorded_devices`.

    Returns:
        How many there are, and of which radios.
    """
    rows = recorded_devices(folder, info, radio)
    for name, role, label, pose, fields in rows:
        empties.add_device(scene, name, role, label, pose, fields)
    return len(rows), list(dict.fromkeys(row[2] for row in rows))


def recorded_devices(
    folder: Path, info: dict[str, Any], radio: str
) -> list[tuple[str, str, str, np.ndarray, dict[str, Any]]]:
    """Name, role, radio, pose [4, 4] in metres and fields of a sequence's devices.

    An empty `radio` takes all.

    Raises:
        AddonError: There is no such radio, or a device's pose or role makes no sense.
    """
    radios, devices = info["radios"], info["devices"]
    if radio and radio not in devices:
        raise AddonError(f"{folder}: no radio {radio!r}; it has {', '.join(devices)}")
    chosen = {name: rows for name, rows in devices.items() if radio in ("", name)}
    count = sum(map(len, chosen.values()))
    if not 0 < count <= _MOST_DEVICES:
        raise AddonError(f"{folder}: {count} devices, expected 1 to {_MOST_DEVICES}")
    return [
        (
            *_device(folder, row),
            _label(name, radios.get(name, {})),
            *_placed(folder, row, radios, name),
        )
        for name, rows in chosen.items()
        for row in rows
    ]


def _device(folder: Path, row: dict[str, Any]) -> tuple[str, str]:
    """Name and role."""
    role = row.get("role", _ROLES[0])
    if role not in _ROLES:
        raise AddonError(f"{folder}: role: expected {' or '.join(_ROLES)}, found {role[:60]!r}")
    return row["name"][:60], role


def _label(name: str, fields: dict[str, Any]) -> str:
    """Radio that an Empty carries: a preset's name only where the fields are the preset's."""
    if name not in RADIO_FIELDS:
        return name
    own = {key: _plain(value) for key, value in fields.items()}
    same = all(own.get(key) == _plain(value) for key, value in RADIO_FIELDS[name].items())
    return name if same else "scene"


def _placed(
    folder: Path, row: dict[str, Any], radios: dict[str, dict[str, Any]], name: str
) -> tuple[np.ndarray, dict[str, Any]]:
    """Pose [4, 4] in metres, and the fields that Empties can hold."""
    place, turn = np.array(row["position_m"], float), np.array(row["quat_wxyz"], float)
    if place.shape != (3,) or turn.shape != (4,) or max(np.abs([*place, *turn])) > _FARTHEST_M:
        raise AddonError(f"{folder}: device {row['name'][:60]!r}: damaged pose")
    if not turn.any():
        raise AddonError(f"{folder}: device {row['name'][:60]!r}: a turn of zeros")
    pose = np.eye(4)
    pose[:3, :3] = np.array(mathutils.Quaternion(turn).normalized().to_matrix())
    pose[:3, 3] = place
    fields = {
        key: value
        for key, value in radios.get(name, {}).items()
        if key in RADIO_DEFAULTS and _fits(key, value)
    }
    return pose, fields


def _fits(key: str, value: Any) -> bool:
    """Whether a field can be set: of a choice one of its values, else of the default's type."""
    default = RADIO_DEFAULTS[key]
    if key in RADIO_CHOICES:
        return value in RADIO_CHOICES[key]
    if isinstance(default, (list, tuple)):
        fits = isinstance(value, list) and len(value) == len(default)
        return fits and all(map(_is_number, value))
    return _is_number(value)


def _is_number(value: Any) -> bool:
    """Whether it is a number that Blender can hold; it has whole ones of 32 bits."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return False
    return isinstance(value, float) or abs(value) < 2**31


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value


#: The largest capture that `rfgs import` takes is read within this [s].
_PATIENCE_S = 600.0


class RFGS_OT_import_capture(InEnvironment, Undoable, bpy.types.Operator):
    """Make a dataset of what real radios recorded, and add their devices where the layout says.

    Blender waits meanwhile
    """

    bl_label = "Import Capture"
    command = Command(
        "devices capture",
        words={"captures": "captures"},
        needs=("captures",),
        repeated=("captures",),
        saves=True,
    )

    captures: bpy.props.StringProperty(
        name="Captures",
        description="Files of the receiving devices in the order of the layout, commas between; "
        "empty: those chosen in the file browser",
        options={"SKIP_SAVE"},
    )
    layout: path_setting(
        "Layout",
        "Where the radios stood, as YAML; captures that tell it themselves need none",
        kind="FILE_PATH",
    )
    dataset: path_setting(
        "Dataset", "Folder of the dataset to make, which must not be there yet", "//rfgs_capture"
    )
    sanitize: bpy.props.BoolProperty(
        name="Sanitize",
        description="Clean each packet first: packets of most Wi-Fi cards share no phase",
    )
    directory: bpy.props.StringProperty(subtype="DIR_PATH", options={"HIDDEN", "SKIP_SAVE"})
    files: bpy.props.CollectionProperty(
        type=bpy.types.OperatorFileListElement, options={"HIDDEN", "SKIP_SAVE"}
    )

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[Any]:
        """Asks for the files; the rest stands beside them."""
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def work(self, context: bpy.types.Context, _progress: Progress) -> str:
        """Imports, then adds an Empty for each device."""
        dataset = chosen_path(self.dataset).absolute()
        told = imported(self.interpreter(), self._paths(), self._layout(), dataset, self.sanitize)
        folder, info = read_sequence(dataset, FORM)
        count, radios = add_recorded(context.scene, folder, info, "")
        # What is trained on next.
        context.scene.rfgs.jobs.dataset_folder = str(dataset)
        context.scene.rfgs.jobs.train_radio = next(iter(info["devices"]))
        return f"Added {count} devices of {', '.join(radios)}; {told}"

    def _paths(self) -> list[Path]:
        names = [name.strip() for name in self.captures.split(",") if name.strip()]
        if not names:
            names = [os.path.join(self.directory, item.name) for item in self.files if item.name]
        if not names:
            raise AddonError("no capture is chosen; choose the files that the radios wrote")
        return [chosen_path(name).absolute() for name in names]

    def _layout(self) -> Path | None:
        return chosen_path(self.layout).absolute() if self.layout else None


def imported(
    python: Path, captures: list[Path], layout: Path | None, dataset: Path, sanitize: bool
) -> str:
    """Runs `rfgs import` and waits for it.

    Args:
        python: The environment's Python.
        captures: Files, one for each receiving device.
        layout: Where the radios stood; None if the captures tell it.
        dataset: Folder to make.
        sanitize: Whether packets are cleaned first.

    Returns:
        What is in the dataset, in one line.

    Raises:
        AddonError: It refused; the message is its own.
    """
    command = [str(python), "-m", "rfgs_core.cli", "import", *map(str, captures)]
    command += [f"--out={dataset}"]
    command += [f"--layout={layout}"] if layout else []
    question = Question([*command, "--sanitize"] if sanitize else command, _PATIENCE_S)
    question.wait()
    _, lines = split_output(question.answer)
    if question.code is None:
        raise AddonError(f"no dataset after {_PATIENCE_S:.0f} s; make it with `rfgs import`")
    if question.code:
        raise AddonError(reason(lines) or "rfgs import said nothing")
    return lines[-1].partition("; next:")[0] if lines else str(dataset)
