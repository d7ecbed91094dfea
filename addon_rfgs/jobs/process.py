# SPDX-License-Identifier: GPL-3.0-or-later
"""A program in a process group of its own, which outlives Blender and can be found again."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

from ..errors import AddonError
from .environment import child_environment

#: Whether programs can be told to outlive Blender here, and be found again by the next one.
SUPPORTED = os.name == "posix"


def need_support() -> None:
    """Refuses jobs where they cannot be run.

    Raises:
        AddonError: This is Windows.
    """
    if not SUPPORTED:
        raise AddonError("jobs need Linux or macOS; on Windows run rfgs-factory and rfgs in WSL")


class Process:
    """A running program; one that an earlier Blender started can be followed, too."""

    def __init__(self, pid: int, born: str, child: subprocess.Popen[bytes] | None = None) -> None:
        self.pid, self.born = pid, born
        self._child = child

    @classmethod
    def start(cls, arguments: list[str], log: Path) -> Process:
        """Starts a program.

        Args:
            arguments: Its path and arguments; no shell reads them.
            log: Takes what it writes; begun anew.

        Raises:
            AddonError: It cannot be started.
        """
        try:
            log.parent.mkdir(parents=True, exist_ok=True)
            with log.open("wb") as stream:
                child = subprocess.Popen(
                    arguments,
                    stdin=subprocess.DEVNULL,
                    stdout=stream,
                    stderr=subprocess.STDOUT,
                    env=child_environment(),
                    start_new_session=True,
                )
        except OSError as error:
            place = error.filename or arguments[0]
            raise AddonError(f"the job cannot be started: {place}: {error.strerror}") from error
        return cls(child.pid, birth(child.pid), child)

    def running(self) -> bool:
        """Whether it is still there."""
        if self._child is not None:
            return self._child.poll() is None
        return bool(self.born) and birth(self.pid) == self.born

    @property
    def code(self) -> int | None:
        """Exit code; None while it runs, or if another Blender started it."""
        return self._child.poll() if self._child is not None else None

    def interrupt(self) -> None:
        """Asks it to stop, as Ctrl-C does; finished work stays."""
        self._signal(signal.SIGINT)

    def kill(self) -> None:
        """Ends it at once with all of its group; what is half-written is redone by a resume."""
        self._signal(signal.SIGKILL)

    def _signal(self, number: int) -> None:
        if not self.running():
            return
        # Between the look and the signal it may end by itself, which is what was asked for.
        with suppress(ProcessLookupError, PermissionError):
            # Children that must not outlive the program watch over that themselves.
            if number == signal.SIGKILL:
                os.killpg(self.pid, number)
            else:
                os.kill(self.pid, number)


def birth(pid: int) -> str:
    """When a process began, to tell it from a later one of the same number; empty if gone.

    On Linux with the number that the system drew when it was started, which only programs that run
    here know: a job's record from elsewhere cannot name one of this machine's processes.
    """
    if not SUPPORTED:
        return ""
    if sys.platform == "linux":
        try:
            here = Path("/proc/sys/kernel/random/boot_id").read_text("utf-8").strip()
            # After the program's name in brackets: state, and 19 fields on the start (proc(5)).
            fields = Path(f"/proc/{pid}/stat").read_text("utf-8", "replace").rpartition(")")[2]
        except OSError:
            return ""
        state, *rest = fields.split()
        return "" if state in "ZX" else f"{rest[18]} {here}"
    answer = subprocess.run(
        ["ps", "-o", "lstart=", "-p", str(pid)], capture_output=True, text=True, check=False
    )
    return answer.stdout.strip()
