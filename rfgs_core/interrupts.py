# SPDX-License-Identifier: Apache-2.0
"""Runs a program so that Ctrl-C ends it with code 130 at any moment of its life.

Python itself raises `KeyboardInterrupt` wherever it happens to be: inside an import it becomes a
traceback, inside a callback it is dropped, and while the interpreter shuts down the signal kills
the process. So this module imports nothing heavy and takes over before anything else is loaded.
"""

from __future__ import annotations

import _thread
import gc
import importlib
import os
import signal
import sys
import time
from types import FrameType
from typing import Any, NoReturn

#: Exit code after Ctrl-C: 128 + SIGINT, as shells count.
STOPPED = 130

MESSAGE = "\nstopped; finished work is kept, run the same command to continue\n"
_NOTHING = "\nstopped; nothing was made\n"

#: Set for a program that another one of ours has called, which says for both that it stopped.
CALLED = "RFGS_CALLED"


#: New objects after which Python looks for unused cycles. Of modules, which are most of what a
#: short command makes, none is: with Python's own 700 that search takes a tenth of such a command.
_NEW_OBJECTS = 10_000
#: Libraries that hang, or complain, where some of their objects are left at the end.
_TIDY = ("bpy", "drjit", "triton")

_message = MESSAGE


def nothing_is_made() -> None:
    """Says of this program that there will be nothing to keep where it is stopped."""
    global _message
    _message = _NOTHING


def say_stopped() -> None:
    """Tells the user once, however many of our programs call each other."""
    if not os.environ.get(CALLED):
        sys.stderr.write(_message)


def run_program(module: str) -> NoReturn:
    """Runs `main()` of a module, import included, and leaves Python with its exit code.

    Once `main` has returned, further interrupts change nothing: the work is done.

    Args:
        module: Name of the module; its `main` takes no arguments and returns the exit code.
    """
    gc.set_threshold(_NEW_OBJECTS)
    watch = _Watch()
    code: int | None = None
    while code is None:
        try:
            code = watch.run(module)
        except KeyboardInterrupt:
            # Between two instructions of the watch itself; its loop above ends at once.
            watch.module_ended = True
    if not any(name in sys.modules for name in _TIDY):
        # To look through all objects once more as the process ends takes up to a second.
        gc.freeze()
    sys.exit(code)


class _Watch:
    """One program under the eye of an interrupt handler."""

    def __init__(self) -> None:
        self.interrupted = False
        self.module_ended = False

    def run(self, module: str) -> int:
        """Exit code of the module's `main`; 130 if an interrupt ended it."""
        try:
            if self.module_ended:
                return self._stopped()
            signal.signal(signal.SIGINT, self._interrupt)
            sys.unraisablehook = self._unraisable
            return self._main(module)
        finally:
            self.module_ended = True
            # Python resets its own handlers while it shuts down, but leaves this one alone.
            signal.signal(signal.SIGINT, signal.SIG_IGN)

    def _main(self, module: str) -> int:
        try:
            return importlib.import_module(module).main()
        except SystemExit as error:
            if error.code is not None and not isinstance(error.code, int):
                sys.stderr.write(f"{error.code}\n")
                return 1
            return error.code or 0
        except BaseException:
            # An interrupt inside an import may come out as any other error.
            if not self.interrupted:
                raise
            return self._stopped()

    def _stopped(self) -> int:
        say_stopped()
        return STOPPED

    def _interrupt(self, _number: int, _frame: FrameType | None) -> None:
        self.interrupted = True
        if not self.module_ended:
            raise KeyboardInterrupt

    def _unraisable(self, dropped: Any) -> None:
        if issubclass(dropped.exc_type, KeyboardInterrupt):
            # It hit a callback that cannot raise: once more, when that is over.
            _thread.start_new_thread(_interrupt_again, ())
        else:
            sys.__unraisablehook__(dropped)


def _interrupt_again() -> None:
    time.sleep(0.05)
    os.kill(os.getpid(), signal.SIGINT)
