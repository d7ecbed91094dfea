# SPDX-License-Identifier: Apache-2.0
"""`rfgs export`: a run's Gaussians as one PLY file."""

from __future__ import annotations

import logging
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import tyro

from rfgs_core.errors import RfgsError

if TYPE_CHECKING:
    from rfgs_core.render.view import TrainedRun

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class ExportArgs:
    """Writes static and moving Gaussians of one frame as a standard 3DGS PLY."""

    run: tyro.conf.Positional[Path]
    """Folder of a trained run."""
    out: Path
    """File to write, ending in .ply."""
    frame: int | None = None
    """Which frame; the first of the run if not given."""


def run(args: ExportArgs) -> int:
    """Writes the file; exit code 0."""
    from rfgs_core.run import open_run

    export_run(open_run(args.run), args)
    return 0


def export_run(trained: TrainedRun, args: ExportArgs) -> None:
    """Writes one frame of an opened run.

    Raises:
        RfgsError: The file name does not end in .ply, or the run has no such frame.
    """
    from rfgs_core.frames import listed
    from rfgs_core.gaussians.ply import write_ply
    from rfgs_core.render.view import colored_cloud, fitted_shader

    if args.out.suffix.lower() != ".ply":
        raise RfgsError(f"{args.out}: expected a file name ending in .ply")
    frame = trained.frames[0] if args.frame is None else args.frame
    if frame not in trained.frames:
        raise RfgsError(f"{args.run}: no frame {frame}; the run has {listed(trained.frames)}")
    shader = fitted_shader(trained)
    if shader is None:
        _LOG.warning("%s: no shader has been fitted, so the Gaussians are grey", args.run)
    cloud = colored_cloud(trained, frame, shader)
    write_ply(args.out, cloud)
    sys.stdout.write(f"{args.out}: {len(cloud)} Gaussians of frame {frame}\n")
