# SPDX-License-Identifier: GPL-3.0-or-later
"""Played inside Blender: the channels of a link, by the button, beside an open Image Editor.

Arguments: Python program of the environment, run.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import bpy


def play(stage: Any) -> Iterator[float]:
    """Draws without and with an Image Editor; gives up by Esc, without the add-on or the file."""
    python, run = stage.arguments
    yield from show_panel(stage)
    stage.part("jobs.preferences").preferences().python = python
    bpy.context.scene.rfgs.gaussians.path = run
    said = bpy.context.scene.rfgs.channels
    said.tx_device, said.rx_device = 0, 1
    bpy.ops.ed.undo_push(message="before")
    before = editors()

    yield from draw(stage)
    alone = [names(), editors() == before, shown()]

    area = next(area for area in stage.window.screen.areas if area.type == "DOPESHEET_EDITOR")
    area.ui_type = "IMAGE_EDITOR"
    said.rx_device = 2
    bpy.ops.ed.undo_push(message="an editor")
    stage.gaps_s.clear()
    yield from draw(stage)
    beside = [names(), shown()]
    yield from stage.shoot("channels")
    gaps_s = list(stage.gaps_s)
    with stage.override():
        bpy.ops.ed.undo()
    yield 0.5
    undone = names()
    with stage.override():
        bpy.ops.ed.redo()
    yield 0.5
    redone = names()

    yield from begin(stage)
    child = waiting(stage)._now.drawing.question._child
    x, y = stage.view.x + stage.view.width // 3, stage.view.y + stage.view.height // 2
    for kind, value in (("MOUSEMOVE", "NOTHING"), ("ESC", "PRESS"), ("ESC", "RELEASE")):
        stage.window.event_simulate(type=kind, value=value, x=x, y=y)
        yield 0.3
    given_up = [waiting(stage).waits(), child.poll() is not None]

    yield from begin(stage)
    child = waiting(stage)._now.drawing.question._child
    yield from show_panel(stage)  # registers the add-on again
    left = [waiting(stage).waits(), child.poll() is not None]
    row = {"alone": alone, "beside": beside, "undone": [undone, redone], "gaps_s": gaps_s}
    row |= {"given_up": given_up, "left": left}

    yield from begin(stage)
    child = waiting(stage)._now.drawing.question._child
    bpy.ops.wm.read_homefile()
    row["opened"] = [waiting(stage).waits(), child.poll() is not None]
    (stage.out / "told.json").write_text(json.dumps(row))


def show_panel(stage: Any) -> Iterator[float]:
    yield from stage.open_tab("RFGS_PT_gaussians", "RFGS_PT_channels", alone=False)


def waiting(stage: Any) -> Any:
    return stage.part("channels.waiting")


def begin(stage: Any) -> Iterator[float]:
    for _ in range(3):
        yield from stage.click("rfgs.show_csi")
        for _ in range(20):
            yield 0.2
            if waiting(stage).waits():
                return
        stage.forget_places()  # Blender 4.3 moves the tab when an area changes its type.
    raise TimeoutError("no drawing begins")


def draw(stage: Any) -> Iterator[float]:
    yield from begin(stage)
    assert not bpy.ops.rfgs.show_csi.poll(), "one at a time"
    yield from stage.wait(lambda: not waiting(stage).waits(), "drawing", 120)
    yield 0.5


def names() -> list[str]:
    return sorted(image.name for image in bpy.data.images if image.name.startswith("link"))


def editors() -> list[list[str]]:
    return [[area.ui_type for area in screen.areas] for screen in bpy.data.screens]


def shown() -> list[str]:
    """Images in the editors of the window."""
    areas = bpy.context.window_manager.windows[0].screen.areas
    images = [area.spaces.active.image for area in areas if area.type == "IMAGE_EDITOR"]
    return [image.name for image in images if image]
