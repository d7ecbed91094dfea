# SPDX-License-Identifier: GPL-3.0-or-later
"""Errors a user can act on."""

from __future__ import annotations


class AddonError(Exception):
    """A mistake in the scene, a file or the arguments; the message says what to do."""
