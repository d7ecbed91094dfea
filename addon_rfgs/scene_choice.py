# SPDX-License-Identifier: GPL-3.0-or-later
"""Which part of a scene is meant, and what the user says of it beside the file."""

import bpy

from .path_options import path_setting
from .reporting import chosen_path
from .scene.override_file import read_overrides
from .scene.overrides import Overrides


class SceneChoice:
    """Properties of what looks at a scene, settings or operator."""

    frames: bpy.props.StringProperty(
        name="Frames",
        description="First:last or first:last:step, both ends included; empty: the whole range",
    )
    overrides: path_setting(
        "Overrides",
        "JSON file of what is to be taken otherwise than the file has it; may be empty",
        kind="FILE_PATH",
    )


def chosen_overrides(choice: SceneChoice) -> Overrides:
    """What the file of overrides says.

    Raises:
        AddonError: It cannot be read, or makes no sense.
    """
    return read_overrides(chosen_path(choice.overrides) if choice.overrides else None)
