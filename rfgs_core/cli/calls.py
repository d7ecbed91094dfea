# SPDX-License-Identifier: Apache-2.0
"""Runs our own commands as programs of their own, each with its own imports and threads."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from rfgs_core.errors import RfgsError


def call(*command: str | Path) -> None:
    """Runs one of our own modules with this Python; its error line has been printed.

    Raises:
        RfgsError: It failed.
        KeyboardInterrupt: The user stopped it.
    """
    arguments = [sys.executable, "-m", *map(str, command)]
    code = subprocess.run(arguments, check=False).returncode
    if code == 130:
        raise KeyboardInterrupt
    if code:
        raise RfgsError(f"`python -m {' '.join(map(str, command))}` failed (exit code {code})")
