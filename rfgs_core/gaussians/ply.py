# SPDX-License-Identifier: Apache-2.0
"""Gaussians as PLY files that any viewer of 3D Gaussian splatting opens.

Properties in file order: x y z, nx ny nz (zero), f_dc_0..2, opacity (logit), scale_0..2 (natural
logarithm of metres), rot_0..3 (w first), and optionally rf_power_db. All float32.
"""

from __future__ import annotations

import io
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float32
from plyfile import PlyData, PlyElement

from rfgs_core.errors import RfgsFormatError
from rfgs_core.files import write_bytes
from rfgs_core.gaussians.model import FEATURE_DIM, Gaussians
from rfgs_core.ply_file import count_rows, read_elements
from rfgs_core.seals import BLANK, sealed

#: Value of the zeroth spherical harmonic, 1 / (2 √π): rgb = 0.5 + SH_C0 · f_dc.
SH_C0 = 0.28209479177387814

#: Extra property: power a Gaussian reflects [dB], absent in files of other programs.
POWER_PROPERTY = "rf_power_db"

_WHAT = "a PLY of Gaussians"
_COLUMNS = {
    "means": ("x", "y", "z"),
    "normals": ("nx", "ny", "nz"),
    "f_dc": ("f_dc_0", "f_dc_1", "f_dc_2"),
    "logit_opacities": ("opacity",),
    "log_scales": ("scale_0", "scale_1", "scale_2"),
    "quats": ("rot_0", "rot_1", "rot_2", "rot_3"),
}
_REQUIRED = {key: names for key, names in _COLUMNS.items() if key != "normals"}


@dataclass(frozen=True)
class GaussianCloud:
    """What a PLY file of Gaussians holds, in the file's own units."""

    means: Float32[np.ndarray, "M 3"]
    """Centres [m]."""
    quats: Float32[np.ndarray, "M 4"]
    """World-from-Gaussian rotations, w first."""
    log_scales: Float32[np.ndarray, "M 3"]
    """Natural logarithm of the standard deviations [m]."""
    logit_opacities: Float32[np.ndarray, "M"]
    """Logit of the opacity."""
    f_dc: Float32[np.ndarray, "M 3"]
    """Zeroth spherical-harmonic coefficient of the colour."""
    rf_power_db: Float32[np.ndarray, "M"] | None = None
    """Reflected power [dB], if the file tells."""

    def __len__(self) -> int:
        return int(self.means.shape[0])

    @property
    def rgb(self) -> Float32[np.ndarray, "M 3"]:
        """Colours, sRGB in [0, 1]."""
        return np.clip(0.5 + SH_C0 * self.f_dc, 0.0, 1.0).astype(np.float32)

    @staticmethod
    def join(first: GaussianCloud, second: GaussianCloud) -> GaussianCloud:
        """Both clouds, rows of `first` before rows of `second`.

        Powers are kept where they are known of every Gaussian.
        """
        both = [cloud for cloud in (first, second) if len(cloud)] or [second]
        power = [cloud.rf_power_db for cloud in both if cloud.rf_power_db is not None]
        names = ("means", "quats", "log_scales", "logit_opacities", "f_dc")
        return GaussianCloud(
            **{name: np.concatenate([getattr(cloud, name) for cloud in both]) for name in names},
            rf_power_db=np.concatenate(power) if len(power) == len(both) else None,
        )

    def to_gaussians(self, features: Float32[np.ndarray, "M 32"] | None = None) -> Gaussians:
        """The same Gaussians for computing; features live in another file, zero if not given."""
        if features is None:
            features = np.zeros((len(self), FEATURE_DIM), np.float32)
        return Gaussians(
            means=torch.from_numpy(self.means.copy()),
            quats=torch.from_numpy(self.quats.copy()),
            log_scales=torch.from_numpy(self.log_scales.copy()),
            logit_opacities=torch.from_numpy(self.logit_opacities.copy()),
            features=torch.from_numpy(np.asarray(features, np.float32).copy()),
        )


def cloud_of(
    gaussians: Gaussians,
    rgb: np.ndarray | None = None,
    rf_power_db: np.ndarray | None = None,
) -> GaussianCloud:
    """Gaussians with colours, ready for a file.

    Args:
        gaussians: M Gaussians.
        rgb: Colours in [0, 1], shape [M, 3]; mid-grey if not given.
        rf_power_db: Reflected power [dB], shape [M].

    Returns:
        The same values in float32 without features.
    """
    if rgb is None:
        rgb = np.full((len(gaussians), 3), 0.5)
    arrays = {
        name: value.detach().cpu().numpy().astype(np.float32)
        for name, value in gaussians.items()
        if name != "features"
    }
    f_dc = ((np.asarray(rgb, np.float64) - 0.5) / SH_C0).astype(np.float32)
    power = None if rf_power_db is None else np.asarray(rf_power_db, np.float32)
    return GaussianCloud(**arrays, f_dc=f_dc, rf_power_db=power)


def write_ply(path: Path, cloud: GaussianCloud) -> None:
    """Writes a binary little-endian PLY in one step, sealed in a comment.

    Raises:
        RfgsFormatError: An array has a wrong shape, a value is not finite or a quaternion is zero.
    """
    names = [name for group in _COLUMNS.values() for name in group]
    if cloud.rf_power_db is not None:
        names.append(POWER_PROPERTY)
    _check(cloud, path)
    table = np.zeros(len(cloud), dtype=[(name, "<f4") for name in names])
    for key, columns in _REQUIRED.items():
        values = getattr(cloud, key).reshape(len(cloud), len(columns))
        for index, column in enumerate(columns):
            table[column] = values[:, index]
    if cloud.rf_power_db is not None:
        table[POWER_PROPERTY] = cloud.rf_power_db
    stream, element = io.BytesIO(), PlyElement.describe(table, "vertex")
    PlyData([element], byte_order="<", comments=[BLANK]).write(stream)
    write_bytes(path, sealed(stream.getvalue()))


def read_ply(path: Path, seal: str | None = None) -> GaussianCloud:
    """Reads a PLY of Gaussians written here or by another program (f_rest_* is ignored).

    Args:
        path: The file.
        seal: What to do about a file that is not as `write_ply` wrote it; None takes any.

    Raises:
        RfgsError: The file does not exist.
        RfgsFormatError: It is not a PLY of Gaussians, is cut short or holds values that are
            not finite.
    """
    table = _vertex_table(path, seal)
    present = table.dtype.names or ()
    needed = [name for names in _REQUIRED.values() for name in names]
    missing = [name for name in needed if name not in present]
    if missing:
        raise RfgsFormatError(
            f"{path}: expected a PLY of Gaussians, but the vertex properties {missing} are missing"
        )
    lists = [name for name in present if table.dtype[name].hasobject]
    if lists:
        raise RfgsFormatError(
            f"{path}: expected numbers, but the vertex properties {lists} are lists"
        )
    values = {
        key: np.stack([np.asarray(table[name], np.float32) for name in names], axis=-1)
        for key, names in _REQUIRED.items()
    }
    values["logit_opacities"] = values["logit_opacities"][:, 0]
    power = np.asarray(table[POWER_PROPERTY], np.float32) if POWER_PROPERTY in present else None
    cloud = GaussianCloud(**values, rf_power_db=power)
    _check(cloud, path)
    return cloud


def count_ply(path: Path) -> int:
    """How many Gaussians a PLY says that it holds; its header alone is read.

    Raises:
        RfgsError: The file does not exist.
        RfgsFormatError: It is no PLY with vertices.
    """
    return count_rows(path, "vertex", _WHAT)


def _vertex_table(path: Path, seal: str | None) -> np.ndarray:
    data = read_elements(path, _WHAT, seal=seal)
    if "vertex" not in data:
        raise RfgsFormatError(f"{path}: expected {_WHAT}, with an element 'vertex'")
    return data["vertex"].data


def _check(cloud: GaussianCloud, path: Path) -> None:
    for field in fields(cloud):
        values = getattr(cloud, field.name)
        if values is None:
            continue
        width = len(_COLUMNS.get(field.name, ("",)))
        expected = (len(cloud),) if width == 1 else (len(cloud), width)
        if values.shape != expected:
            raise RfgsFormatError(
                f"{path}: {field.name} has shape {values.shape}, expected {expected}"
            )
        bad = np.flatnonzero(~np.isfinite(values.reshape(len(cloud), width)).all(axis=1))
        if bad.size:
            raise RfgsFormatError(
                f"{path}: {field.name} of {bad.size} Gaussians is not finite, first row {bad[0]}"
            )
    if len(cloud) and np.linalg.norm(cloud.quats, axis=1).min() == 0.0:
        raise RfgsFormatError(f"{path}: a rotation quaternion is zero; expected unit length")
