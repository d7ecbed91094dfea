# SPDX-License-Identifier: Apache-2.0
"""Captures of real radios: one canonical result, whatever wrote the file."""

from __future__ import annotations

from rfgs_core.capture.model import Capture, Reading
from rfgs_core.capture.readers import READERS, Reader, detect, read_capture

__all__ = ["READERS", "Capture", "Reader", "Reading", "detect", "read_capture"]
