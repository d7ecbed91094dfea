# SPDX-License-Identifier: Apache-2.0
"""Decodes what the radio sees of a Gaussian from its 32 features, linearly and shared.

Three orthonormal directions of feature space hold real and imaginary reflectivity and the
logit of ρ, the ratio of reflecting to visible extent (Σ_rf = ρ² Σ). The other 29 stay free
for what the encoder says. Orthonormal rows make the inverse exact: writing a reflectivity
into the features changes them by the smallest amount that does it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Complex, Float
from torch import Tensor

from rfgs_core.arrays import Shape
from rfgs_core.gaussians import FEATURE_DIM, Gaussians
from rfgs_core.propagation import RadioGaussians

#: Steepness of the step from a Gaussian's lit to its dark side, per unit of cosine.
SHARPNESS = 6.0
#: ρ starts where k · 2 · s · ρ has this value: larger ones let nothing reflect.
START_PHASE_SPREAD = 0.5
#: Shapes of the arrays of a head in a file.
HEAD_SHAPES: dict[str, Shape] = {
    "directions": (3, FEATURE_DIM),
    "gamma_scale_m": (),
    "rho_logit": (),
}
#: Their types.
HEAD_TYPES = {"directions": "f4", "gamma_scale_m": "f8", "rho_logit": "f8"}


def dimming(cosine: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
    """What the amplitude of a Gaussian is divided by towards an antenna: 1 + e^{−6 cos}.

    Args:
        cosine: `SHARPNESS` times the cosine between its normal and the way to the antenna.
    """
    return 1.0 + np.exp(-cosine)


@dataclass(frozen=True)
class RadioHead:
    """The shared linear head; three directions and two scales."""

    directions: Float[Tensor, "3 32"]
    """Orthonormal rows: real part, imaginary part, logit of ρ."""
    gamma_scale_m: float
    """Reflectivity [m] of a feature component of one."""
    rho_logit: float
    """Logit of ρ where the feature component is zero."""

    @staticmethod
    def create(seed: int, wavelength_m: float, scale_m: float, gamma_scale_m: float) -> RadioHead:
        """A head whose ρ suits Gaussians of standard deviation `scale_m`."""
        matrix = np.random.default_rng(seed).standard_normal((FEATURE_DIM, 3))
        directions = torch.from_numpy(np.linalg.qr(matrix)[0].T.copy()).float()
        rho = min(START_PHASE_SPREAD * wavelength_m / (4 * math.pi * scale_m), 0.99)
        return RadioHead(directions, gamma_scale_m, math.log(rho / (1 - rho)))

    def arrays(self) -> dict[str, np.ndarray]:
        """The head as arrays for a file, named as its fields."""
        return {
            "directions": self.directions.numpy(),
            "gamma_scale_m": np.array(self.gamma_scale_m),
            "rho_logit": np.array(self.rho_logit),
        }

    @staticmethod
    def of_arrays(arrays: Mapping[str, np.ndarray], prefix: str = "") -> RadioHead:
        """The head that `arrays` wrote; `prefix` stands before each name."""
        return RadioHead(
            torch.from_numpy(arrays[f"{prefix}directions"]),
            float(arrays[f"{prefix}gamma_scale_m"]),
            float(arrays[f"{prefix}rho_logit"]),
        )

    def gamma(self, features: Float[Tensor, "M 32"]) -> Complex[Tensor, "M"]:
        """Complex reflectivity [m]."""
        parts = features @ self.directions[:2].T * self.gamma_scale_m
        return torch.complex(parts[:, 0], parts[:, 1])

    def rho(self, features: Float[Tensor, "M 32"]) -> Float[Tensor, "M"]:
        """Ratio of reflecting to visible extent, in (0, 1)."""
        return torch.sigmoid(features @ self.directions[2] + self.rho_logit)

    def with_gamma(
        self, features: Float[Tensor, "M 32"], gamma: Complex[Tensor, "M"]
    ) -> Float[Tensor, "M 32"]:
        """Features of the smallest change that decode to `gamma`."""
        wanted = torch.stack([gamma.real, gamma.imag], dim=1) / self.gamma_scale_m
        have = features @ self.directions[:2].T
        return features + (wanted.to(features.dtype) - have) @ self.directions[:2]

    def without_readings(self, features: Float[Tensor, "M 32"]) -> Float[Tensor, "M 32"]:
        """Features moved into the 29 directions that the head does not read."""
        return features - features @ self.directions.T @ self.directions

    def radio_gaussians(self, gaussians: Gaussians) -> RadioGaussians:
        """The Gaussians as the propagation model takes them."""
        scales = gaussians.scales
        return RadioGaussians(
            means=gaussians.means.double(),
            quats=gaussians.quats,
            scales=scales,
            scales_rf=scales * self.rho(gaussians.features)[:, None],
            gamma=self.gamma(gaussians.features)[:, None],
            alpha=gaussians.opacities,
            normals=gaussians.rotations[:, :, 2],
            sharpness=SHARPNESS,
        )
