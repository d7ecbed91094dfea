# SPDX-License-Identifier: GPL-3.0-or-later
"""The commands `environment`, `generate`, `train`, `evaluate`, `resume`, `stop` and `forget`."""

from __future__ import annotations

import argparse
import os
import time
from dataclasses import replace
from pathlib import Path
from typing import Any, TextIO

import bpy

from ..command_options import add_python, progress_lines, set_number
from ..errors import AddonError
from .checking import CHECK
from .environment import interpreter
from .following import QUEUE
from .operators import await_check
from .plans import Plan
from .preferences import blender_program, environment_path
from .process import Process
from .queue import GRACE_S
from .record import read_record
from .starting import carry_out, doing_without, evaluate_plan, generate_plan, train_plan

_KINDS = ("generate", "train", "evaluate")


def add_environment(commands: Any) -> None:
    """Adds `environment` to the commands."""
    command = commands.add_parser(
        "environment", help="say what the Python environment outside of Blender holds"
    )
    add_python(command)
    command.set_defaults(run=_environment)


def add_generate(commands: Any) -> None:
    """Adds `generate` to the commands."""
    command = commands.add_parser(
        "generate",
        help="make a dataset of the file with rfgs-factory",
        description="Makes a dataset of the file on disk; what is left out is taken from the "
        "panel's settings. The same command continues what was stopped.",
    )
    command.add_argument("--out", dest="dataset_folder", metavar="FOLDER", help="of the dataset")
    command.add_argument(
        "--radio",
        dest="radios",
        metavar="NAME[,NAME…]",
        help="presets to trace, or scene for the radio that the file's own devices describe, which "
        "is the default where there are some; else wifi",
    )
    command.add_argument("--frames", metavar="A:B[:STEP]")
    for name, text in (
        ("depth", "interactions of a path that meets a person; 0: what the scene needs"),
        ("workers", "tracing processes"),
        ("cameras", "first N cameras; 0: all"),
        ("resolution", "longer side of the pictures [px]"),
        ("samples", "light samples per pixel"),
        ("seed", "the same seed gives the same bytes"),
    ):
        command.add_argument(f"--{name}", type=int, metavar="N", help=text)
    for name, text in (("images", "render pictures"), ("paths", "store ray paths")):
        command.add_argument(f"--{name}", action=argparse.BooleanOptionalAction, help=text)
    command.add_argument("--blender", type=Path, help="Blender that opens the file; default: this")
    add_python(command)
    command.set_defaults(run=_generate)


def add_train(commands: Any) -> None:
    """Adds `train` to the commands."""
    command = commands.add_parser(
        "train",
        help="fit Gaussians to a dataset with rfgs",
        description="Fits Gaussians to a dataset; what is left out is taken from the panel's "
        "settings. The same command continues what was stopped.",
    )
    command.add_argument("--out", dest="run_folder", metavar="FOLDER", help="of the run")
    command.add_argument("--dataset", dest="dataset_folder", metavar="FOLDER")
    command.add_argument("--radio", dest="train_radio", metavar="NAME", help="one of the dataset's")
    command.add_argument("--frames", dest="train_frames", metavar="A:B[:STEP]")
    command.add_argument("--iterations", type=int, metavar="N", help="steps per frame")
    command.add_argument("--gaussians", type=int, metavar="N", help="at the start")
    add_python(command)
    command.set_defaults(run=lambda options, out: _run(options, out, train_plan))


def add_evaluate(commands: Any) -> None:
    """Adds `evaluate` to the commands."""
    command = commands.add_parser("evaluate", help="measure a run beside its controls with rfgs")
    command.add_argument("--run", dest="run_folder", metavar="FOLDER", help="the run")
    add_python(command)
    command.set_defaults(run=lambda options, out: _run(options, out, evaluate_plan))


def add_resume(commands: Any) -> None:
    """Adds `resume` to the commands."""
    command = commands.add_parser("resume", help="continue a job that was stopped or cut off")
    _add_folder(command)
    add_python(command)
    command.set_defaults(run=_resume)


def add_stop(commands: Any) -> None:
    """Adds `stop` to the commands."""
    command = commands.add_parser("stop", help="stop a job that another Blender started")
    _add_folder(command)
    command.set_defaults(run=_stop)


def add_forget(commands: Any) -> None:
    """Adds `forget` to the commands."""
    command = commands.add_parser(
        "forget", help="take a job that is over off the list of unfinished ones; its files stay"
    )
    _add_folder(command)
    command.set_defaults(run=_forget)


def _add_folder(command: argparse.ArgumentParser) -> None:
    command.add_argument("folder", type=Path, help="folder of the dataset or run")
    command.add_argument("--kind", choices=_KINDS, help="which job; needed if there are several")


def _environment(options: argparse.Namespace, out: TextIO) -> str:
    CHECK.start(interpreter(options.python or environment_path()), blender_program())
    return await_check()


def _generate(options: argparse.Namespace, out: TextIO) -> str:
    def plan(scene: bpy.types.Scene) -> Plan:
        missing = doing_without(scene)
        if missing:
            out.write(missing + "\n")
            out.flush()
        made = generate_plan(scene)
        if options.blender is None:
            return made
        return replace(made, blender=str(Path(os.path.abspath(options.blender))))

    return _run(options, out, plan)


def _run(options: argparse.Namespace, out: TextIO, plan: Any) -> str:
    """Sets what was said, and runs the job to its end; the file itself is not saved."""
    settings = bpy.context.scene.rfgs.jobs
    for name, value in vars(options).items():
        if value is not None and name in type(settings).bl_rna.properties:
            _set(settings, name, value)
    return _finish(plan(bpy.context.scene), options, out)


def _set(settings: Any, name: str, value: Any) -> None:
    if type(settings).bl_rna.properties[name].type == "INT":
        set_number(settings, name, value)
    else:
        setattr(settings, name, os.path.abspath(value) if name.endswith("_folder") else value)


def _finish(plan: Plan, options: argparse.Namespace, out: TextIO) -> str:
    python = interpreter(options.python or environment_path())
    return carry_out(QUEUE.add(plan, python), progress_lines(out))


def _resume(options: argparse.Namespace, out: TextIO) -> str:
    record = read_record(_record(options))
    return _finish(record.plan, options, out)


def _stop(options: argparse.Namespace, out: TextIO) -> str:
    record = read_record(_record(options))
    process = Process(record.pid, record.born)
    if not process.running():
        raise AddonError(f"{options.folder}: no job is running there")
    process.interrupt()
    end_s = time.monotonic() + GRACE_S
    while process.running() and time.monotonic() < end_s:
        time.sleep(0.1)
    process.kill()
    return f"stopped; finished work is kept, continue with: resume {options.folder}"


def _forget(options: argparse.Namespace, out: TextIO) -> str:
    record = read_record(_record(options))
    job = QUEUE.restore(record)
    QUEUE.forget(job)
    return f"{job.title} is off the list; its files stay"


def _record(options: argparse.Namespace) -> Path:
    log = Path(os.path.abspath(options.folder)) / "log"
    kinds = (options.kind,) if options.kind else _KINDS
    found = [file for kind in kinds if (file := log / f"job_{kind}.json").is_file()]
    if len(found) != 1:
        what = "several jobs; choose one with --kind" if found else "no job of this add-on"
        raise AddonError(f"{options.folder}: holds {what}")
    return found[0]
