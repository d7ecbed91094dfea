# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs inside a Blender with a window: plays a script step by step and photographs what is drawn.

Started by `window.py`: `blender FILE --python onstage.py -- SCRIPT.py FRAMEBUFFER OUT [ARGUMENT…]`.
The script holds `play(stage)`, a generator: each `yield SECONDS` gives Blender's own loop time to
handle events and to draw.
"""

from __future__ import annotations

import importlib
import json
import os
import runpy
import shutil
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import bpy

EXTENSION = "bl_ext.user_default.addon_rfgs"
#: Pixels between the places where a button is looked for; buttons are 20 high.
_SEARCH_PX = 13
#: How far above where a button was found the row above it is: rows are 26 apart.
_UP_PX = 22
#: How far below a button the first item of its menu lies.
_MENU_PX = 30


class Stage:
    """The window that a script acts in."""

    def __init__(self, framebuffer: Path, out: Path, arguments: list[str]) -> None:
        self._framebuffer, self.out = framebuffer, out
        self.arguments = arguments
        self.gaps_s: list[float] = []
        self._places: dict[str, tuple[int, int]] = {}

    @property
    def window(self) -> bpy.types.Window:
        return bpy.context.window_manager.windows[0]

    @property
    def view(self) -> bpy.types.Area:
        return next(area for area in self.window.screen.areas if area.type == "VIEW_3D")

    @property
    def sidebar(self) -> bpy.types.Region:
        return next(region for region in self.view.regions if region.type == "UI")

    def override(self, region: str = "WINDOW") -> Any:
        """Context of the 3D view, for operators that need one."""
        area = self.view
        found = next(item for item in area.regions if item.type == region)
        return bpy.context.temp_override(window=self.window, area=area, region=found)

    def open_tab(self, *only: str, alone: bool = True) -> Iterator[float]:
        """Shows our tab.

        Args:
            *only: Panels that are shown, as in `RFGS_PT_jobs`; all of them if none is named.
            alone: Give the 3D view the whole window.
        """
        unfold_panels(only)
        if alone:
            with self.override():
                bpy.ops.screen.screen_full_area(use_hide_panels=True)
            yield 0.5
        space = self.view.spaces.active
        space.show_region_ui = True
        yield 0.5
        self.sidebar.active_panel_category = "RF-GS"
        yield from self.redraw()

    def redraw(self) -> Iterator[float]:
        """Draws everything once more."""
        for area in self.window.screen.areas:
            area.tag_redraw()
        yield 0.3
        bpy.ops.wm.redraw_timer(type="DRAW_WIN_SWAP", iterations=1)

    def shoot(self, name: str, part: str = "WINDOW") -> Iterator[float]:
        """Photographs the `WINDOW`, the `VIEW` or only its `SIDEBAR`, as OUT/NAME.png."""
        yield from self.redraw()
        shutil.copy(self._framebuffer, self.out / f"{name}.xwd")
        place = None if part == "WINDOW" else {"VIEW": self.view, "SIDEBAR": self.sidebar}[part]
        crop = None
        if place is not None:
            crop = [place.x, self.window.height - place.y - place.height, place.width, place.height]
        (self.out / f"{name}.json").write_text(json.dumps({"crop": crop}))

    def part(self, name: str) -> Any:
        """A module of the extension, as in `jobs.following`."""
        return importlib.import_module(f"{EXTENSION}.{name}")

    def wait(self, until: Callable[[], bool], what: str, seconds: float = 400.0) -> Iterator[float]:
        """Lets Blender go on until something is so; notes how long it took to come back."""
        begin_s = last_s = time.monotonic()
        while not until():
            if time.monotonic() - begin_s > seconds:
                raise TimeoutError(f"not within {seconds:g} s: {what}")
            yield 0.1
            self.gaps_s.append(time.monotonic() - last_s)
            last_s = time.monotonic()

    def click(self, operator: str) -> Iterator[float]:
        """Finds the sidebar's button of an operator, say `rfgs.import_gaussians`, and clicks it."""
        found = yield from self._find(operator)
        if found is None:
            raise LookupError(f"no button of {operator} in the sidebar")
        for value in ("PRESS", "RELEASE"):
            self.window.event_simulate(type="LEFTMOUSE", value=value, x=found[0], y=found[1])
            yield 0.2

    def choose_first(self, above: str) -> Iterator[float]:
        """Clicks the menu in the row above an operator's button, and then its first item.

        Blender tells operators below the pointer, but no menus of operators.
        """
        found = yield from self._find(above)
        if found is None:
            raise LookupError(f"no button of {above} in the sidebar")
        # Buttons are found from above, by their upper edge.
        x, y = self.sidebar.x + self.sidebar.width // 5, found[1] + _UP_PX
        for down in (0, _MENU_PX):
            for kind, value in (
                ("MOUSEMOVE", "NOTHING"),
                ("LEFTMOUSE", "PRESS"),
                ("LEFTMOUSE", "RELEASE"),
            ):
                self.window.event_simulate(type=kind, value=value, x=x, y=y - down)
                yield 0.3

    def takes_place_of(self, operator: str, earlier: str) -> None:
        """Looks for a button first where another one was, which it has replaced."""
        self._places[operator] = self._places[earlier]

    def forget_places(self) -> None:
        """Looks for buttons anew: they have moved."""
        self._places.clear()

    def _find(self, operator: str) -> Iterator[float]:
        # Blender does not tell where buttons are, but which one is below the pointer.
        region = self.sidebar
        place = self._places.get(operator)
        if place is not None and (yield from self._hover(*place)) == operator:
            return place
        for x in (region.x + region.width * part // 6 for part in (3, 1, 5)):
            for y in range(region.y + region.height - 10, region.y, -_SEARCH_PX):
                seen = yield from self._hover(x, y)
                self._places[seen] = (x, y)
                if seen == operator:
                    return x, y
        return None

    def _hover(self, x: int, y: int) -> Iterator[float]:
        self.window.event_simulate(type="MOUSEMOVE", value="NOTHING", x=x, y=y)
        # One turn of Blender's loop leaves a button, the next enters another; until the sidebar is
        # drawn again, the button that was left still passes for the one below the pointer.
        self.sidebar.tag_redraw()
        for _ in range(2):
            yield 0.02
        return self._below_pointer()

    def _below_pointer(self) -> str:
        manager = bpy.context.window_manager
        manager.clipboard = ""
        with self.override("UI"):
            if bpy.ops.ui.copy_python_command_button.poll():
                bpy.ops.ui.copy_python_command_button()
        return manager.clipboard.removeprefix("bpy.ops.").partition("(")[0]


def unfold_panels(only: tuple[str, ...] = ()) -> None:
    """Registers the extension again with every panel open; Blender cannot be asked to open one.

    Steps fold by themselves, and can be.

    Args:
        only: Panels that are shown; all of them if none is named.
    """
    extension = sys.modules[EXTENSION]
    extension.unregister()
    for panel in our_panels():
        panel.bl_options = set(getattr(panel, "bl_options", set())) - {"DEFAULT_CLOSED"}
        own = _POLLS.setdefault(panel.__name__, getattr(panel, "poll", None))
        if only and panel.__name__ not in only:
            panel.poll = classmethod(lambda _cls, _context: False)
        elif own is not None:
            panel.poll = own
        elif "poll" in vars(panel):
            del panel.poll
    extension.register()
    steps = bpy.context.window_manager.rfgs.steps
    for name in type(steps).__annotations__:
        setattr(steps, name, True)


#: Panel → its own `poll`.
_POLLS: dict[str, Any] = {}


def our_panels() -> list[type]:
    """Every panel class of the extension, registered or not."""
    return [
        kind for kind in bpy.types.Panel.__subclasses__() if kind.__module__.startswith(EXTENSION)
    ]


def _start() -> None:
    script, framebuffer, out, *arguments = sys.argv[sys.argv.index("--") + 1 :]
    stage = Stage(Path(framebuffer), Path(out), arguments)
    steps = runpy.run_path(script)["play"](stage)

    def tick() -> float | None:
        try:
            return next(steps)
        except StopIteration:
            # A script that opened another file is left without a window, which Blender 4.3 needs.
            with bpy.context.temp_override(window=stage.window):
                bpy.ops.wm.quit_blender()
            return None
        except BaseException:
            traceback.print_exc()
            sys.stderr.flush()
            os._exit(3)

    bpy.app.timers.register(tick, first_interval=1.0)


if __name__ == "__main__":
    _start()
