# SPDX-License-Identifier: Apache-2.0
"""Paths found exhaustively by images, in double precision: faces, sight, specular paths."""

from rfgs_core.simulate.geometry.faces import Faces, faces_of
from rfgs_core.simulate.geometry.legs import Legs, mirror_legs
from rfgs_core.simulate.geometry.specular import SpecularPaths, specular_paths
from rfgs_core.simulate.geometry.surroundings import Sight, Surroundings, surroundings

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
