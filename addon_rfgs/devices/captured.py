# SPDX-License-Identifier: GPL-3.0-or-later
"""Captures of real radios as a dataset, made by `rfgs import`, and their devices as Empties."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import bpy

from ..command import Command
from ..errors import AddonError
from ..jobs.preferences import InEnvironment
from ..jobs.progress import reason, split_output
from ..jobs.question import Question
from ..path_options import path_setting
from ..paths.dataset import read_sequence
from ..reporting import Progress, Undoable, chosen_path
from .recorded import FORM, add_recorded

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
