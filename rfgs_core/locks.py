# SPDX-License-Identifier: Apache-2.0
"""One program at a time in a folder; the lock ends with the program, however it ends."""

from __future__ import annotations

import errno
import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rfgs_core.errors import RfgsError

#: What file systems say that know no locks; there the user must take care.
_NO_LOCKS = (errno.ENOSYS, errno.ENOLCK, errno.EOPNOTSUPP, errno.EBADF, errno.EINVAL)


@contextmanager
def alone_in(place: Path, folder: Path, program: str) -> Iterator[None]:
    """Keeps other programs out of a folder while the block runs.

    Args:
        place: File or folder that carries the lock; a folder needs no file of its own.
        folder: Folder that is worked on, for the message.
        program: Who works there, for the message.

    Raises:
        RfgsError: Another one is at work there.
    """
    # Of a file in a network's file system a lock is only had by who may write.
    handle = os.open(place, os.O_RDONLY if place.is_dir() else os.O_RDWR)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            if error.errno not in _NO_LOCKS:
                raise RfgsError(
                    f"{folder}: another {program} is working on it; wait until it ends, or choose "
                    "another --out"
                ) from error
        yield
    finally:
        os.close(handle)
