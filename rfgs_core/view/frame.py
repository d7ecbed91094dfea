# SPDX-License-Identifier: Apache-2.0
"""What the viewer knows of one frame: a row per Gaussian, and the true surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float32, Float64, Int32
from scipy.spatial import KDTree

from rfgs_core.evaluate.geometry import reference_points
from rfgs_core.predict.echoes import reflectors
from rfgs_core.render.shader import Shader
from rfgs_core.render.view import colored_cloud
from rfgs_core.run import Run
from rfgs_core.run.static import has_static_set, read_static_set
from rfgs_core.seeds import sub_seed

#: Distances to the true surface are not told apart beyond this [m].
FARTHEST_M = 1.0


@dataclass(frozen=True)
class Mesh:
    """Triangles."""

    vertices: Float32[np.ndarray, "vertex 3"]
    """Positions [m]."""
    faces: Int32[np.ndarray, "face 3"]
    """Rows of `vertices`."""


@dataclass(frozen=True)
class ShownFrame:
    """M Gaussians of a frame, the static ones first; NaN where a value is not known."""

    frame: int
    """Blender frame number."""
    means: Float32[np.ndarray, "M 3"]
    """Centres [m]."""
    covariances: Float32[np.ndarray, "M 3 3"]
    """Covariances [m²]."""
    opacities: Float32[np.ndarray, "M"]
    """Opacities in (0, 1)."""
    rgb: Float32[np.ndarray, "M 3"]
    """Display colours of the shader, sRGB in [0, 1]; grey where it is not fitted."""
    power_db: Float32[np.ndarray, "M"]
    """Reflected power [dB]."""
    phase_rad: Float32[np.ndarray, "M"]
    """Phase of the complex reflectivity [rad], in (−π, π]."""
    error_m: Float32[np.ndarray, "M"]
    """Distance of the centre to the true moving surface [m], at most `FARTHEST_M`."""
    truth: Mesh | None
    """True surface of what moves; None where the data does not tell."""
    static: int = 0
    """How many of the Gaussians are static."""
    sigma_m: Float32[np.ndarray, "M"] | None = None
    """How far the limb of each is expected to be off [m]; None where limbs were not told."""

    def __len__(self) -> int:
        return len(self.means)

    def rows(self, min_opacity: float, weakest_db: float = -np.inf) -> Bool[np.ndarray, "M"]:
        """Gaussians to show.

        Args:
            min_opacity: Those with less opacity are left out.
            weakest_db: So are those known to reflect less power [dB].
        """
        return (self.opacities >= min_opacity) & ~(self.power_db < weakest_db)


def load_frame(run: Run, frame: int, shader: Shader | None) -> ShownFrame:
    """Reads a frame of a run and, where the dataset has it, the true surface.

    Raises:
        RfgsError: The run has no such frame.
        RfgsFormatError: A file is damaged.
    """
    attributes = run.attributes(frame)
    cloud = colored_cloud(run, frame, shader)
    gaussians = cloud.to_gaussians()
    truth = true_surface(run, frame)
    static = len(cloud) - len(attributes["features"])
    still = still_values(run, static)
    return ShownFrame(
        frame=frame,
        means=cloud.means,
        covariances=gaussians.covariances.numpy(),
        opacities=gaussians.opacities.numpy(),
        rgb=cloud.rgb,
        power_db=_behind(still[0], attributes["rf_power_db"]),
        phase_rad=_behind(still[1], _phase_rad(run, frame)),
        error_m=_behind(np.full(static, np.nan), distance_m(cloud.means[static:], truth)),
        truth=truth,
        static=static,
        sigma_m=_behind(np.full(static, np.nan), attributes["sigma_m"])
        if "sigma_m" in attributes
        else None,
    )


def true_surface(run: Run, frame: int) -> Mesh | None:
    """The true mesh of what moves, None where the data does not tell."""
    files = run.sequence.files
    if not (files.topology.is_file() and files.geometry(frame).is_file()):
        return None
    vertices, faces, _ = run.sequence.moving_mesh(frame)
    return Mesh(vertices, faces) if len(faces) else None


def distance_m(points: Float[np.ndarray, "M 3"], truth: Mesh | None) -> Float32[np.ndarray, "M"]:
    """Distance to the true surface [m], to as many samples as evaluation takes of it.

    `FARTHEST_M` for whatever is farther; NaN where there is no truth.
    """
    if truth is None:
        return np.full(len(points), np.nan, np.float32)
    samples = reference_points(truth.vertices, truth.faces, seed=sub_seed(0, "view"))
    # A bound saves most of the search where Gaussians fill a room.
    found = KDTree(samples).query(points, distance_upper_bound=FARTHEST_M)[0]
    return np.minimum(found, FARTHEST_M).astype(np.float32)


def _phase_rad(run: Run, frame: int) -> Float64[np.ndarray, "M"]:
    """Phase of what the moving Gaussians reflect, at the middle of the band."""
    gaussians = run.head.radio_gaussians(run.moving(frame))
    return reflectors(gaussians, run.sequence.radio_spec(run.config.radio).freq_hz).phase_rad


def still_values(run: Run, count: int) -> Float32[np.ndarray, "2 count"]:
    """Reflected power [dB] and phase [rad] of the static Gaussians; NaN where a PLY is all."""
    if not has_static_set(run.path):
        return np.full((2, count), np.nan, np.float32)
    static = read_static_set(run.path)
    return np.stack([static.power_db, np.angle(static.gamma)]).astype(np.float32)


def _behind(static: np.ndarray, moving: np.ndarray) -> Float32[np.ndarray, "M"]:
    """Values of the static Gaussians, then those of the moving ones."""
    return np.concatenate([static, moving]).astype(np.float32)
