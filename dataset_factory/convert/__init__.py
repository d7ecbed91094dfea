# SPDX-License-Identifier: Apache-2.0
"""Writes datasets in the formats of other tools, one module per format."""

from __future__ import annotations

import importlib
from pathlib import Path

from rfgs_core.dataset import Sequence, open_dataset
from rfgs_core.errors import RfgsError
from rfgs_core.files import replacing_folder

#: Format → module below this package, and what a dataset must hold for it.
FORMATS: dict[str, tuple[str, tuple[str, ...]]] = {
    "nerfstudio": ("nerfstudio", ("images", "depth", "mask", "geometry")),
    "d-nerf": ("d_nerf", ("images",)),
    "colmap": ("colmap", ("images", "depth", "mask", "geometry")),
    "coco": ("coco", ("images", "mask", "geometry")),
    "nerf2": ("nerf2", ("csi",)),
    "mat": ("mat", ("csi", "csi_static")),
    "deepmimo": ("deepmimo", ("paths",)),
}


def convert(path: Path, target: str, out: Path, sequence_name: str | None = None) -> None:
    """Converts one sequence.

    Args:
        path: Folder of the dataset.
        target: One of `FORMATS`.
        out: Folder to make; appears whole or not at all.
        sequence_name: Which sequence; None takes the only one.

    Raises:
        RfgsError: The format is unknown, the dataset lacks something it needs, or `out` exists.
    """
    if target not in FORMATS:
        raise RfgsError(f"--to {target}: expected one of {', '.join(FORMATS)}")
    module, needed = FORMATS[target]
    dataset = open_dataset(path)
    dataset.need(*needed)
    sequence = dataset.sequence(sequence_name)
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise RfgsError(f"{out}: exists already; choose another --out")
    if out.resolve().is_relative_to(path.resolve()):
        raise RfgsError(f"{out}: inside the dataset itself; choose another --out")
    with replacing_folder(out) as temporary:
        _write(module, sequence, temporary)


def _write(module: str, sequence: Sequence, out: Path) -> None:
    importlib.import_module(f"dataset_factory.convert.{module}").write(sequence, out)
