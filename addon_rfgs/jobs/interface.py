# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators and panels of this folder, in the order they are registered."""

from .operators import (
    RFGS_OT_evaluate_run,
    RFGS_OT_forget_job,
    RFGS_OT_generate_dataset,
    RFGS_OT_import_result,
    RFGS_OT_resume_job,
    RFGS_OT_stop_job,
    RFGS_OT_test_environment,
    RFGS_OT_train_gaussians,
)
from .panel import RFGS_PT_generate, RFGS_PT_jobs, RFGS_PT_train, RFGS_UL_jobs
from .preferences import RFGS_AP_preferences, RFGS_PG_job

CLASSES = (
    RFGS_PG_job,
    RFGS_AP_preferences,
    RFGS_OT_test_environment,
    RFGS_OT_generate_dataset,
    RFGS_OT_train_gaussians,
    RFGS_OT_evaluate_run,
    RFGS_OT_stop_job,
    RFGS_OT_resume_job,
    RFGS_OT_forget_job,
    RFGS_OT_import_result,
    RFGS_UL_jobs,
    RFGS_PT_jobs,
    RFGS_PT_generate,
    RFGS_PT_train,
)
