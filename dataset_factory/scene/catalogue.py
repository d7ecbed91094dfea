# SPDX-License-Identifier: Apache-2.0
"""Finds scenes: those that come with RF-GS by name, any Blender file by path."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.files import inside, sha256
from rfgs_core.records import read_record

#: First bytes of a Blender file: plain, Zstandard or gzip.
MAGIC = (b"BLENDER", b"\x28\xb5\x2f\xfd", b"\x1f\x8b")
#: Interactions that are traced where a scene does not need more.
DEFAULT_DEPTH = 2


@dataclass(frozen=True)
class Scene:
    """A Blender file that data can be generated from."""

    name: str
    """Name in the catalogue, or of the file."""
    blend: Path
    """The Blender file."""
    description: str
    """One sentence."""
    fps: float | None
    """Frames per second, where the catalogue knows."""
    frames: str
    """Frames `A:B`, where the catalogue knows."""
    depth: int = DEFAULT_DEPTH
    """Interactions that a path needs to show what moves there."""


@dataclass(frozen=True)
class _Row:
    """A scene as the list has it."""

    name: str
    file: str
    description: str
    fps: float
    frame_start: int
    frame_end: int
    depth: int = DEFAULT_DEPTH


def catalogue_file() -> Path:
    """The list of scenes in the installed source tree."""
    return Path(__file__).resolve().parents[2] / "blender_scenes" / "catalogue.json"


def catalogue() -> list[Scene]:
    """Every scene that comes with RF-GS.

    Raises:
        RfgsError: The list is missing or damaged.
    """
    file = catalogue_file()
    return [
        Scene(
            name=row.name,
            blend=inside(file.parent, row.file),
            description=row.description,
            fps=row.fps,
            frames=f"{row.frame_start}:{row.frame_end}",
            depth=row.depth,
        )
        for row in read_record(file, list[_Row])
    ]


def find_scene(name: str) -> Scene:
    """The scene of a catalogue name or a path.

    Args:
        name: Name in the catalogue, or path of a `.blend` file.

    Raises:
        RfgsError: It does not exist.
        RfgsFormatError: It is not a Blender file.
    """
    path = Path(name)
    # A folder of that name may be the dataset that the same command has made of it before.
    if path.suffix == ".blend" or path.is_file():
        scene = Scene(path.stem, path.resolve(), "", None, "")
    else:
        known = {row.name: row for row in catalogue()}
        if name not in known:
            raise RfgsError(
                f"no scene {name!r}; expected a .blend file or one of {', '.join(sorted(known))}"
            )
        scene = known[name]
    if not scene.blend.is_file():
        raise RfgsError(f"{scene.blend}: no such Blender file")
    with scene.blend.open("rb") as stream:
        head = stream.read(7)
    if not head.startswith(MAGIC):
        raise RfgsFormatError(
            f"{scene.blend}: not a Blender file; expected a .blend saved by Blender"
        )
    return scene


def blend_digest(scene: Scene) -> str:
    """SHA-256 of the Blender file."""
    return sha256(scene.blend)
