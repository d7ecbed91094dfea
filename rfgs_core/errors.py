# SPDX-License-Identifier: Apache-2.0
"""Errors a user can act on."""

from __future__ import annotations


class RfgsError(Exception):
    """A mistake in the input or the machine's set-up: the message says what to do."""


class RfgsFormatError(RfgsError, ValueError):
    """A file that does not hold what its name or schema promises."""


class MissingToolError(RfgsError):
    """A program or library that is needed and not there; the message names the remedy."""
