# SPDX-License-Identifier: Apache-2.0
"""Errors a user can act on."""

from __future__ import annotations

#: Messages show what was found; what is longer than this was no name or number [characters].
_LONGEST = 1200


class RfgsError(Exception):
    """A mistake in the input or the machine's set-up: the message says what to do.

    It is one line of printable text, whatever the names and values in it hold.
    """

    def __str__(self) -> str:
        text = "".join(char if char.isprintable() else "?" for char in super().__str__())
        return text if len(text) <= _LONGEST else f"{text[:_LONGEST]} …"


class RfgsFormatError(RfgsError, ValueError):
    """A file that does not hold what its name or schema promises."""


class MissingToolError(RfgsError):
    """A program or library that is needed and not there; the message names the remedy."""
