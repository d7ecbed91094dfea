# SPDX-License-Identifier: GPL-3.0-or-later
"""Gaussians brought back into Blender."""
