# SPDX-License-Identifier: GPL-3.0-or-later
"""RF-Blender scenes: builders, the .blend files they make, and their catalogue."""
