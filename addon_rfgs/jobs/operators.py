# SPDX-License-Identifier: GPL-3.0-or-later
"""Buttons around jobs."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import bpy

from ..command import Command
from ..errors import AddonError
from ..gaussians.operators import import_shown
from ..reporting import Progress, Reporting, Undoable, chosen_path
from . import following
from .checking import CHECK
from .plans import KINDS, TrainPlan, with_blender
from .preferences import InEnvironment, blender_program
from .queue import ACTIVE, DONE, RUNNING, WAITING, Job
from .record import read_record
from .starting import (
    doing_without,
    evaluate_plan,
    generate_plan,
    start,
    stop_and_wait,
    train_plan,
)


class RFGS_OT_test_environment(InEnvironment, bpy.types.Operator):
    """Ask the Python environment for its versions and for what is wrong with it."""

    bl_label = "Test Environment"
    command = Command("environment")

    @classmethod
    def ready(cls, _context: bpy.types.Context) -> bool:
        """Always: it says what is wrong."""
        return True

    def work(self, _context: bpy.types.Context, _progress: Progress) -> str:
        """Asks in the background; without a window it waits for the answer."""
        CHECK.start(self.interpreter(), blender_program())
        if not bpy.app.background:
            following.follow()
            return "Asking the environment"
        return _await_check()


class RFGS_OT_generate_dataset(InEnvironment, bpy.types.Operator):
    """Make a dataset of the saved file with rfgs-factory.

    Blender goes on meanwhile; the same settings continue what was stopped
    """

    bl_label = "Generate Dataset"
    command = Command(
        "generate",
        reads={
            "jobs": (
                *("dataset_folder", "radios", "frames", "depth", "workers", "cameras"),
                *("resolution", "samples", "seed", "images", "paths"),
            )
        },
        words={"dataset_folder": "--out", "radios": "--radio"},
    )

    blender: bpy.props.StringProperty(
        name="Blender",
        description="Blender that opens the file; empty: that of the preferences, else this one",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
    )

    @classmethod
    def ready(cls, _context: bpy.types.Context) -> bool:
        """Whether a file and an environment are there."""
        if not bpy.data.filepath:
            cls.poll_message_set("Save the file first: what is traced is the file on disk")
            return False
        return super().ready(_context)

    def work(self, context: bpy.types.Context, progress: Progress) -> str:
        """Saves the file if that is wanted, and begins."""
        plan = generate_plan(context.scene)
        if self.blender:
            plan = replace(plan, blender=str(chosen_path(self.blender)))
        if context.scene.rfgs.jobs.save_first and bpy.data.is_dirty and not bpy.app.background:
            try:
                bpy.ops.wm.save_mainfile()
            except RuntimeError as error:
                raise AddonError(f"{plan.blend}: cannot be saved; save it elsewhere") from error
        missing = doing_without(context.scene)
        if missing:
            self.say(missing)
        return start(plan, self.interpreter(), progress)


class RFGS_OT_train_gaussians(InEnvironment, bpy.types.Operator):
    """Fit Gaussians to the dataset with rfgs.

    Blender goes on meanwhile; the same settings continue what was stopped
    """

    bl_label = "Train"
    command = Command(
        "train",
        reads={
            "jobs": (
                *("run_folder", "dataset_folder", "train_radio", "train_frames"),
                *("iterations", "gaussians", "seed"),
            )
        },
        words={
            "run_folder": "--out",
            "dataset_folder": "--dataset",
            "train_radio": "--radio",
            "train_frames": "--frames",
        },
    )

    def work(self, context: bpy.types.Context, progress: Progress) -> str:
        """Begins."""
        return start(train_plan(context.scene), self.interpreter(), progress)


class RFGS_OT_evaluate_run(InEnvironment, bpy.types.Operator):
    """Measure the training beside its baselines, in the background; writes metrics.json."""

    bl_label = "Evaluate"
    command = Command("evaluate", reads={"jobs": ("run_folder",)}, words={"run_folder": "--run"})

    def work(self, context: bpy.types.Context, progress: Progress) -> str:
        """Begins."""
        return start(evaluate_plan(context.scene), self.interpreter(), progress)


class _OnChosenJob(Reporting):
    """Mixed into operators on the list's active row."""

    states: tuple[str, ...] = ()
    needs = ""
    """What to choose in the list, for whoever rests on a button that cannot be pressed."""

    @classmethod
    def ready(cls, _context: bpy.types.Context) -> bool:
        """The chosen job is in a state that the operator is for."""
        job = following.chosen_job()
        suits = job is not None and cls.suits(job)
        if not suits:
            cls.poll_message_set(cls.needs)
        return suits

    @classmethod
    def suits(cls, job: Job) -> bool:
        """Whether the operator is for this job."""
        return job.state in cls.states


class _OnJob(_OnChosenJob):
    """Mixed into operators on a job that may also be one of another Blender."""

    folder: bpy.props.StringProperty(
        name="Folder",
        description="Folder of the job's dataset or run; empty: of the one chosen in the list",
        subtype="DIR_PATH",
        options={"SKIP_SAVE"},
    )
    kind: bpy.props.EnumProperty(
        name="Kind",
        description="Which job of that folder, needed if there are several",
        items=[("ANY", "Any", "The only one"), *((k.upper(), k.capitalize(), "") for k in KINDS)],
        options={"SKIP_SAVE"},
    )

    def job(self) -> Job:
        """The job that is meant.

        Raises:
            AddonError: There is none, or there are several.
        """
        if not self.folder:
            return following.chosen_job()
        folder = chosen_path(self.folder)
        kinds = KINDS if self.kind == "ANY" else (self.kind.lower(),)
        files = (folder / "log" / f"job_{kind}.json" for kind in kinds)
        found = [file for file in files if file.is_file()]
        if len(found) != 1:
            what = "several jobs; say which kind" if found else "no job of this add-on"
            raise AddonError(f"{folder}: holds {what}")
        return following.QUEUE.restore(read_record(found[0]))


class RFGS_OT_stop_job(_OnJob, bpy.types.Operator):
    """Stop a job; finished work is kept, and Resume continues."""

    bl_label = "Stop"
    command = Command("stop", words={"folder": "folder"})
    states = (WAITING, RUNNING)
    needs = "Choose a job in the list that waits or runs"

    def work(self, _context: bpy.types.Context, _progress: Progress) -> str:
        """Asks it to stop; it is killed if it does not within some seconds."""
        job = self.job()
        if not self.suits(job):
            raise AddonError(f"{job.plan.out}: no job is running there")
        if bpy.app.background:
            stop_and_wait(job)
            return f"Stopped; finished work is kept, continue with: resume {job.plan.out}"
        following.QUEUE.stop(job)
        following.show()
        return f"{job.title} stops"


class RFGS_OT_resume_job(_OnJob, InEnvironment, bpy.types.Operator):
    """Continue a job where it stopped."""

    bl_label = "Resume"
    command = Command("resume", words={"folder": "folder"})
    needs = "Choose a job in the list that was stopped or has failed"

    @classmethod
    def suits(cls, job: Job) -> bool:
        """Jobs that ended before they were done."""
        return job.state not in {*ACTIVE, DONE}

    def work(self, _context: bpy.types.Context, progress: Progress) -> str:
        """Puts the same job at the end of the list."""
        plan = with_blender(self.job().plan, blender_program())
        return start(plan, self.interpreter(), progress)


class RFGS_OT_forget_job(_OnJob, bpy.types.Operator):
    """Take a job that is over off the list; its files stay."""

    bl_label = "Remove from List"
    command = Command("forget", words={"folder": "folder"})
    needs = "Choose a job in the list that is over"

    @classmethod
    def suits(cls, job: Job) -> bool:
        """Jobs that are over."""
        return job.state not in ACTIVE

    def work(self, _context: bpy.types.Context, _progress: Progress) -> str:
        """Removes the row."""
        job = self.job()
        following.QUEUE.forget(job)
        following.show()
        return f"{job.title} is off the list; its files stay"


class RFGS_OT_import_result(_OnChosenJob, Undoable, bpy.types.Operator):
    """Bring the Gaussians of the chosen training into the scene."""

    bl_label = "Import Result"
    needs = "Choose a training in the list that is done"

    @classmethod
    def suits(cls, job: Job) -> bool:
        """Trainings that are done."""
        return job.state == DONE and isinstance(job.plan, TrainPlan)

    def work(self, context: bpy.types.Context, _progress: Progress) -> str:
        """Imports with the settings of the Gaussians panel, and points that at the run."""
        folder = following.chosen_job().plan.out
        told = import_shown(context, Path(folder))
        context.scene.rfgs.gaussians.path = folder
        return told


def _await_check() -> str:
    """Waits for the environment's answer.

    Returns:
        What is there, in one line.

    Raises:
        AddonError: Something is wrong with it.
    """
    while CHECK.step():
        time.sleep(0.1)
    if CHECK.problems:
        raise AddonError("; also: ".join(CHECK.problems))
    return "ready: " + ", ".join(CHECK.versions)
