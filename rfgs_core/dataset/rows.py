# SPDX-License-Identifier: Apache-2.0
"""What the rows of `sequence.json` hold, for whoever reads them as they are: as JSON objects.

Rows may hold more than is named here.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from msgspec import Meta, Struct

from rfgs_core.radio.layout import Role

#: Numbers of rows, pixels and the like beyond which something else was meant.
MOST_FRAMES = 10_000_000
MOST_PIXELS = 65_536
#: Distances [m] and rates beyond which squares and products of them are no numbers any more.
_FAR_M, _FAST_HZ, _SLOW_HZ = 1e9, 1e9, 1e-9

_Count = Annotated[int, Meta(ge=0)]
_Pixels = Annotated[int, Meta(ge=1, le=MOST_PIXELS)]
Positive = Annotated[float, Meta(gt=0.0)]
_Coordinate = Annotated[float, Meta(ge=-_FAR_M, le=_FAR_M)]
Triple = tuple[_Coordinate, _Coordinate, _Coordinate]
_Quadruple = tuple[_Coordinate, _Coordinate, _Coordinate, _Coordinate]
Frame = Annotated[int, Meta(ge=-MOST_FRAMES, le=MOST_FRAMES)]


class CameraPose(Struct):
    """A camera: intrinsics [px] and pose."""

    name: str
    width: _Pixels
    height: _Pixels
    fl_x: Positive
    fl_y: Positive
    cx: float
    cy: float
    world_from_camera: tuple[_Quadruple, _Quadruple, _Quadruple, _Quadruple]


class CameraRow(CameraPose, kw_only=True):
    """A camera of a dataset."""

    split: Literal["train", "test"]


class DeviceRow(Struct):
    """A device and where it stands."""

    name: str
    position_m: Triple
    quat_wxyz: _Quadruple
    role: Role = "ACCESS_POINT"


class InstanceRow(Struct, rename={"class_": "class"}):
    """Something that moves, by the id that masks use."""

    id: Annotated[int, Meta(ge=0, le=65_535)]
    name: str
    class_: str
    nominal_surface_m2: float | None = None


class ObjectRow(Struct, rename={"class_": "class"}):
    """Something that paths can meet."""

    id: _Count
    name: str
    class_: str


class RadioSplit(Struct):
    """What is held out of a radio's training."""

    rx_elements: list[_Count]
    subcarriers: list[_Count]
    device_pairs: list[tuple[_Count, _Count]]
    unmeasured_subcarriers: list[_Count] = []


class ImageSplit(Struct):
    """Which pictures no shader may see."""

    test_cameras: list[str]
    test_frames: list[int]


class Splits(Struct):
    """What is held out of training."""

    rf: dict[str, RadioSplit]
    images: ImageSplit


class SequenceRows(Struct):
    """Parts of `sequence.json` that are checked more closely than their types say."""

    frames: Annotated[list[Frame], Meta(min_length=1)]
    frame_start: Frame
    fps: Annotated[float, Meta(ge=_SLOW_HZ, le=_FAST_HZ)]
    bounds_m: tuple[Triple, Triple]
    cameras: list[CameraRow]
    devices: dict[str, list[DeviceRow]]
    radios: dict[str, dict[str, Any]]
    splits: Splits
    instances: list[InstanceRow] = []
    objects: list[ObjectRow] = []
    trace_depth: Annotated[int, Meta(ge=0, le=100)] = 1
