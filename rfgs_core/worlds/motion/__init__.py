# SPDX-License-Identifier: Apache-2.0
"""Random human motions from joint angles: seeded, within human limits."""

from rfgs_core.worlds.motion.families import FAMILIES, random_motion
from rfgs_core.worlds.motion.motion import Motion

__all__ = ["FAMILIES", "Motion", "random_motion"]
