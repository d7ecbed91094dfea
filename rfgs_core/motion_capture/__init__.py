# SPDX-License-Identifier: Apache-2.0
"""Motion capture: files of recorded motions, and such motions on bodies of other proportions."""

from rfgs_core.motion_capture.read import read_recording
from rfgs_core.motion_capture.recording import Recording
from rfgs_core.motion_capture.retarget import Retargeted, retarget

__all__ = ["Recording", "Retargeted", "read_recording", "retarget"]
