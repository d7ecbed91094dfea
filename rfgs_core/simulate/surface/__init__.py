# SPDX-License-Identifier: Apache-2.0
"""Scattering surfaces: points bound to meshes, and facets."""
