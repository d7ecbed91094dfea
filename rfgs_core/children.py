# SPDX-License-Identifier: Apache-2.0
"""Child processes that never outlive the command that began them."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from pathlib import Path

#: `prctl` option: signal sent to a process when its parent is gone (Linux, prctl(2)).
_PARENT_DEATH_SIGNAL = 1

_LIBC = ctypes.CDLL(None) if sys.platform == "linux" else None

_SOURCE = Path(__file__).resolve().parents[1]


def end_with_parent() -> None:
    """Runs in a child before its program starts.

    Without it a Blender whose command was killed would go on writing into the folder that the
    next run uses. Elsewhere than on Linux nothing happens; a worker's closed input ends it.
    """
    if _LIBC is not None:
        _LIBC.prctl(_PARENT_DEATH_SIGNAL, signal.SIGKILL)


def child_environment(**more: str) -> dict[str, str]:
    """The environment of a child that can import the packages beside this one."""
    path = os.pathsep.join(filter(None, [str(_SOURCE), os.environ.get("PYTHONPATH")]))
    return {**os.environ, **more, "PYTHONPATH": path}
