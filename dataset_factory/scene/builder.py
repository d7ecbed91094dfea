# SPDX-License-Identifier: Apache-2.0
"""Has `python -m blender_scenes` build a scene, in a process of its own with pip's bpy."""

from __future__ import annotations

import subprocess
import sys

from rfgs_core.children import child_environment, end_with_parent
from rfgs_core.errors import RfgsError


def build_scene(what: str, *arguments: str) -> None:
    """Runs one of the builder's commands.

    Args:
        what: What is built, for the message.
        *arguments: Command and arguments.

    Raises:
        RfgsError: The builder failed; the message is its own.
    """
    done = subprocess.run(
        [sys.executable, "-m", "blender_scenes", *arguments],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        errors="replace",
        env=child_environment(),
        start_new_session=True,
        preexec_fn=end_with_parent,
    )
    if done.returncode:
        said = [line for line in done.stderr.splitlines() if line.strip()]
        reason = said[-1].removeprefix("error: ") if said else f"code {done.returncode}"
        raise RfgsError(f"{what} could not be built: {reason}")
