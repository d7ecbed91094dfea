# SPDX-License-Identifier: GPL-3.0-or-later
"""Traced paths of a dataset, shown as curves."""
