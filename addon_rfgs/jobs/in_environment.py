# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that run programs of the Python environment outside of Blender."""

from __future__ import annotations

from pathlib import Path

import bpy

from ..reporting import Reporting
from .environment import interpreter
from .preferences import environment_path


class InEnvironment(Reporting):
    """Mixed into operators that need the environment."""

    python: bpy.props.StringProperty(
        name="Python",
        description="Python program or environment with rfgs; empty: the one of the preferences",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
    )

    def interpreter(self) -> Path:
        """Its Python program.

        Raises:
            AddonError: None is chosen, or there is none.
        """
        return interpreter(self.python or environment_path())
