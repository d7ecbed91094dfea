# SPDX-License-Identifier: GPL-3.0-or-later
"""`blender -b FILE --command rfgs …`, and what an operator says of its command."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import bpy

_handle: Any = None


@dataclass(frozen=True)
class Command:
    """What a command has beside the properties of its operator, which all become options."""

    name: str
    """One word, or a group's and its own: `devices add`."""
    help: str = ""
    """What it does; without it, what the operator says of itself."""
    reads: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Settings that are options too, by their group in `scene.rfgs`."""
    anew: bool = False
    """Whether a setting that is not given is a new file's; else it is what this file holds."""
    words: Mapping[str, str] = field(default_factory=dict)
    """Options with another name than their property's; one without dashes has a fixed place."""
    needs: tuple[str, ...] = ()
    """Properties that must be given."""
    repeated: tuple[str, ...] = ()
    """Texts that take several values, with commas between."""
    together: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Options that give several numbers: `--range LOW HIGH`, or in one word `--tx ROWSxCOLS`."""
    means: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    """What an option sets besides; one that is no property's is a switch."""
    instead: Mapping[str, str] = field(default_factory=dict)
    """Switches that call another operator."""
    unsaid: Mapping[str, Any] = field(default_factory=dict)
    """Values of properties that are not given, where they are not the operator's."""
    frame: bool = False
    """Whether the frame to go to first is an option."""
    saves: bool = False
    """Whether the file is saved afterwards, as another one."""
    add: Callable[[Any], object] | None = None
    """Adds options of the command alone to its parser."""
    prepare: Callable[[dict[str, Any]], None] | None = None
    """Changes the operator's values, or refuses them."""
    work: Callable[[Any], str] | None = None
    """Called with all options in place of the operator; returns what was done."""


def _run(arguments: list[str]) -> int:
    # Imported on use: Blender starts faster, and only commands need argparse.
    from .cli import run

    return run(arguments, "blender -b FILE --command rfgs")


def register() -> None:
    """Adds the command `rfgs`."""
    global _handle
    _handle = bpy.utils.register_cli_command("rfgs", _run)


def unregister() -> None:
    """Removes the command."""
    global _handle
    if _handle is not None:
        bpy.utils.unregister_cli_command(_handle)
        _handle = None
