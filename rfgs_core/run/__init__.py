# SPDX-License-Identifier: Apache-2.0
"""Runs: a folder that training fills frame by frame, and that everything after it reads."""

from __future__ import annotations

from rfgs_core.run.folder import Run, open_run

__all__ = ["Run", "open_run"]
