# SPDX-License-Identifier: GPL-3.0-or-later
"""The panels of datasets, trainings and the list of jobs."""

import bpy

from ..tab import Tab
from .following import chosen_job
from .preferences import ADDON, draw_check, environment_path, preferences
from .process import SUPPORTED
from .queue import DONE, FAILED, RUNNING, STOPPED, STOPPING, WAITING
from .starting import doing_without, traced

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
        """Shows state and title."""
        row = layout.split(factor=0.7)
        row.label(text=item.title, icon=_ICONS.get(item.state, "DOT"))
        row.label(text=item.state)


class RFGS_PT_jobs(Tab, bpy.types.Panel):
    """The environment and the list of jobs."""

    bl_label = "Generate and Train"

    def draw(self, _context: bpy.types.Context) -> None:
        """Shows the list, and how the chosen job stands."""
        layout, stored = self.layout, preferences()
        if stored is None:
            layout.label(text="Install the add-on to run jobs", icon="INFO")
            return
        if not SUPPORTED:
            layout.label(text="Jobs need Linux or macOS", icon="ERROR")
        if not environment_path():
            layout.label(text="Choose a Python environment", icon="INFO")
            layout.prop(stored, "python", text="")
        shown = layout.operator("preferences.addon_show", icon="PREFERENCES", text="Preferences")
        shown.module = ADDON
        draw_check(layout)
        if not stored.jobs:
            return
        row = layout.row()
        row.template_list("RFGS_UL_jobs", "", stored, "jobs", stored, "active_job", rows=3)
        row.column().operator("rfgs.forget_job", icon="REMOVE", text="")
        job = chosen_job()
        if job is not None and stored.active_job < len(stored.jobs):
            _draw_job(layout, job, stored.jobs[stored.active_job])


def _draw_job(layout: bpy.types.UILayout, job: object, row: object) -> None:
    """Progress, the end of the log and what can be done with a job."""
    box = layout.box()
    if row.state == RUNNING:
        # Blender 4.0 and newer draw a progress bar.
        box.progress(factor=row.share, text=row.message)
    else:
        box.label(text=row.message, icon=_ICONS.get(row.state, "DOT"))
    column = box.column(align=True)
    column.scale_y = 0.7
    for line in job.tail[-4:]:
        column.label(text=line)
    buttons = layout.row(align=True)
    buttons.operator("rfgs.stop_job", icon="CANCEL")
    buttons.operator("rfgs.resume_job", icon="PLAY")
    layout.operator("rfgs.import_result", icon="IMPORT")


class RFGS_PT_generate(Tab, bpy.types.Panel):
    """What is generated."""

    bl_parent_id = "RFGS_PT_jobs"
    bl_label = "Dataset"

    def draw(self, context: bpy.types.Context) -> None:
        """Shows the settings and the button."""
        layout, settings = self.columns(), context.scene.rfgs.jobs
        for name in ("dataset_folder", "radios"):
            layout.prop(settings, name)
        for line, icon in (
            (doing_without(context.scene), "ERROR"),
            (traced(context.scene), "INFO"),
        ):
            if line:
                layout.label(text=line, icon=icon)
        for name in ("frames", "depth", "workers", "paths", "images"):
            layout.prop(settings, name)
        column = layout.column()
        column.active = settings.images
        for name in ("cameras", "resolution", "samples"):
            column.prop(settings, name)
        layout.prop(settings, "seed")
        layout.prop(settings, "save_first")
        layout.operator("rfgs.generate_dataset", icon="PLAY")


class RFGS_PT_train(Tab, bpy.types.Panel):
    """What is trained."""

    bl_parent_id = "RFGS_PT_jobs"
    bl_label = "Training"

    def draw(self, context: bpy.types.Context) -> None:
        """Shows the settings and the buttons."""
        layout, settings = self.columns(), context.scene.rfgs.jobs
        for name in ("run_folder", "train_radio", "train_frames", "iterations", "gaussians"):
            layout.prop(settings, name)
        layout.operator("rfgs.train_gaussians", icon="PLAY")
        layout.operator("rfgs.evaluate_run", icon="VIEWZOOM")
