# SPDX-License-Identifier: Apache-2.0
"""Runs our own commands as programs of their own, each with its own imports and threads."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from rfgs_core.children import end_with_parent
from rfgs_core.errors import RfgsError
from rfgs_core.interrupts import CALLED, STOPPED

#: Ctrl-C reaches the called program too; one that it did not reach is told after so long [s].
_GRACE_S = 2.0
#: How often a program that runs beside is looked at [s].
_LOOK_S = 0.2


def call(*command: str | Path) -> None:
    """Runs one of our own modules with this Python; its error line has been printed.

    Raises:
        RfgsError: It failed.
        KeyboardInterrupt: The user stopped it.
    """
    arguments = [sys.executable, "-m", *map(str, command)]
    # Of a caller that is killed, as workers are, nothing goes on.
    with subprocess.Popen(
        arguments, env={**os.environ, CALLED: "1"}, preexec_fn=end_with_parent
    ) as program:
        try:
            code = program.wait()
        except KeyboardInterrupt:
            _let_end(program)
            raise
    if code == STOPPED:
        raise KeyboardInterrupt
    if code:
        raise RfgsError(f"`python -m {' '.join(map(str, command))}` failed (exit code {code})")


@contextlib.contextmanager
def beside(*command: str | Path, log: Path) -> Iterator[None]:
    """Runs one of our own modules beside the block; after it, waits and shows what it still says.

    Args:
        command: Module and arguments.
        log: File that takes what it says.

    Raises:
        RfgsError: It failed, or cannot be told of.
        KeyboardInterrupt: The user stopped it.
    """
    arguments = [sys.executable, "-m", *map(str, command)]
    with (
        log.open("wb") as said,
        subprocess.Popen(
            arguments, env={**os.environ, CALLED: "1"}, stdout=said, stderr=subprocess.STDOUT
        ) as program,
    ):
        try:
            yield
            _follow(program, log)
        except BaseException:
            if program.poll() is None:
                _let_end(program)
            raise
    if program.returncode == STOPPED:
        raise KeyboardInterrupt
    if program.returncode:
        raise RfgsError(
            f"`python -m {' '.join(map(str, command))}` failed (exit code {program.returncode}); "
            f"{log} says why"
        )


def _follow(program: subprocess.Popen[bytes], log: Path) -> None:
    """Shows what a program writes into a file from now on, until it ends."""
    with log.open("rb") as said:
        said.seek(0, os.SEEK_END)
        while True:
            ended = program.poll() is not None
            sys.stderr.write(said.read().decode("utf-8", "replace"))
            sys.stderr.flush()
            if ended:
                return
            time.sleep(_LOOK_S)


def _let_end(program: subprocess.Popen[bytes]) -> None:
    """Waits for a program that ends by itself, as one that is killed leaves its workers behind."""
    try:
        program.wait(_GRACE_S)
    except subprocess.TimeoutExpired:
        program.send_signal(signal.SIGINT)
        program.wait()


@contextlib.contextmanager
def watched(run: Path) -> Iterator[None]:
    """Shows a run in the viewer for as long as the block runs; the viewer says where.

    Args:
        run: Folder of a run that is trained meanwhile.
    """
    command = ("rfgs_core.cli", "view", str(run), "--wait", "--port", "0")
    arguments = [sys.executable, "-m", *command]
    with subprocess.Popen(arguments, env={**os.environ, CALLED: "1"}) as viewer:
        try:
            yield
        finally:
            viewer.terminate()
