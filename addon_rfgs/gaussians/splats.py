# SPDX-License-Identifier: GPL-3.0-or-later
"""3D Gaussians of a PLY in the 3DGS convention, with activations applied."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import AddonError
from .ply import Columns, read_columns, stacked

#: First spherical-harmonics basis function, 1/(2·sqrt(π)): colour = 0.5 + C0·f_dc.
SH_C0 = 0.28209479177387814
#: Positions beyond this are damage, not scenes [m].
FARTHEST_M = 1e7
#: Logarithms of scales beyond this are damage, or scales that are no logarithms.
LARGEST_LOG_SCALE = 10.0

POSITION = ("x", "y", "z")
SCALE = ("scale_0", "scale_1", "scale_2")
ROTATION = ("rot_0", "rot_1", "rot_2", "rot_3")
COLOR = ("f_dc_0", "f_dc_1", "f_dc_2")
_NEEDED = (*POSITION, "opacity", *SCALE, *ROTATION)


@dataclass(frozen=True)
class Cloud:
    """Gaussians with activations applied, and the properties of the file."""

    means: np.ndarray
    """Centres [m], float32 [M, 3]."""
    scales: np.ndarray
    """Standard deviations along the own axes [m], float32 [M, 3]."""
    quats: np.ndarray
    """Unit quaternions, w first, float32 [M, 4]."""
    opacities: np.ndarray
    """Opacities in [0, 1], float32 [M]."""
    colors: np.ndarray
    """Display colours, sRGB-encoded as 3DGS trains them, in [0, 1], float32 [M, 3]."""
    columns: Columns
    """Every property as the file holds it."""

    def __len__(self) -> int:
        return len(self.means)


def read_gaussians(path: Path) -> Cloud:
    """Reads a 3DGS PLY: logit opacity, log scales, quaternion w first, colour in f_dc.

    Gaussians without colour are grey, as the convention's zero f_dc means.

    Raises:
        AddonError: The file is missing, not such a PLY, truncated or holds bad numbers.
    """
    columns = read_columns(path)
    missing = [name for name in _NEEDED if name not in columns]
    if missing:
        raise AddonError(f"{path}: not a 3DGS PLY, vertices lack {', '.join(missing)}")
    means, log_scales = stacked(columns, POSITION), stacked(columns, SCALE)
    logits, quats = stacked(columns, ["opacity"])[:, 0], stacked(columns, ROTATION)
    colored = all(name in columns for name in COLOR)
    f_dc = stacked(columns, COLOR) if colored else np.zeros_like(means)
    for name, values in (
        ("position", means), ("scale", log_scales), ("rotation", quats), ("colour", f_dc),
    ):  # fmt: skip
        if not np.isfinite(values).all():
            raise AddonError(f"{path}: {name} holds numbers that are not finite")
    if np.isnan(logits).any() or (log_scales > LARGEST_LOG_SCALE).any():
        raise AddonError(f"{path}: opacity or scale is out of range; expected logits and logs")
    if (np.abs(means) > FARTHEST_M).any():
        raise AddonError(f"{path}: a position is farther than {FARTHEST_M:.0e} m; expected metres")
    return Cloud(
        means=means,
        scales=np.exp(log_scales),
        quats=_unit(quats),
        opacities=1 / (1 + np.exp(-np.clip(logits, -60, 60))),
        colors=np.clip(0.5 + SH_C0 * f_dc, 0, 1),
        columns=columns,
    )


def _unit(quats: np.ndarray) -> np.ndarray:
    """Quaternions of length one; those of length zero turn nothing."""
    wide = quats.astype(np.float64)
    length = np.sqrt(np.einsum("ij,ij->i", wide, wide))[:, None]
    turned = wide / np.where(length > 0, length, 1)
    return np.where(length > 0, turned, [1.0, 0.0, 0.0, 0.0]).astype(np.float32)
