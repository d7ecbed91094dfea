# SPDX-License-Identifier: Apache-2.0
"""Random human motions from joint angles, seeded and within human limits, and recorded ones."""

from rfgs_core.worlds.motion.families import FAMILIES, random_motion
from rfgs_core.worlds.motion.motion import Motion
from rfgs_core.worlds.motion.recorded import RECORDED, KeptRecording, recorded_motion

__all__ = ["FAMILIES", "RECORDED", "KeptRecording", "Motion", "random_motion", "recorded_motion"]
