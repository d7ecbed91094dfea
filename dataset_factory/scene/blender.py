# SPDX-License-Identifier: Apache-2.0
"""Drives the add-on in a Blender of its own: pip's `bpy`, or a real Blender."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from tqdm import tqdm

from rfgs_core.children import child_environment, end_with_parent
from rfgs_core.errors import MissingToolError, RfgsError

Progress = Callable[[int, int], None]

_PROGRESS = re.compile(r"progress (\d+) (\d+)")
#: Begins what the add-on wants its user to know.
_NOTE = "note: "


@dataclass(frozen=True)
class Blender:
    """One Blender file and the program that opens it."""

    blend: Path
    """The Blender file; never changed."""
    program: Path | None = None
    """A real Blender with the add-on enabled; None takes $BLENDER, else pip's `bpy`."""

    def command(self, name: str, *arguments: str) -> list[str]:
        """The command line of one of the add-on's commands."""
        program = self.program or os.environ.get("BLENDER")
        if not program:
            start = [sys.executable, "-m", "addon_rfgs", "--blend", str(self.blend)]
            return [*start, name, *arguments]
        start = [str(program), "-b", str(self.blend), "--disable-autoexec"]
        return [*start, "--command", "rfgs", name, *arguments]

    def run(self, name: str, *arguments: str, progress: Progress | None = None) -> None:
        """Runs one of the add-on's commands to its end; what it notes goes to standard error.

        Args:
            name: `check`, `export` or `groundtruth`.
            *arguments: Its arguments.
            progress: Called with done and total after each picture.

        Raises:
            MissingToolError: There is no such Blender, or it lacks the add-on.
            RfgsError: The command failed; the message is the add-on's own.
        """
        with tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace") as log:
            process = self._start(self.command(name, *arguments), log)
            said: list[str] = []
            try:
                assert process.stdout is not None
                for line in process.stdout:
                    match = _PROGRESS.match(line)
                    if match and progress:
                        progress(int(match[1]), int(match[2]))
                    elif line.startswith(_NOTE):
                        # A bar may stand on the last line.
                        tqdm.write(line, file=sys.stderr, end="")
                    elif not match:
                        said = [*said[-19:], line]
                code = process.wait()
            finally:
                # Also reached by Ctrl-C: Blender must not go on writing behind our back.
                if process.poll() is None:
                    process.terminate()
                    process.wait()
            if code:
                log.seek(0)
                raise _failure(name, code, [*said, *log.read().splitlines()[-40:]])

    def _start(self, command: list[str], log: object) -> subprocess.Popen[str]:
        try:
            return subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=log,  # type: ignore[arg-type]
                text=True,
                errors="replace",
                env=child_environment(),
                start_new_session=True,
                preexec_fn=end_with_parent,
            )
        except (FileNotFoundError, PermissionError) as error:
            raise MissingToolError(
                f"{command[0]}: no such program; --blender and $BLENDER expect the Blender program"
            ) from error


def _failure(name: str, code: int, lines: list[str]) -> RfgsError:
    text = [line.strip() for line in lines if line.strip()]
    if any("nrecognized command" in line for line in text):
        return MissingToolError(
            "this Blender does not know the command 'rfgs'; install and enable the extension "
            "addon_rfgs in it, or leave --blender and $BLENDER away to use pip's bpy"
        )
    if any("No module named 'bpy'" in line for line in text):
        return MissingToolError(
            "bpy is not installed; run: pip install 'rfgs[blender]' (Python 3.11), or give "
            "--blender PROGRAM"
        )
    errors = [line for line in text if line.lower().startswith("error:")]
    reason = errors[-1][6:].strip() if errors else (text[-1] if text else "it said nothing")
    if "No space left" in reason or "disk is full" in reason:
        return RfgsError("the disk is full; free some space and run the same command again")
    return RfgsError(reason if errors else f"Blender's {name} stopped with code {code}: {reason}")
