# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C ends a program with 130 and one line wherever it strikes, or comes too late to matter."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
KILL = "os.kill(os.getpid(), signal.SIGINT)"
HEAD = "import atexit, os, signal, sys, threading, time\n"
LINE = "\nstopped; finished work is kept, run the same command to continue\n"

#: Real signals at moments that random timing would hardly meet.
STRUCK = {
    "while importing": f"{KILL}\ntime.sleep(9)",
    "in an import that turns any error into its own": f"""
try:
    {KILL}
    time.sleep(9)
except BaseException as error:
    raise ImportError("core failed to import") from error
""",
    "while running": f"def main():\n    {KILL}\n    time.sleep(9)\n",
    "in a callback that cannot raise": f"""
class Struck:
    def __del__(self):
        {KILL}
        time.sleep(0.05)
def main():
    Struck()
    time.sleep(9)
""",
    "while another thread runs": f"""
def main():
    threading.Timer(0.1, lambda: {KILL}).start()
    time.sleep(9)
""",
    "twice, the second time while tidying up": f"""
def main():
    try:
        {KILL}
        time.sleep(9)
    finally:
        {KILL}
        time.sleep(9)
""",
}

LATE = {
    "after the command": f"""
def late():
    {KILL}
    time.sleep(0.05)
def main():
    atexit.register(late)
    return 3
""",
    "while modules are taken down": f"""
class Late:
    def __del__(self, os=os, signal=signal, time=time):
        {KILL}
        time.sleep(0.05)
keep = Late()
def main():
    return 3
""",
}


def run(tmp_path: Path, text: str) -> subprocess.CompletedProcess[str]:
    (tmp_path / "victim.py").write_text(HEAD + text)
    start = "from rfgs_core.interrupts import run_program; run_program('victim')"
    return subprocess.run(
        [sys.executable, "-c", start],
        capture_output=True,
        text=True,
        timeout=60,
        env={**os.environ, "PYTHONPATH": f"{tmp_path}{os.pathsep}{ROOT}"},
    )


@pytest.mark.parametrize("moment", STRUCK)
def test_an_interrupt_is_one_line_and_code_130(tmp_path: Path, moment: str) -> None:
    answer = run(tmp_path, STRUCK[moment])
    assert (answer.returncode, answer.stderr) == (130, LINE)


@pytest.mark.parametrize("moment", LATE)
def test_an_interrupt_that_comes_too_late_changes_nothing(tmp_path: Path, moment: str) -> None:
    answer = run(tmp_path, LATE[moment])
    assert (answer.returncode, answer.stderr) == (3, "")


@pytest.mark.parametrize(("leave", "code"), [("0", 0), ("2", 2), ("None", 0), ("'gone'", 1)])
def test_exit_codes_pass_through(tmp_path: Path, leave: str, code: int) -> None:
    assert run(tmp_path, f"def main():\n    sys.exit({leave})\n").returncode == code


def test_mistakes_of_ours_keep_their_traceback(tmp_path: Path) -> None:
    answer = run(tmp_path, "def main():\n    return 1 / 0\n")
    assert answer.returncode == 1
    assert "Traceback" in answer.stderr and "ZeroDivisionError" in answer.stderr


@pytest.mark.parametrize("name", ["drjit", "json"])
def test_objects_are_left_at_the_end_unless_a_library_would_complain(
    tmp_path: Path, name: str
) -> None:
    show = "atexit.register(lambda: print(gc.get_freeze_count() > 0))"
    text = f"import gc\ndef main():\n    sys.modules['{name}'] = None\n    {show}\n"
    assert run(tmp_path, text).stdout.split() == [str(name != "drjit")]


@pytest.mark.parametrize("module", ["dataset_factory", "rfgs_core.cli"])
def test_programs_load_nothing_before_they_can_be_interrupted(module: str) -> None:
    look = (
        "import sys, rfgs_core.interrupts as watch\n"
        "def show(name):\n    print(*sys.modules)\n    sys.exit()\n"
        "watch.run_program = show\n"
        f"import importlib; importlib.import_module('{module}.__main__').main()"
    )
    answer = subprocess.run(
        [sys.executable, "-c", look], capture_output=True, text=True, timeout=60, cwd=ROOT
    )
    loaded = set(answer.stdout.split())
    assert "rfgs_core.interrupts" in loaded, answer.stderr
    assert not loaded & {"tyro", "numpy", "logging", "dataclasses"}
