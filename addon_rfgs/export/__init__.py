# SPDX-License-Identifier: GPL-3.0-or-later
"""Scene bundles and ground truth: what leaves Blender."""
