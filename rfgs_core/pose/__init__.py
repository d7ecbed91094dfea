# SPDX-License-Identifier: Apache-2.0
"""People in the moving Gaussians: their tracks over time and their 17 joints."""

from __future__ import annotations

from rfgs_core.pose.estimate import PoseEstimate, estimate_poses
from rfgs_core.pose.score import score_poses

__all__ = ["PoseEstimate", "estimate_poses", "score_poses"]
