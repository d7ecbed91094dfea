# SPDX-License-Identifier: GPL-3.0-or-later
"""The steps of the tab: each unfolds by itself once it can be taken, and folds once it was."""

from __future__ import annotations

from typing import Any, ClassVar

import bpy

from .tab import Tab

#: Step → its panel.
_PANELS: dict[str, type[Step]] = {}
#: The way through the tab. Where a step was taken it folds, and so do those before it: a window of
#: 720 pixels shows one or two unfolded steps beside the headers of all. The last one stays.
_PATH = ("radios", "check", "generate", "train", "inspect")
#: Steps that the user folded or unfolded. Neither the file nor its window manager, which is saved
#: with it, has to remember that.
_CHOSEN: dict[str, bool] = {}


class Step(Tab):
    """Mixed into the panel of a step, whose header is drawn here: Blender opens none of its own."""

    bl_options: ClassVar[set[str]] = {"HIDE_HEADER"}
    step: ClassVar[str]
    """Name of the property that folds it."""
    icon: ClassVar[str] = "NONE"
    """Stands before its title and tells it from the panels below."""
    unfolds: ClassVar[bool] = True
    """Whether it unfolds by itself."""

    def __init_subclass__(cls, **more: Any) -> None:
        super().__init_subclass__(**more)
        _PANELS[cls.step] = cls

    @classmethod
    def waits_for(cls, _scene: bpy.types.Scene) -> str:
        """What it waits for, in two or three words; empty as soon as it can be taken."""
        return ""

    @classmethod
    def taken(cls, _scene: bpy.types.Scene) -> str:
        """What came out of it, in two or three words; empty as long as it was not taken."""
        return ""

    @classmethod
    def failed(cls, _scene: bpy.types.Scene) -> bool:
        """Whether it has to be seen again although it, or a later one, was taken."""
        return False

    def draw(self, context: bpy.types.Context) -> None:
        """Draws the header and, where it is unfolded, what stands below."""
        steps = context.window_manager.rfgs.steps
        header, body = self.layout.panel_prop(steps, self.step)
        header.label(text=self.bl_label, icon=self.icon)
        lacking = self.waits_for(context.scene)
        told = lacking or ("" if body is not None else self.taken(context.scene))
        if told:
            aside = header.row()
            # What it waits for is dim, as the step is; what came of it is to be read.
            aside.active, aside.alignment = not lacking, "RIGHT"
            aside.label(text=told)
        if body is not None:
            self.draw_step(context, body)

    def draw_step(self, context: bpy.types.Context, layout: bpy.types.UILayout) -> None:
        """Draws what stands below the header."""
        raise NotImplementedError


class PartOfStep(Tab):
    """Mixed into a panel below that of a step, and folded away with it."""

    bl_options: ClassVar[set[str]] = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether the step above is unfolded."""
        return is_unfolded(cls.step_above(), context.scene)

    @classmethod
    def step_above(cls) -> str:
        """Name of the step that the panel is a part of."""
        parent = cls.bl_parent_id
        return next(name for name, panel in _PANELS.items() if panel.__name__ == parent)


def is_unfolded(step: str, scene: bpy.types.Scene) -> bool:
    """Whether a step is unfolded: as the user wants it, else while it can be taken and was not."""
    if step in _CHOSEN:
        return _CHOSEN[step]
    panel = _PANELS[step]
    return panel.unfolds and not panel.waits_for(scene) and not _is_behind(step, scene)


def _is_behind(step: str, scene: bpy.types.Scene) -> bool:
    """Whether a step, or a later one, was taken and nothing of it asks to be seen."""
    if step not in _PATH[:-1] or _PANELS[step].failed(scene):
        return False
    return any(_PANELS[name].taken(scene) for name in _PATH[_PATH.index(step) :])


def fold(step: str, unfolded: bool) -> None:
    """Keeps what the user wants, until another file is opened."""
    _CHOSEN[step] = unfolded


def fold_by_themselves() -> None:
    """Forgets what the user wanted."""
    _CHOSEN.clear()


def _folded(step: str, title: str) -> Any:
    return bpy.props.BoolProperty(
        name=title,
        description="Whether this step is unfolded; by itself it is until it was taken",
        get=lambda _steps: is_unfolded(step, bpy.context.scene),
        set=lambda _steps, value: fold(step, value),
        options={"SKIP_SAVE"},
    )


class RFGS_PG_steps(bpy.types.PropertyGroup):
    """Which steps of the tab are unfolded; nothing of it is stored."""

    radios: _folded("radios", "1 Radios")
    check: _folded("check", "2 Check")
    generate: _folded("generate", "3 Generate")
    train: _folded("train", "4 Train")
    jobs: _folded("jobs", "Jobs")
    inspect: _folded("inspect", "5 Inspect")
    file: _folded("file", "This File")
