# SPDX-License-Identifier: GPL-3.0-or-later
"""Gaussians of `rfgs live` as a cloud that moves while radios send."""
