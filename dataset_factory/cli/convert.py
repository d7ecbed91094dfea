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
    text model with points. coco: people with masks, boxes and keypoints. nerf2: angular spectra per
    receiving array. mat: channels and labels for MATLAB. deepmimo: the paths of a dataset made with
    `generate --paths`, a scenario per radio and a scene per frame; put them into the folder
    deepmimo_scenarios and load them by radio.
    """

    dataset: tyro.conf.Positional[Path]
    """Folder of the dataset."""
    to: Literal["nerfstudio", "d-nerf", "colmap", "coco", "nerf2", "mat", "deepmimo"]
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
