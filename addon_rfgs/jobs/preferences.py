# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on's preferences: programs outside of Blender, and the rows of the job list."""

from __future__ import annotations

import os
import textwrap
from pathlib import Path

import bpy

from ..reporting import Reporting
from .checking import CHECK
from .environment import interpreter

#: The add-on's own name; Blender keeps its preferences under it.
ADDON = __package__.rpartition(".")[0]
#: Labels do not break; so many characters fit into a sidebar of usual width.
_LINE = 40


class RFGS_PG_job(bpy.types.PropertyGroup):
    """One row of the job list; the job itself lives in `queue.py`."""

    title: bpy.props.StringProperty(
        name="Job", description="What the job does, and where", options={"SKIP_SAVE"}
    )
    state: bpy.props.StringProperty(
        name="State", description="Whether it waits, runs or has ended", options={"SKIP_SAVE"}
    )
    message: bpy.props.StringProperty(
        name="Message", description="How far it is, or why it ended", options={"SKIP_SAVE"}
    )
    share: bpy.props.FloatProperty(
        name="Progress",
        description="Share of its stage that is done",
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        options={"SKIP_SAVE"},
    )


class RFGS_AP_preferences(bpy.types.AddonPreferences):
    """Programs outside of Blender."""

    bl_idname = ADDON

    python: bpy.props.StringProperty(
        name="Python Environment",
        description="Python program, or folder of a virtual environment, that has rfgs and "
        "rfgs-factory; jobs run there",
        subtype="FILE_PATH",
    )
    blender: bpy.props.StringProperty(
        name="Blender",
        description="Blender program, with this add-on, that jobs open the file with; empty: this "
        "one",
        subtype="FILE_PATH",
    )
    jobs: bpy.props.CollectionProperty(
        name="Jobs", description="Rows of the job list", type=RFGS_PG_job, options={"SKIP_SAVE"}
    )
    active_job: bpy.props.IntProperty(
        name="Active job", description="Which row of the job list is chosen", options={"SKIP_SAVE"}
    )

    def draw(self, _context: bpy.types.Context) -> None:
        """Shows the programs, and what the environment answered."""
        self.layout.prop(self, "python")
        self.layout.prop(self, "blender")
        draw_check(self.layout)


def draw_check(layout: bpy.types.UILayout) -> None:
    """Shows the button that tests the environment, and its answer."""
    layout.operator("rfgs.test_environment", icon="CHECKMARK")
    box = layout.box() if CHECK.running or CHECK.problems or CHECK.versions else None
    if CHECK.running:
        box.label(text="Asking the environment", icon="SORTTIME")
    for problem in CHECK.problems:
        for number, line in enumerate(textwrap.wrap(problem, _LINE)):
            box.label(text=line, icon="BLANK1" if number else "ERROR")
    if CHECK.versions and not CHECK.problems:
        box.label(text="Ready", icon="CHECKMARK")
    for line in version_lines(CHECK.versions):
        box.label(text=line, icon="BLANK1")


def version_lines(versions: list[str]) -> list[str]:
    """Names of programs with their versions in lines, none of them torn apart."""
    lines = [""]
    for number, version in enumerate(versions):
        text = version if number + 1 == len(versions) else f"{version},"
        fits = len(f"{lines[-1]} {text}") <= _LINE
        lines = [*lines[:-1], f"{lines[-1]} {text}".strip()] if fits else [*lines, text]
    return [line for line in lines if line]


def preferences() -> RFGS_AP_preferences | None:
    """The add-on's preferences; None where it is registered without being installed."""
    found = bpy.context.preferences.addons.get(ADDON)
    return found.preferences if found else None


def environment_path() -> str:
    """Path of the environment that the user chose; empty if none."""
    chosen = preferences()
    return bpy.path.abspath(chosen.python) if chosen else ""


def blender_program() -> str:
    """The Blender that jobs open files with; empty for the environment's own bpy.

    A wrapper around Blender names itself in $BLENDER, as Blender knows only the program inside.
    """
    chosen = preferences()
    if chosen and chosen.blender:
        return bpy.path.abspath(chosen.blender)
    return os.environ.get("BLENDER") or bpy.app.binary_path


class InEnvironment(Reporting):
    """Mixed into operators that run programs of the Python environment."""

    python: bpy.props.StringProperty(
        name="Python",
        description="Python program or environment with rfgs; empty: the one of the preferences",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
    )

    @classmethod
    def ready(cls, _context: bpy.types.Context) -> bool:
        """Whether an environment is chosen, and is not known to be unfit."""
        reason = CHECK.problems[0] if CHECK.problems else ""
        if not environment_path():
            reason = "Choose a Python environment with rfgs, or run `rfgs addon install` in it"
        if reason:
            cls.poll_message_set(reason)
        return not reason

    def interpreter(self) -> Path:
        """Its Python program.

        Raises:
            AddonError: None is chosen, or there is none.
        """
        return interpreter(self.python or environment_path())
