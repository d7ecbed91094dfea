# SPDX-License-Identifier: GPL-3.0-or-later
"""Which scenes there are; imports nothing of Blender, so that any program may ask."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

FOLDER = Path(__file__).parent


@dataclass(frozen=True)
class Scene:
    """One row of catalogue.json."""

    name: str
    """Name of the scene and of the module that builds it."""
    file: str
    """The .blend, beside the catalogue."""
    description: str
    """One line for a list."""
    fps: int
    """Frames per second."""
    frame_start: int
    """First frame."""
    frame_end: int
    """Last frame, included."""
    depth: int = 2
    """Interactions that a path needs to show the people: more where they are behind a wall."""

    @property
    def path(self) -> Path:
        """Where the .blend lies."""
        return FOLDER / self.file


def scenes() -> dict[str, Scene]:
    """All scenes by name."""
    rows = json.loads((FOLDER / "catalogue.json").read_text("utf-8"))
    return {row["name"]: Scene(**row) for row in rows}
