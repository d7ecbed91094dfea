# SPDX-License-Identifier: Apache-2.0
"""Datasets: channels, pictures and geometry of scenes with people, on disk."""

from __future__ import annotations

from rfgs_core.dataset.reader import Dataset, open_dataset
from rfgs_core.dataset.sequence import Sequence

__all__ = ["Dataset", "Sequence", "open_dataset"]
