# SPDX-License-Identifier: Apache-2.0
"""What `bundle.json` holds; rows may hold more than is named here."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta, Struct

from rfgs_core.dataset.rows import CameraPose, DeviceRow, Frame, Positive, Triple

_Id = Annotated[int, Meta(ge=0)]


class BundleDevice(DeviceRow, kw_only=True):
    """A device, and the radio that it belongs to."""

    radio: str


class Material(Struct):
    """A radio material."""

    name: str
    radio_material: str
    thickness_m: float
    scattering_coefficient: float


class SceneObject(Struct, rename={"class_": "class"}):
    """An object of the scene, with its meshes where it stands still."""

    id: _Id
    name: str
    class_: str
    instance: int
    moving: bool
    files: list[str]


class Instance(Struct, rename={"class_": "class"}):
    """Something that moves."""

    id: _Id
    name: str
    class_: str
    person: bool
    nominal_surface_m2: float | None = None


class RoomRow(Struct):
    """The room around the people."""

    box_m: tuple[Triple, Triple]
    stand_m: Triple
    seen_m: list[Triple]


class Poses(Struct):
    """Times after each frame at which poses are kept [s]."""

    span_s: float
    offset_s: list[float]


class BundleRows(Struct):
    """All of `bundle.json` that is read."""

    blend_name: str
    blend_sha256: str
    blender_version: str
    fps: Positive
    frame_start: Frame
    frame_end: Frame
    frames: Annotated[list[Frame], Meta(min_length=1)]
    bounds_m: tuple[Triple, Triple]
    devices: list[BundleDevice]
    cameras: list[CameraPose]
    materials: list[Material]
    objects: list[SceneObject]
    instances: list[Instance]
    digests: dict[str, str]
    room: RoomRow | None = None
    poses: list[Poses] = []
