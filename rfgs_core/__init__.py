# SPDX-License-Identifier: Apache-2.0
"""RF-GS core: datasets of radio channels, radio Gaussians, training and evaluation."""

from __future__ import annotations

__version__ = "0.1.0"
