# SPDX-License-Identifier: GPL-3.0-or-later
"""Lets `rfgs csi` draw the channels of a link, outside of Blender."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import bpy

from ..errors import AddonError
from ..jobs.progress import reason, split_output
from ..jobs.question import Question
from ..reporting import chosen_path

#: Every frame is predicted; a long sequence on slow cores takes minutes [s].
_PATIENCE_S = 600.0


@dataclass(frozen=True)
class Drawing:
    """A picture that is being made."""

    out: Path
    """Its file."""
    question: Question
    """The program that draws it."""

    def outcome(self) -> str:
        """What the program told of the link, in one line, once it is over.

        Raises:
            AddonError: There is no picture; the message is the program's own.
        """
        _, lines = split_output(self.question.answer)
        if self.question.code is None:
            raise AddonError(f"no picture after {_PATIENCE_S:.0f} s; draw it with `rfgs csi`")
        if self.question.code:
            raise AddonError(reason(lines) or "rfgs csi said nothing")
        return lines[-1].removeprefix(f"{self.out}: ") if lines else "drawn"


def begin(scene: bpy.types.Scene, python: Path, out: Path | None = None) -> Drawing:
    """Starts to draw the link that the scene's settings name.

    Args:
        scene: Whose settings.
        python: The environment's Python.
        out: PNG to write; without it, one in the run's `predictions/`.

    Raises:
        AddonError: No run is chosen, or the program cannot be started.
    """
    said = scene.rfgs.channels
    folder = said.run_folder or scene.rfgs.gaussians.path
    if not folder:
        raise AddonError("no run is chosen; set the folder of a training under Channels › Run")
    run = chosen_path(folder).absolute()
    ends, name = [f"--tx-device={said.tx_device}"], f"link_{said.tx_device}"
    if said.rx_device >= 0:
        ends.append(f"--rx-device={said.rx_device}")
        name += f"_{said.rx_device}"
    out = out or run / "predictions" / f"{name}.png"
    command = [str(python), "-m", "rfgs_core.cli", "csi", str(run), *ends, f"--out={out}"]
    return Drawing(out, Question(command, _PATIENCE_S))
