# SPDX-License-Identifier: GPL-3.0-or-later
"""The panels of datasets, trainings and the list of jobs."""

from typing import Any

import bpy

from ..gaussians.clouds import trained_run
from ..scene.taking_part import wanted_radios
from ..steps import PartOfStep, Step
from ..tab import paragraph
from .checking import CHECK
from .following import QUEUE, chosen_job
from .preferences import ADDON, draw_check, environment_path, preferences
from .process import SUPPORTED
from .queue import DONE, FAILED, RUNNING, STOPPED, STOPPING, WAITING
from .starting import dataset_to_come, doing_without

_ICONS = {
    WAITING: "SORTTIME",
    RUNNING: "PLAY",
    STOPPING: "PAUSE",
    DONE: "CHECKMARK",
    FAILED: "ERROR",
    STOPPED: "CANCEL",
}


class RFGS_UL_jobs(bpy.types.UIList):
    """Jobs in the order in which they run."""

    def draw_item(
        self,
        _context: bpy.types.Context,
        layout: bpy.types.UILayout,
        _data: object,
        item: object,
        _icon: int,
        _active_data: object,
        _active_property: str,
    ) -> None:
        """Shows the title; its icon is the state, for which a narrow sidebar has no words left."""
        layout.label(text=item.title, icon=_ICONS.get(item.state, "DOT"))


class RFGS_PT_generate(Step, bpy.types.Panel):
    """What is generated."""

    bl_label = "3 Generate"
    step, icon = "generate", "RENDER_ANIMATION"

    @classmethod
    def waits_for(cls, _scene: bpy.types.Scene) -> str:
        """A Python that can trace, and a file on disk."""
        return _lacks_environment() or ("" if bpy.data.filepath else "an unsaved file")

    @classmethod
    def taken(cls, scene: bpy.types.Scene) -> str:
        """How far its job is, or that the dataset is there."""
        return (_standing("generate") or "done") if dataset_to_come(scene) else ""

    @classmethod
    def failed(cls, _scene: bpy.types.Scene) -> bool:
        """Whether its last job did."""
        return _ended_badly("generate")

    def draw_step(self, context: bpy.types.Context, layout: bpy.types.UILayout) -> None:
        """Shows what everybody sets, and the button."""
        layout, settings = self.columns(layout), context.scene.rfgs.jobs
        stored = preferences()
        layout.prop(settings, "dataset_folder")
        layout.prop(settings, "radios", placeholder=", ".join(wanted_radios(context.scene)))
        if missing := doing_without(context.scene):
            paragraph(layout, missing, "ERROR")
        layout.prop(settings, "frames", placeholder="all")
        layout.prop(settings, "images")
        if stored is not None and not environment_path():
            paragraph(layout, "Choose a Python with rfgs, or run `rfgs addon install`", "INFO")
            layout.prop(stored, "python", text="Python")
        elif not bpy.data.filepath:
            paragraph(layout, "Save the file first: what is traced is the file on disk", "INFO")
        layout.operator("rfgs.generate_dataset", icon="PLAY")
        _draw_standing(layout, "generate")


class RFGS_PT_generate_more(PartOfStep, bpy.types.Panel):
    """What few change about a dataset."""

    bl_parent_id = "RFGS_PT_generate"
    bl_label = "More Settings"

    def draw(self, context: bpy.types.Context) -> None:
        """Shows settings of tracing, pictures and processes."""
        layout, settings = self.columns(), context.scene.rfgs.jobs
        self.automatic(layout, settings, "depth", "as the scene needs")
        layout.prop(settings, "paths")
        column = layout.column()
        column.active = settings.images
        self.automatic(column, settings, "cameras", "all")
        column.prop(settings, "resolution")
        column.prop(settings, "samples")
        for name in ("workers", "seed", "save_first"):
            layout.prop(settings, name)


class RFGS_PT_train(Step, bpy.types.Panel):
    """What is trained."""

    bl_label = "4 Train"
    step, icon = "train", "MOD_PARTICLES"

    @classmethod
    def waits_for(cls, scene: bpy.types.Scene) -> str:
        """A dataset, and a Python that can train."""
        return _lacks_environment() or ("" if dataset_to_come(scene) else "no dataset")

    @classmethod
    def taken(cls, scene: bpy.types.Scene) -> str:
        """How far its job is, or that the run is there."""
        return _standing("train") or ("done" if trained_run(scene) else "")

    @classmethod
    def failed(cls, _scene: bpy.types.Scene) -> bool:
        """Whether its last job did."""
        return _ended_badly("train")

    def draw_step(self, context: bpy.types.Context, layout: bpy.types.UILayout) -> None:
        """Shows what everybody sets and the buttons; a line as long as there is no dataset."""
        layout, settings = self.columns(layout), context.scene.rfgs.jobs
        if not dataset_to_come(context.scene):
            layout.label(text="Needs the dataset of step 3", icon="INFO")
            return
        layout.prop(settings, "run_folder")
        layout.prop(settings, "train_radio", placeholder=wanted_radios(context.scene)[0])
        layout.operator("rfgs.train_gaussians", icon="PLAY")
        layout.operator("rfgs.evaluate_run", icon="VIEWZOOM")
        _draw_standing(layout, "train")
        _draw_standing(layout, "evaluate")


class RFGS_PT_train_more(PartOfStep, bpy.types.Panel):
    """What few change about a training."""

    bl_parent_id = "RFGS_PT_train"
    bl_label = "More Settings"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there is something to train on."""
        return dataset_to_come(context.scene) and super().poll(context)

    def draw(self, context: bpy.types.Context) -> None:
        """Shows settings of the fit."""
        layout, settings = self.columns(), context.scene.rfgs.jobs
        layout.prop(settings, "train_frames", placeholder="all")
        self.automatic(layout, settings, "iterations", "the recipe's")
        self.automatic(layout, settings, "gaussians", "the recipe's")


class RFGS_PT_jobs(Step, bpy.types.Panel):
    """The environment and the list of jobs."""

    bl_label = "Jobs"
    bl_order = 1
    step, icon = "jobs", "SORTTIME"

    @classmethod
    def waits_for(cls, _scene: bpy.types.Scene) -> str:
        """A job, or an answer of the environment."""
        stored = preferences()
        told = CHECK.running or CHECK.problems or CHECK.versions
        return "" if told or (stored is not None and stored.jobs) else "none"

    def draw_step(self, _context: bpy.types.Context, layout: bpy.types.UILayout) -> None:
        """Shows the list, and how the chosen job stands."""
        stored = preferences()
        if stored is None:
            layout.label(text="Install the add-on to run jobs", icon="INFO")
            return
        if not SUPPORTED:
            layout.label(text="Jobs need Linux or macOS", icon="ERROR")
        draw_check(layout)
        shown = layout.operator("preferences.addon_show", icon="PREFERENCES", text="Preferences")
        shown.module = ADDON
        if not stored.jobs:
            return
        row = layout.row()
        row.template_list("RFGS_UL_jobs", "", stored, "jobs", stored, "active_job", rows=3)
        row.column().operator("rfgs.forget_job", icon="REMOVE", text="")
        job = chosen_job()
        if job is not None and stored.active_job < len(stored.jobs):
            _draw_job(layout, job, stored.jobs[stored.active_job])


def _lacks_environment() -> str:
    """Why no program of the environment can run, in few words; empty if one can."""
    if not environment_path():
        return "no environment"
    return "unfit environment" if CHECK.problems else ""


def _last_row(kind: str) -> Any:
    """The row of the last job of a kind; None without one."""
    stored = preferences()
    rows = [
        row
        for row, job in zip(stored.jobs if stored else (), QUEUE.jobs, strict=False)
        if job.plan.kind == kind
    ]
    return rows[-1] if rows else None


def _standing(kind: str) -> str:
    """How far the last job of a kind is, in two or three words; empty without one."""
    row = _last_row(kind)
    if row is None:
        return ""
    return str(row.message if row.state == RUNNING and row.message else row.state).lower()


def _ended_badly(kind: str) -> bool:
    """Whether the last job of a kind has to be looked at."""
    row = _last_row(kind)
    return row is not None and row.state in (FAILED, STOPPED)


def _draw_standing(layout: bpy.types.UILayout, kind: str) -> None:
    """How far the last job of a kind is, or how it ended, below the button that began it."""
    row = _last_row(kind)
    if row is None:
        return
    if row.state == RUNNING:
        layout.progress(factor=row.share, text=row.message)
    else:
        said = row.state if row.state.lower() == row.message else f"{row.state}: {row.message}"
        paragraph(layout, said, _ICONS.get(row.state, "DOT"))


def _draw_job(layout: bpy.types.UILayout, job: object, row: object) -> None:
    """Progress, the end of the log and what can be done with a job."""
    box = layout.box()
    if row.state == RUNNING:
        # Blender 4.0 and newer draw a progress bar.
        box.progress(factor=row.share, text=row.message)
    else:
        paragraph(box, row.message, _ICONS.get(row.state, "DOT"))
    column = box.column(align=True)
    column.scale_y = 0.7
    for line in job.tail[-4:]:
        column.label(text=line)
    buttons = layout.row(align=True)
    buttons.operator("rfgs.stop_job", icon="CANCEL")
    buttons.operator("rfgs.resume_job", icon="PLAY")
    layout.operator("rfgs.import_result", icon="IMPORT")
