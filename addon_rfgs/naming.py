# SPDX-License-Identifier: GPL-3.0-or-later
"""Names that are safe in file names, and names that look like others."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable


class Names:
    """Hands out names of letters, digits, `_` and `-`, each only once.

    A double underscore separates object from material in file names, so none is handed out.
    """

    def __init__(self) -> None:
        self._taken: set[str] = set()

    def unique(self, text: str) -> str:
        """A safe name close to `text`."""
        base = re.sub(r"_{2,}", "_", re.sub(r"[^A-Za-z0-9_-]", "_", text)).strip("_") or "unnamed"
        name, count = base, 1
        while name in self._taken:
            count += 1
            name = f"{base}-{count}"
        self._taken.add(name)
        return name


def closest(name: str, known: Iterable[str]) -> str:
    """The end of a message about an unknown name: which known ones look like it.

    Example:
        >>> closest("wod", ["wood", "glass"])
        "; did you mean 'wood'?"
    """
    names = sorted(known)
    plain = {other.lower(): other for other in names}
    near = difflib.get_close_matches(name.strip("*?").lower(), plain, n=3, cutoff=0.5)
    if near:
        return f"; did you mean {' or '.join(repr(plain[other]) for other in near)}?"
    shown = ", ".join(names[:8]) + (", …" if len(names) > 8 else "")
    return f"; expected one of {shown}" if names else ""
