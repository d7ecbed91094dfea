# SPDX-License-Identifier: Apache-2.0
"""The user's cache: a folder that nobody else can write, or know the contents of."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from rfgs_core.errors import RfgsError


def cache_folder(name: str) -> Path:
    """A folder of the user's cache, made if need be; $XDG_CACHE_HOME, else ~/.cache.

    What is kept there is loaded as code or believed, so it is never a predictable name in a place
    that is shared, such as the temporary folder.

    Args:
        name: What is kept there.

    Raises:
        RfgsError: It cannot be made, or belongs to somebody else.
    """
    root = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "rfgs"
    try:
        for folder in (root, root / name):
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            about = folder.lstat()
            if not stat.S_ISDIR(about.st_mode) or about.st_uid != os.geteuid():
                raise RfgsError(
                    f"{folder}: expected a folder of yours for caches, found a link or somebody "
                    "else's; remove it, or set XDG_CACHE_HOME"
                )
            if stat.S_IMODE(about.st_mode) != 0o700:
                folder.chmod(0o700)
    except OSError as error:
        raise RfgsError(
            f"{root / name}: no cache can be made there ({error.strerror}); set XDG_CACHE_HOME to "
            "a folder of yours"
        ) from error
    return root / name
