# SPDX-License-Identifier: Apache-2.0
"""Reads motion capture, whichever format it has."""

from __future__ import annotations

from pathlib import Path

from rfgs_core.errors import RfgsFormatError
from rfgs_core.motion_capture.bvh import read_bvh
from rfgs_core.motion_capture.clip import read_clip
from rfgs_core.motion_capture.joints import match_joints
from rfgs_core.motion_capture.recording import Recording

#: Names of clips in DeepMimic's format end so; others are BVH.
_CLIPS = (".txt", ".json")


def read_recording(path: Path) -> Recording:
    """Reads a `.bvh`, or a clip in DeepMimic's format (`.txt`, `.json`).

    Raises:
        RfgsFormatError: The file is no such recording of a person, or is damaged.
    """
    recording = (read_clip if path.suffix.lower() in _CLIPS else read_bvh)(path)
    try:
        match_joints(recording)
    except RfgsFormatError as error:
        raise RfgsFormatError(f"{path}: {error}") from error
    return recording
