# SPDX-License-Identifier: Apache-2.0
"""Where each file of a sequence lies."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class SequenceFiles:
    """File names of one sequence; names of cameras and radios are checked by the schema."""

    root: Path
    """Folder of the sequence."""

    @property
    def info(self) -> Path:
        """Everything about the sequence but its data."""
        return self.root / "sequence.json"

    def csi(self, radio: str) -> Path:
        """Zarr store of a radio."""
        return self.root / "radio" / radio / "csi.zarr"

    def csi_done(self, radio: str, frame: int | None) -> Path:
        """Marker of a frame's channel, written last; None is the static channel."""
        name = "static" if frame is None else f"{frame:06d}"
        return self.root / "radio" / radio / "done" / name

    def paths(self, radio: str, frame: int | None) -> Path:
        """Path table of a frame; None is the static channel's."""
        name = "static" if frame is None else f"{frame:06d}"
        return self.root / "radio" / radio / "paths" / f"{name}.npz"

    def image(self, camera: str, frame: int) -> Path:
        """Colour picture."""
        return self.root / "images" / camera / f"{frame:06d}.png"

    def image_empty(self, camera: str) -> Path:
        """Colour picture without anything that moves."""
        return self.root / "images_empty" / f"{camera}.png"

    def depth(self, camera: str, frame: int) -> Path:
        """Planar depth."""
        return self.root / "depth" / camera / f"{frame:06d}.exr"

    def normal(self, camera: str, frame: int) -> Path:
        """World normals."""
        return self.root / "normal" / camera / f"{frame:06d}.exr"

    def mask(self, camera: str, frame: int) -> Path:
        """Instance ids."""
        return self.root / "mask" / camera / f"{frame:06d}.png"

    def images_done(self, frame: int) -> Path:
        """Marker of all pictures of a frame, written last."""
        return self.root / "images" / "done" / f"{frame:06d}"

    def geometry(self, frame: int) -> Path:
        """What moves, at one frame."""
        return self.root / "geometry" / f"{frame:06d}.npz"

    @property
    def topology(self) -> Path:
        """Triangles of what moves."""
        return self.root / "geometry" / "topology.npz"

    @property
    def static_mesh(self) -> Path:
        """Everything that stands still."""
        return self.root / "geometry" / "static.ply"

    def transforms(self, split: str) -> Path:
        """Cameras and pictures of a split in the nerfstudio convention."""
        return self.root / f"transforms_{split}.json"
