# SPDX-License-Identifier: Apache-2.0
"""`rfgs addon install` in a real Blender: what lies there counts, not what Blender says."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from rfgs_core.cli import main

KNOWN = "__import__('bpy').context.preferences.addons['bl_ext.user_default.addon_rfgs'].preferences"


def _wrapped(blender, folder: Path, install: str) -> Path:
    """Blender with settings of its own, which treats an installation as INSTALL says."""
    program = folder / "blender"
    program.write_text(
        f'#!/bin/sh\nexport BLENDER_USER_RESOURCES="{folder}"\ncd "{folder}"\n'
        f'case "$*" in *install-file*) {install} ;; esac\nexec "{blender.program}" "$@"\n'
    )
    program.chmod(0o755)
    return program


@pytest.mark.blender
def test_an_empty_blender_knows_the_environment_though_it_says_nothing(blender, tmp_path) -> None:
    silent = _wrapped(blender, tmp_path, f'"{blender.program}" "$@" >/dev/null; exit 0')
    assert main(["addon", "install", "--blender", str(silent)]) == 0
    done = blender.bare(tmp_path).run("-b", "--python-expr", f"print('at', {KNOWN}.python)")
    assert f"at {sys.prefix}\n" in done.stdout, done.stdout + done.stderr


@pytest.mark.blender
def test_what_was_not_installed_is_told(blender, tmp_path, capsys) -> None:
    idle = _wrapped(blender, tmp_path, "exit 0")
    assert main(["addon", "install", "--blender", str(idle)]) == 2
    assert capsys.readouterr().err == f"error: {idle}: the add-on was not installed\n"
    failing = _wrapped(blender, tmp_path, "echo 'ERROR this Blender is too old'; exit 0")
    assert main(["addon", "install", "--blender", str(failing)]) == 2
    assert capsys.readouterr().err == f"error: {failing}: ERROR this Blender is too old\n"


@pytest.mark.blender
def test_an_older_add_on_that_stays_is_told(blender, tmp_path, capsys) -> None:
    assert main(["addon", "install", "--blender", str(_wrapped(blender, tmp_path, "true"))]) == 0
    own = tmp_path / "extensions" / "user_default" / "addon_rfgs" / "cli.py"
    own.write_text(own.read_text("utf-8") + "# older\n", "utf-8")
    idle = _wrapped(blender, tmp_path, "exit 0")
    assert main(["addon", "install", "--blender", str(idle)]) == 2
    assert capsys.readouterr().err == f"error: {idle}: an older add-on is still there\n"
