# SPDX-License-Identifier: Apache-2.0
"""The static set of a run on disk: a PLY like that of a frame, its features, and its head."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rfgs_core.arrays import Shape, load_arrays, save_arrays
from rfgs_core.background.static_set import StaticSet
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.gaussians import FEATURE_DIM, Gaussians
from rfgs_core.gaussians.ply import GaussianCloud, cloud_of, read_ply, write_ply
from rfgs_core.model.head import HEAD_SHAPES, HEAD_TYPES, RadioHead
from rfgs_core.settings import TrainConfig

#: Decodes the features of the static set; written last.
HEAD_FILE = "static_head.npz"
_SHAPES: dict[str, Shape] = {
    "features": ("M", FEATURE_DIM),
    "gamma": ("M", 1),
    "rf_power_db": ("M",),
}
_TYPES = {"features": "f4", "gamma": "c8", "rf_power_db": "f4"}
_REMEDY = f"delete {HEAD_FILE} and run the same `rfgs train` again"


def static_ply(run: Path) -> Path:
    """File of a run's static Gaussians."""
    return run / "gaussians" / "static.ply"


def need_phases(config: TrainConfig) -> None:
    """Refuses a static set of a radio that reports no phases.

    Raises:
        RfgsError: Gaussians are asked for that cannot be fitted.
    """
    if config.static_set and config.observe != "complex":
        raise RfgsError(
            f"--static-set {config.static_set}: expected the phases that --observe complex "
            f"reports, found --observe {config.observe}; leave one of them out"
        )


def write_static_set(run: Path, static: StaticSet) -> None:
    """Writes the set; its head comes last and marks it as done."""
    power_db = static.power_db
    write_ply(static_ply(run), cloud_of(static.gaussians, rf_power_db=power_db))
    save_arrays(
        static_ply(run).with_suffix(".features.npz"),
        {
            "features": static.gaussians.features.numpy(),
            "gamma": static.gamma[:, None],
            "rf_power_db": power_db,
        },
    )
    save_arrays(run / HEAD_FILE, static.head.arrays())


def has_static_set(run: Path) -> bool:
    """Whether a run holds a whole static set."""
    return (run / HEAD_FILE).exists()


def read_static_set(run: Path) -> StaticSet:
    """The static set of a run that has one.

    Raises:
        RfgsError: A file is missing.
        RfgsFormatError: A file is damaged, or they do not belong together.
    """
    stored = load_arrays(run / HEAD_FILE, _REMEDY, HEAD_SHAPES, types=HEAD_TYPES)
    head = RadioHead.of_arrays(stored)
    path = static_ply(run).with_suffix(".features.npz")
    features = load_arrays(path, _REMEDY, _SHAPES, types=_TYPES)["features"]
    cloud = static_cloud(run)
    if len(cloud) != len(features):
        raise RfgsFormatError(
            f"{static_ply(run)}: holds {len(cloud)} Gaussians, but there are features of "
            f"{len(features)}; {_REMEDY}"
        )
    return StaticSet(cloud.to_gaussians(features), head)


def static_gaussians(run: Path) -> Gaussians:
    """Static Gaussians of a run; those of a foreign PLY have features of zero."""
    if has_static_set(run):
        return read_static_set(run).gaussians
    cloud = static_cloud(run)
    return cloud.to_gaussians(np.zeros((len(cloud), FEATURE_DIM), dtype=np.float32))


def static_cloud(run: Path) -> GaussianCloud:
    """Static Gaussians as their PLY holds them; none where a run without a set has no such file.

    Raises:
        RfgsFormatError: The file is damaged, or the run has a set and the file is missing.
    """
    path = static_ply(run)
    if not has_static_set(run):
        return read_ply(path) if path.exists() else cloud_of(Gaussians.none())
    if not path.exists():
        raise RfgsFormatError(f"{path}: no such file; {_REMEDY}")
    return read_ply(path, _REMEDY)
