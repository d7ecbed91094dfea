# SPDX-License-Identifier: Apache-2.0
"""Reports: one self-contained page that shows every number beside its baselines."""

from __future__ import annotations

from rfgs_core.report.build import write_demo_report, write_run_report

__all__ = ["write_demo_report", "write_run_report"]
