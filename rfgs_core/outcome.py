# SPDX-License-Identifier: Apache-2.0
"""How a command ends: the one place where errors become a line on the terminal."""

from __future__ import annotations

import errno
import os
import select
import sys
from collections.abc import Callable

from rfgs_core.errors import RfgsError
from rfgs_core.extras import how_to_install
from rfgs_core.interrupts import STOPPED, say_stopped

#: The user named a place that is not theirs, no folder, or no file.
_WRONG_PLACE = (
    *(errno.EACCES, errno.EPERM, errno.EROFS),
    *(errno.EISDIR, errno.ENOTDIR, errno.EEXIST, errno.ENAMETOOLONG),
)


def run_cli(command: Callable[[], int | None]) -> int:
    """Runs a command and turns user errors into one clear line.

    Args:
        command: The command; its return value is the exit code, None meaning 0.

    Returns:
        Exit code: 2 for an `RfgsError`, a package of an extra that is not installed, a full disk
        or a place that cannot be written or read, 130 after Ctrl-C; 1 where whoever read the
        output has stopped.
    """
    try:
        return _said(command)
    except RfgsError as error:
        sys.stderr.write(f"error: {error}\n")
        return 2
    except KeyboardInterrupt:
        say_stopped()
        return STOPPED
    except ModuleNotFoundError as error:
        remedy = how_to_install(error.name or "")
        if remedy is None:
            raise
        sys.stderr.write(f"error: {remedy}\n")
        return 2
    except BrokenPipeError:
        if not _nobody_reads():
            raise
        return 1
    except OSError as error:
        place = error.filename2 or error.filename
        if error.errno in _WRONG_PLACE and place:
            sys.stderr.write(
                f"error: {place}: {error.strerror}; check the path and who may use it\n"
            )
            return 2
        if error.errno != errno.ENOSPC:
            raise
        where = f" while writing {error.filename}" if error.filename else ""
        sys.stderr.write(
            f"error: the disk is full{where}; free some space and run the same command again\n"
        )
        return 2


def _said(command: Callable[[], int | None]) -> int:
    """Runs a command and empties its buffer, as somebody may have stopped reading."""
    try:
        code = command() or 0
    except SystemExit:  # `--help` of a command
        sys.stdout.flush()
        raise
    sys.stdout.flush()
    return code


def _nobody_reads() -> bool:
    """Whether it is our output that nobody takes any more, as after `| head`; then it is closed."""
    try:
        output = sys.stdout.fileno()
    except OSError:
        return False
    poll = select.poll()
    poll.register(output, 0)
    if not any(event & select.POLLERR for _, event in poll.poll(0)):
        return False
    # Python flushes once more at its end, and would complain.
    os.dup2(os.open(os.devnull, os.O_WRONLY), output)
    return True
