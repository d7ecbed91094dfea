# SPDX-License-Identifier: Apache-2.0
"""Geometry of propagation without a tracer: specular paths found exhaustively, in double."""

from rfgs_core.simulate.faces import Faces, faces_of
from rfgs_core.simulate.specular import SpecularPaths, specular_paths

__all__ = ["Faces", "SpecularPaths", "faces_of", "specular_paths"]
