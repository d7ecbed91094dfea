# SPDX-License-Identifier: GPL-3.0-or-later
"""Buttons around jobs."""

from pathlib import Path

import bpy

from ..errors import AddonError
from ..gaussians.operators import import_shown
from ..reporting import Progress, Reporting
from . import following
from .checking import CHECK
from .environment import interpreter
from .plans import TrainPlan
from .preferences import blender_program, environment_path
from .queue import ACTIVE, DONE, RUNNING, WAITING, Job
from .starting import doing_without, evaluate_plan, generate_plan, start, train_plan


class RFGS_OT_test_environment(Reporting, bpy.types.Operator):
    """Ask the Python environment for its versions and for what is wrong with it."""

    bl_idname = "rfgs.test_environment"
    bl_label = "Test Environment"

    def work(self, _context: bpy.types.Context, _progress: Progress) -> str:
        """Asks in the background; without a window it waits for the answer."""
        CHECK.start(interpreter(environment_path()), blender_program())
        if not bpy.app.background:
            following.follow()
            return "Asking the environment"
        return await_check()


class RFGS_OT_generate_dataset(Reporting, bpy.types.Operator):
    """Make a dataset of the saved file with the panel's settings, in the background."""

    bl_idname = "rfgs.generate_dataset"
    bl_label = "Generate Dataset"

    def work(self, context: bpy.types.Context, _progress: Progress) -> str:
        """Saves the file if that is wanted, and begins."""
        plan = generate_plan(context.scene)
        if context.scene.rfgs.jobs.save_first and bpy.data.is_dirty and not bpy.app.background:
            try:
                bpy.ops.wm.save_mainfile()
            except RuntimeError as error:
                raise AddonError(f"{plan.blend}: cannot be saved; save it elsewhere") from error
        missing = doing_without(context.scene)
        return start(plan) + (f"; {missing}" if missing else "")


class RFGS_OT_train_gaussians(Reporting, bpy.types.Operator):
    """Fit Gaussians to the dataset with the panel's settings, in the background."""

    bl_idname = "rfgs.train_gaussians"
    bl_label = "Train"

    def work(self, context: bpy.types.Context, _progress: Progress) -> str:
        """Begins."""
        return start(train_plan(context.scene))


class RFGS_OT_evaluate_run(Reporting, bpy.types.Operator):
    """Measure the training beside its controls, in the background; writes metrics.json."""

    bl_idname = "rfgs.evaluate_run"
    bl_label = "Evaluate"

    def work(self, context: bpy.types.Context, _progress: Progress) -> str:
        """Begins."""
        return start(evaluate_plan(context.scene))


class _OnChosenJob:
    """Mixed into operators on the list's active row."""

    states: tuple[str, ...] = ()

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """The chosen job is in a state that the operator is for."""
        job = following.chosen_job()
        return job is not None and cls.suits(job)

    @classmethod
    def suits(cls, job: Job) -> bool:
        """Whether the operator is for this job."""
        return job.state in cls.states


class RFGS_OT_stop_job(_OnChosenJob, Reporting, bpy.types.Operator):
    """Stop the chosen job; finished work is kept, and Resume continues."""

    bl_idname = "rfgs.stop_job"
    bl_label = "Stop"
    states = (WAITING, RUNNING)

    def work(self, _context: bpy.types.Context, _progress: Progress) -> str:
        """Asks it to stop; it is killed if it does not within some seconds."""
        job = following.chosen_job()
        following.QUEUE.stop(job)
        following.show()
        return f"{job.title} stops"


class RFGS_OT_resume_job(_OnChosenJob, Reporting, bpy.types.Operator):
    """Continue the chosen job where it stopped."""

    bl_idname = "rfgs.resume_job"
    bl_label = "Resume"

    @classmethod
    def suits(cls, job: Job) -> bool:
        """Jobs that ended before they were done."""
        return job.state not in {*ACTIVE, DONE}

    def work(self, _context: bpy.types.Context, _progress: Progress) -> str:
        """Puts the same job at the end of the list."""
        return start(following.chosen_job().plan)


class RFGS_OT_forget_job(_OnChosenJob, Reporting, bpy.types.Operator):
    """Take the chosen job off the list; its files stay."""

    bl_idname = "rfgs.forget_job"
    bl_label = "Remove from List"

    @classmethod
    def suits(cls, job: Job) -> bool:
        """Jobs that are over."""
        return job.state not in ACTIVE

    def work(self, _context: bpy.types.Context, _progress: Progress) -> str:
        """Removes the row."""
        job = following.chosen_job()
        following.QUEUE.forget(job)
        following.show()
        return f"{job.title} is off the list; its files stay"


class RFGS_OT_import_result(_OnChosenJob, Reporting, bpy.types.Operator):
    """Bring the Gaussians of the chosen training into the scene."""

    bl_idname = "rfgs.import_result"
    bl_label = "Import Result"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    @classmethod
    def suits(cls, job: Job) -> bool:
        """Trainings that are done."""
        return job.state == DONE and isinstance(job.plan, TrainPlan)

    def work(self, context: bpy.types.Context, _progress: Progress) -> str:
        """Imports with the settings of the Gaussians panel, and points that at the run."""
        folder = following.chosen_job().plan.out
        told = import_shown(context.scene, Path(folder))
        context.scene.rfgs.gaussians.path = folder
        return told


def await_check() -> str:
    """Waits for the environment's answer.

    Returns:
        What is there, in one line.

    Raises:
        AddonError: Something is wrong with it.
    """
    import time

    while CHECK.step():
        time.sleep(0.1)
    if CHECK.problems:
        raise AddonError("; also: ".join(CHECK.problems))
    return "ready: " + ", ".join(CHECK.versions)
