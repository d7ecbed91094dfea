# SPDX-License-Identifier: GPL-3.0-or-later
"""Datasets and trainings started from Blender, run by a Python environment outside of it."""
