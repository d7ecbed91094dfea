# SPDX-License-Identifier: Apache-2.0
"""`rfgs-factory convert`."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import tyro


@dataclass(frozen=True)
class ConvertArgs:
    """Writes a dataset in another tool's format.

    nerfstudio and d-nerf: pictures with cameras and time. colmap: the first frame's pictures as a
    text model with points. nerf2: angular spectra per receiving array. mat: channels and labels
    for MATLAB. DeepMIMO is left out: its scenarios store single rays with their angles, while a
    dataset stores their sum.
    """

    dataset: tyro.conf.Positional[Path]
    """Folder of the dataset."""
    to: Literal["nerfstudio", "d-nerf", "colmap", "nerf2", "mat"]
    """Format."""
    out: Path
    """Folder to make."""
    sequence: str | None = None
    """Which sequence; needed only if there are several."""


def run(args: ConvertArgs) -> int:
    """Converts one sequence."""
    from dataset_factory.convert import convert

    convert(args.dataset, args.to, args.out, args.sequence)
    sys.stdout.write(f"{args.out}: written\n")
    return 0
