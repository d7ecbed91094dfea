# SPDX-License-Identifier: GPL-3.0-or-later
"""What the log of a job says: how far it is, and its last lines."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from ..errors import AddonError
from ..files import refuse_pipe

#: How much of a log's end is read [bytes].
_TAIL = 16_384
_LINE = re.compile(r"progress ([\d.]+) ([\d.]+) (\d+) ?(.*)")
#: Control sequences of terminals: nested bars move the cursor.
_CONTROL = re.compile(r"\x1b\[[0-9;]*[A-Za-z]")


@dataclass(frozen=True)
class Progress:
    """How far the stage of a job is."""

    stage: str
    done: float
    total: float
    left_s: float
    """Time until the end of the stage [s], 0 while nobody knows."""

    @property
    def share(self) -> float:
        """From 0 to 1."""
        return min(self.done / self.total, 1.0) if self.total else 0.0

    def __str__(self) -> str:
        text = f"{self.stage} {self.done:g}/{self.total:g}"
        if self.left_s and self.done < self.total:
            minutes, seconds = divmod(round(self.left_s), 60)
            text += f", {minutes}:{seconds:02d} left"
        return text


def read_log(file: Path, count: int = 8) -> tuple[Progress | None, list[str]]:
    """How far a job is, and the last lines that are not about that.

    Args:
        file: Its log; there may be none.
        count: How many lines.
    """
    try:
        refuse_pipe(file)
        with file.open("rb") as stream:
            stream.seek(0, 2)
            stream.seek(max(0, stream.tell() - _TAIL))
            text = stream.read(_TAIL).decode("utf-8", "replace")
    except (AddonError, OSError):
        return None, []
    progress, lines = split_output(text)
    return progress, lines[-count:]


def split_output(text: str) -> tuple[Progress | None, list[str]]:
    """How far a program is, and the lines it wrote that are not about that."""
    progress, lines = None, []
    for line in re.split(r"[\r\n]+", _CONTROL.sub("", text)):
        match = _LINE.fullmatch(line.strip())
        if match:
            done, total, left_s = (float(match[i]) for i in (1, 2, 3))
            progress = Progress(match[4].rstrip(": ") or "working", done, total, left_s)
        elif line.strip() and not line.startswith("progress "):
            lines.append(line.rstrip())
    return progress, lines


def reason(lines: list[str]) -> str:
    """The line in which a program says why it failed; empty if it said nothing."""
    told = [line for line in lines if line.startswith("error:")] or lines
    return told[-1].removeprefix("error: ") if told else ""
