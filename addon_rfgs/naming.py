# SPDX-License-Identifier: GPL-3.0-or-later
"""Names that are safe in file names and unique within a bundle."""

from __future__ import annotations

import re


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
