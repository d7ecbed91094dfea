# SPDX-License-Identifier: Apache-2.0
"""What the fit of a neural field is asked to do."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

#: nerf: sines of the place; mip: sines averaged over a volume; ngp: a hash table; plain: the place
#: itself, which the other three are held against.
FieldKind = Literal["nerf", "mip", "ngp", "plain"]
#: features: the paper's, φ at sample points; propagation: delay–angle powers of scatterers.
FieldObjective = Literal["features", "propagation"]


@dataclass(frozen=True, kw_only=True)
class FieldSettings:
    """One neural field and its fit to a frame."""

    kind: FieldKind = "nerf"
    """What the network reads of a place."""
    objective: FieldObjective = "features"
    """What it is fitted to."""
    prior: bool = False
    """Whether its density is multiplied by what RF-GS takes for likely of bodies at the start."""
    steps: int = 400
    """Adam steps."""
    learning_rate: float = 5e-3
    """Rate of Adam at the start; it falls to a tenth."""
    octaves: int = 5
    """Frequencies of sines; ignored by `ngp`."""
    width: int = 64
    """Width of hidden layers."""
    layers: int = 3
    """Hidden layers; `ngp` has one less, as its table does the rest."""
    finest_m: float = 0.06
    """Cell of the finest level of a hash table [m]."""
    rays: int = 256
    """Rays per step of the objective `features` (the paper: 1,024)."""
    samples_per_ray: int = 32
    """Places per ray."""
    contrast: float = 2.0
    """Rays end at sample points with a chance that goes with this power of ‖φ‖."""
    passing: float = 2.0
    """Weight of the optical depth of rays through any sample points, which may pass."""
    evenness: float = 0.0
    """Weight of the mean square of log densities in the objective `propagation`: how far from even
    the field is expected to be."""
    scatterers: int = 3000
    """Scatterers per step of the objective `propagation`."""
    seed: int = 0
    """Root seed."""
