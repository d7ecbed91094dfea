# SPDX-License-Identifier: Apache-2.0
"""A real Blender, with the extension installed for itself alone."""

from __future__ import annotations

import importlib.util
import os
import re
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
#: Which Blender ran, for the last lines of the report.
_RAN = pytest.StashKey[str]()


def pytest_terminal_summary(
    terminalreporter: pytest.TerminalReporter, config: pytest.Config
) -> None:
    """Says which Blender ran."""
    terminalreporter.write_line(f"real Blender: {config.stash.get(_RAN, 'none ran')}")


@dataclass(frozen=True)
class RealBlender:
    """A program and the folder that holds its settings and extensions."""

    program: Path
    version: str
    resources: Path

    def run(self, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [str(self.program), *map(str, arguments)],
            env={**os.environ, "BLENDER_USER_RESOURCES": str(self.resources)},
            cwd=self.resources,
            capture_output=True,
            text=True,
            timeout=280,
            check=False,
        )

    def bare(self, resources: Path) -> RealBlender:
        """The same program with other settings, and so without the extension."""
        return replace(self, resources=resources)

    def rfgs(self, blend: Path, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
        """Runs `--command rfgs` on a file."""
        return self.run("-b", blend, "--disable-autoexec", "--command", "rfgs", *arguments)


@pytest.fixture(scope="session")
def extension_tool() -> list[str]:
    """Blender's own builder and validator of extensions, from pip's bpy."""
    spec = importlib.util.find_spec("bpy")
    assert spec is not None and spec.origin is not None
    found = Path(spec.origin).parent.glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py")
    return [sys.executable, str(next(found))]


@pytest.fixture(scope="session")
def extension_zip(extension_tool: list[str], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The add-on, built by Blender's own tool."""
    path = tmp_path_factory.mktemp("extension") / "addon_rfgs.zip"
    arguments = ["build", "--source-dir", str(ROOT / "addon_rfgs"), "--output-filepath", str(path)]
    done = subprocess.run(
        [*extension_tool, *arguments], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return path


def find_program() -> Path | None:
    """$BLENDER, else the one that `.ci/install_blender.sh` installed."""
    named = os.environ.get("BLENDER")
    if named:
        return Path(named)
    installed = ROOT / ".blender" / "blender"
    return installed if installed.exists() else None


@pytest.fixture(scope="session")
def blender(
    extension_zip: Path,
    tmp_path_factory: pytest.TempPathFactory,
    pytestconfig: pytest.Config,
) -> RealBlender:
    """A real Blender in which the extension is enabled; its version goes to the terminal."""
    program = find_program()
    if program is None:
        pytest.skip("no Blender: set BLENDER=/path/to/blender or run .ci/install_blender.sh")
    bare = RealBlender(program, "", tmp_path_factory.mktemp("blender"))
    match = re.search(r"Blender (\d+\.\d+\S*)", bare.run("--version").stdout)
    assert match, f"{program} does not answer to --version"
    pytestconfig.stash[_RAN] = f"Blender {match[1]} at {program}"
    install = ("-b", "--command", "extension", "install-file", "-r", "user_default", "-e")
    done = bare.run(*install, extension_zip)
    # On a busy machine Blender loses the line that says so.
    installed = bare.resources / "extensions" / "user_default" / "addon_rfgs"
    assert (installed / "blender_manifest.toml").is_file(), done.stdout + done.stderr
    return RealBlender(program, match[1], bare.resources)


@pytest.fixture
def programs(blender: RealBlender, tmp_path: Path) -> tuple[Path, Path]:
    """What jobs are run by: this Python with this tree, and the Blender that opens files for it."""
    # Jobs that an earlier test has cut off would be found by the next window.
    own = blender.resources / "extensions" / ".user" / "user_default" / "addon_rfgs"
    (own / "jobs.json").unlink(missing_ok=True)
    environment, opener = tmp_path / "python", tmp_path / "blender"
    environment.write_text(f'#!/bin/sh\nPYTHONPATH="{ROOT}" exec "{sys.executable}" "$@"\n')
    resources = f'BLENDER_USER_RESOURCES="{blender.resources}"'
    opener.write_text(f'#!/bin/sh\n{resources} exec "{blender.program}" "$@"\n')
    for program in (environment, opener):
        program.chmod(0o755)
    return environment, opener


@pytest.fixture
def tiny_blend(python, tmp_path: Path) -> Path:
    """A box that walks through an empty room."""
    builder = ROOT / "tests" / "dataset_factory" / "build_tiny_scene.py"
    python(builder, tmp_path / "tiny.blend", "moving", "concrete", "1.0", must_work=True)
    return tmp_path / "tiny.blend"
