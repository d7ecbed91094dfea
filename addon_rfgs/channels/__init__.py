# SPDX-License-Identifier: GPL-3.0-or-later
"""Measured and predicted channels of a link as an image."""
