# SPDX-License-Identifier: Apache-2.0
"""Geometry of propagation without a tracer: paths found exhaustively, in double precision."""

from rfgs_core.simulate.faces import Faces, faces_of
from rfgs_core.simulate.legs import Legs, mirror_legs
from rfgs_core.simulate.specular import SpecularPaths, specular_paths
from rfgs_core.simulate.surroundings import Sight, Surroundings, surroundings

__all__ = [
    "Faces",
    "Legs",
    "Sight",
    "SpecularPaths",
    "Surroundings",
    "faces_of",
    "mirror_legs",
    "specular_paths",
    "surroundings",
]
