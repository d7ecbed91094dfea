# SPDX-License-Identifier: GPL-3.0-or-later
"""The Python environment outside of Blender that holds `rfgs` and `rfgs-factory`."""

from __future__ import annotations

import json
import os
from pathlib import Path

from ..errors import AddonError

#: Where a folder keeps its interpreter.
_INTERPRETERS = ("bin/python", "bin/python3", "Scripts/python.exe")

#: What would make another Python load Blender's own modules.
_BLENDERS_OWN = ("PYTHONHOME", "PYTHONPATH", "PYTHONSTARTUP", "PYTHONEXECUTABLE")

#: Bars of tqdm as lines that `progress.py` reads: done, total, seconds left, stage.
_PROGRESS = {
    "TQDM_BAR_FORMAT": "progress {n} {total} {remaining_s:.0f} {desc}",
    "TQDM_MININTERVAL": "0.5",
}

#: Runs in the environment and prints one line of JSON; imports nothing that takes long.
_CHECK = """
import importlib.metadata as metadata, json, platform, re, subprocess, sys
names = ("rfgs", "sionna-rt", "torch", "bpy")
found = {"Python": platform.python_version()}
problems = []
for name in names:
    try:
        found[name] = metadata.version(name)
    except metadata.PackageNotFoundError:
        found[name] = ""
if found["rfgs"]:
    try:
        import dataset_factory.cli, rfgs_core.cli
        from rfgs_core.llvm import use_llvm
        found["LLVM"] = str(use_llvm()[1])
    except Exception as error:
        problems.append(" ".join(str(error).split()) or type(error).__name__)
blender = sys.argv[1] if len(sys.argv) > 1 else ""
if blender:
    try:
        command = [blender, "-b", "--version"]
        said = subprocess.run(command, capture_output=True, text=True, timeout=60).stdout
        found["Blender"] = re.search(r"Blender ([0-9.]+)", said)[1]
    except Exception:
        problems.append(blender + " does not start; choose another Blender in the preferences")
print("rfgs-environment " + json.dumps({"versions": found, "problems": problems}))
"""
_ANSWER = "rfgs-environment "


def interpreter(path: str) -> Path:
    """The Python program of a path that a user chose.

    Args:
        path: A Python program, or the folder of a virtual environment.

    Raises:
        AddonError: Nothing is chosen, or there is no Python.
    """
    if not path:
        raise AddonError(
            "no Python environment is set; choose one with rfgs in the add-on's preferences"
        )
    chosen = Path(os.path.abspath(path))
    if chosen.is_dir():
        for name in _INTERPRETERS:
            if (chosen / name).is_file():
                return chosen / name
        raise AddonError(f"{chosen}: expected a virtual environment; it has no bin/python")
    if not chosen.is_file():
        raise AddonError(f"{chosen}: no such file; choose a Python program or its environment")
    if not os.access(chosen, os.X_OK):
        raise AddonError(f"{chosen}: not a program; choose a Python program or its environment")
    return chosen


def child_environment() -> dict[str, str]:
    """Environment variables of the programs that are started."""
    kept = {name: value for name, value in os.environ.items() if name not in _BLENDERS_OWN}
    return {**kept, **_PROGRESS, "PYTHONUNBUFFERED": "1"}


def check_arguments(python: Path, blender: str = "") -> list[str]:
    """Command line whose output `read_check` understands.

    Args:
        python: The environment's Python.
        blender: The program that opens files for it; empty for the environment's own bpy.
    """
    return [str(python), "-c", _CHECK, blender]


def read_check(code: int | None, output: str) -> tuple[list[str], list[str]]:
    """What the environment answered, in plain words.

    Args:
        code: Exit code; None if it did not answer in time.
        output: What it wrote.

    Returns:
        Lines on what is there, and one line per problem; without problems jobs can run.
    """
    if code is None:
        return [], ["it does not answer; is this a Python program?"]
    answers = [line for line in output.splitlines() if line.startswith(_ANSWER)]
    try:
        answer = json.loads(answers[-1].removeprefix(_ANSWER)) if answers else None
        versions = {str(name): str(value) for name, value in answer["versions"].items()}
        problems = [str(text) for text in answer["problems"]]
    except (TypeError, KeyError, AttributeError, ValueError):
        last = (output.strip().splitlines() or ["it said nothing"])[-1]
        return [], [f"this is no Python that works (exit code {code}): {last[:200]}"]
    missing = {
        "rfgs": "rfgs is not installed there: pip install -e the folder of RF-GS",
        "sionna-rt": "sionna-rt is missing, so nothing can be traced: pip install sionna-rt==2.2.0",
        "torch": "torch is missing, so nothing can be trained: pip install torch",
    }
    problems += [text for name, text in missing.items() if not versions.get(name)]
    return [f"{name} {value or 'not installed'}" for name, value in versions.items()], problems
