# SPDX-License-Identifier: Apache-2.0
"""What a small scene holds, in words that `blender_scenes.verification` builds a file from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

Place = tuple[float, float, float]


@dataclass(frozen=True)
class Part:
    """One plain shape."""

    name: str
    """Unique within the scene."""
    shape: Literal["sheet", "box", "ball"]
    """A rectangle across its own z, a closed box, or a sphere of triangles."""
    size: Place
    """Extent along its own axes before it is turned [m]."""
    at: Place = (0.0, 0.0, 0.0)
    """Its centre [m]."""
    material: str = "metal"
    """Radio material."""
    thickness_m: float = 0.0
    """Thickness of the slab behind its faces [m]; 0 takes the material's own."""
    turn_deg: Place = (0.0, 0.0, 0.0)
    """Euler angles about x, then y, then z [deg]."""
    cells: int = 1
    """Quads along each side of a face; of a ball, subdivisions of an icosahedron."""
    kind: Literal["STATIC", "PERSON", "AUTO", "VEHICLE"] = "STATIC"
    """What it is to the radio: scenery, facets that scatter and shade (a person, or whatever else
    moves), or rigid metal."""
    keys: tuple[tuple[int, Place, float], ...] = ()
    """Frame, centre [m] and angle about z [deg]; it moves evenly in between."""


@dataclass(frozen=True)
class Device:
    """An Empty that is a radio device, upright."""

    name: str
    """Unique within the scene."""
    at: Place
    """Its place [m]."""
    yaw_deg: float = 0.0
    """Where its boresight points, from +x towards +y [deg]."""
    role: Literal["ACCESS_POINT", "TRANSMITTER", "RECEIVER"] = "ACCESS_POINT"
    """What it does."""
    radio: str = "any"
    """Preset that it belongs to."""


@dataclass(frozen=True)
class Camera:
    """A perspective camera."""

    name: str
    """Unique within the scene."""
    at: Place
    """Its place [m]."""
    to: Place
    """What it looks at [m]."""
    angle_deg: float = 60.0
    """Angle of view along the longer side [deg]."""


@dataclass(frozen=True)
class Description:
    """A small scene."""

    parts: tuple[Part, ...]
    """Its shapes; at least one must move."""
    devices: tuple[Device, ...] = ()
    """Its radio devices, in the order of their names."""
    cameras: tuple[Camera, ...] = ()
    """Its cameras, in the order of their names."""
    frames: int = 2
    """Frames from 1."""
    fps: int = 10
    """Frames per second."""

    def as_json(self) -> dict[str, object]:
        """What the builder reads."""
        return {
            "frames": self.frames,
            "fps": self.fps,
            "parts": [{**vars(part), "class": part.kind} for part in self.parts],
            "devices": [vars(device) for device in self.devices],
            "cameras": [vars(camera) for camera in self.cameras],
        }


def stepping(part: Part, places: Sequence[Place], yaws_deg: Sequence[float] = ()) -> Part:
    """A part that is at a place in each frame from 1, and turned by an angle there."""
    angles = yaws_deg or [0.0] * len(places)
    rows = zip(places, angles, strict=True)
    return replace(part, keys=tuple((n, at, yaw) for n, (at, yaw) in enumerate(rows, start=1)))


def room(size_m: Place, material: str, thickness_m: float = 0.0) -> tuple[Part, ...]:
    """Six sheets around a box from the origin, their normals inwards.

    Args:
        size_m: Edge lengths of the box [m].
        material: Radio material of all six.
        thickness_m: Thickness of their slabs [m]; 0 takes the material's own.
    """
    x, y, z = size_m
    sheets = {
        "floor": ((x, y, 0.0), (x / 2, y / 2, 0.0), (0.0, 0.0, 0.0)),
        "ceiling": ((x, y, 0.0), (x / 2, y / 2, z), (180.0, 0.0, 0.0)),
        "south": ((x, z, 0.0), (x / 2, 0.0, z / 2), (-90.0, 0.0, 0.0)),
        "north": ((x, z, 0.0), (x / 2, y, z / 2), (90.0, 0.0, 0.0)),
        "west": ((z, y, 0.0), (0.0, y / 2, z / 2), (0.0, 90.0, 0.0)),
        "east": ((z, y, 0.0), (x, y / 2, z / 2), (0.0, -90.0, 0.0)),
    }
    return tuple(
        Part(name, "sheet", size, at, material, thickness_m, turn)
        for name, (size, at, turn) in sheets.items()
    )


#: Something has to move in every scene; csi_static is without it.
MARKER = Part(
    "marker",
    "box",
    (0.35, 0.35, 0.6),
    kind="PERSON",
    material="skin",
)
