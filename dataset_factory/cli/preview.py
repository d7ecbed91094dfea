# SPDX-License-Identifier: Apache-2.0
"""`rfgs-factory preview`."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import tyro


@dataclass(frozen=True)
class PreviewArgs:
    """Draws pictures and channels of a dataset into one HTML page."""

    dataset: tyro.conf.Positional[Path]
    """Folder of the dataset."""
    out: Path | None = None
    """Folder of the preview; default: DATASET/log/preview, which checksums leave out."""
    sequence: str | None = None
    """Which sequence; needed only if there are several."""


def run(args: PreviewArgs) -> int:
    """Draws the page and prints where it is."""
    from dataset_factory.preview import preview

    page = preview(args.dataset, args.out, args.sequence)
    sys.stdout.write(f"{page}\n")
    return 0
