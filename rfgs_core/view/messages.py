# SPDX-License-Identifier: Apache-2.0
"""What the viewer's page may say: where it looks from, what it clicks, how a control is set."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

import msgspec

#: Larger messages are none of the page's [bytes].
LARGEST_BYTES = 2**16

#: Far from any scene, and still a number that can be squared [m].
_FAR_M = 1e9
Number = Annotated[float, msgspec.Meta(ge=-_FAR_M, le=_FAR_M)]
Text = Annotated[str, msgspec.Meta(max_length=200)]
Triple = tuple[Number, Number, Number]
Pixels = Annotated[int, msgspec.Meta(ge=0, le=2**16)]


class ViewerCameraMessage(msgspec.Struct, tag_field="type", forbid_unknown_fields=True):
    """Where a page looks from."""

    wxyz: tuple[Number, Number, Number, Number]
    position: Triple
    fov: Number
    near: Number
    far: Number
    image_height: Pixels
    image_width: Pixels
    look_at: Triple
    up_direction: Triple


class SceneNodeClickMessage(msgspec.Struct, tag_field="type", forbid_unknown_fields=True):
    """A click on something in the scene."""

    name: Text
    instance_index: int | None
    ray_origin: Triple
    ray_direction: Triple
    screen_pos: tuple[Number, Number]
    modifier: Text | None
    owner: Text = ""


class GuiUpdateMessage(msgspec.Struct, tag_field="type", forbid_unknown_fields=True):
    """A control that was moved."""

    uuid: Text
    updates: dict[str, Any]


_DECODER = msgspec.msgpack.Decoder(ViewerCameraMessage | SceneNodeClickMessage | GuiUpdateMessage)


def complaint(raw: bytes | str, controls: Mapping[str, Any]) -> str:
    """Why a message is not taken, in words; empty if it is.

    Args:
        raw: The message.
        controls: The controls of the page by their id.
    """
    if not isinstance(raw, bytes):
        return "expected a message in msgpack, found text"
    try:
        message = _DECODER.decode(raw)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        return f"expected a message of the page ({error})"
    if isinstance(message, GuiUpdateMessage):
        return _misuse(message, controls)
    if isinstance(message, ViewerCameraMessage) and not _looks(message):
        return "expected a camera that looks somewhere, found one without direction"
    return ""


def _looks(camera: ViewerCameraMessage) -> bool:
    """Whether a camera has a direction, and an up."""
    there = camera.position != camera.look_at
    return there and any(camera.wxyz) and any(camera.up_direction)


def _misuse(message: GuiUpdateMessage, controls: Mapping[str, Any]) -> str:
    """Why a control is not set."""
    control = controls.get(message.uuid)
    if control is None:
        return "expected one of the page's controls, found another"
    if list(message.updates) != ["value"]:
        return "expected a control's value, found something else of it"
    value, name = message.updates["value"], getattr(control, "label", "a control")
    if getattr(control, "disabled", False):
        return f"{name}: it is disabled"
    return "" if _fits(control, value) else f"{name}: expected {_wanted(control)}, found {value!r}"


def _wanted(control: Any) -> str:
    """What a control may be set to, in words."""
    if hasattr(control, "options"):
        return f"one of {', '.join(control.options)}"
    if hasattr(control, "min"):
        return f"a number from {control.min:g} to {control.max:g}"
    return "true or false"


def _fits(control: Any, value: object) -> bool:
    """Whether a control may be set to a value."""
    if hasattr(control, "options"):
        return isinstance(value, str) and value in control.options
    if hasattr(control, "min"):
        # The page counts in steps: at the end of a slider it may be a rounding error away.
        error = 1e-6 * (control.max - control.min)
        number = isinstance(value, int | float) and not isinstance(value, bool)
        return number and control.min - error <= value <= control.max + error
    return isinstance(value, bool)
