# SPDX-License-Identifier: GPL-3.0-or-later
"""Errors a user can act on."""

from __future__ import annotations

#: Messages show what was found; what is longer than this was no name or number [characters].
_LONGEST = 1200


class AddonError(Exception):
    """A mistake in the scene, a file or the arguments; the message says what to do."""

    def __str__(self) -> str:
        text = super().__str__()
        return text if len(text) <= _LONGEST else f"{text[:_LONGEST]} …"


def disk_message(error: OSError) -> str:
    """What the disk refused: no right to write, no space, a folder that is gone."""
    names = [str(name) for name in (error.filename, error.filename2) if name]
    place = names[-1] if names else "a file"
    return f"{place}: {error.strerror or error}; choose another place or make room there"
