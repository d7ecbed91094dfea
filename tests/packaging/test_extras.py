# SPDX-License-Identifier: Apache-2.0
"""Packages that only some commands need: where each stands, and what its absence says."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from rfgs_core.errors import MissingToolError
from rfgs_core.extras import EXTRA_OF, require
from rfgs_core.outcome import run_cli

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
EXTRAS = PROJECT["optional-dependencies"]

#: Run before a program: a finder that knows none of the packages of extras.
_BARE = """
import sys
class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {names!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)
sys.meta_path.insert(0, Absent())
sys.argv = {arguments!r}
from {package} import main
sys.exit(main())
"""


def without_extras(package: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Runs a program where no package of an extra can be imported."""
    code = _BARE.format(names=set(EXTRA_OF), arguments=[package, *arguments], package=package)
    return subprocess.run(
        [sys.executable, "-c", code],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


def package_name(requirement: str) -> str:
    """`bpy` of `bpy>=4.5,<4.6; …`."""
    found = re.match(r"[\w.-]+", requirement)
    assert found
    return found[0].lower()


def test_every_package_of_an_extra_names_one_that_exists() -> None:
    assert set(EXTRAS) == {
        *("factory", "blender", "scenes", "cluster", "gpu", "picture", "video", "dev", "docs")
    }
    assert set(EXTRA_OF.values()) <= set(EXTRAS)


def test_the_core_asks_for_no_package_of_an_extra_and_for_no_version_that_blender_needs() -> None:
    core = {package_name(row): row for row in PROJECT["dependencies"]}
    assert not {"sionna-rt", "mitsuba", "bpy", "anny", "dask", "distributed", "triton"} & set(core)
    assert PROJECT["requires-python"] == ">=3.11"
    assert "<" not in core["numpy"]
    assert "python_version" in EXTRAS["blender"][0]


def test_development_has_every_other_extra() -> None:
    named = re.fullmatch(r"rfgs\[(.*)\]", EXTRAS["dev"][0])
    assert named and set(named[1].split(",")) == set(EXTRAS) - {"dev", "gpu"}
    assert "triton" in EXTRAS["dev"]


def test_no_module_of_the_core_imports_an_extra_when_it_is_loaded() -> None:
    for file in (ROOT / "rfgs_core").rglob("*.py"):
        for node in ast.parse(file.read_text("utf-8")).body:
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom):
                names = [node.module or ""]
            roots = {name.partition(".")[0] for name in names}
            if file.name not in ("kernels_triton.py", "kernels_triton_shadow.py", "triton_math.py"):
                assert not roots & set(EXTRA_OF), file


@pytest.mark.parametrize("package", ["rfgs_core.cli", "dataset_factory.cli"])
def test_help_needs_no_extra(package: str) -> None:
    done = without_extras(package, "--help")
    assert done.returncode == 0, done.stderr
    assert "commands:" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "extra"),
    [
        (["generate", "living_room_walk", "--radio", "wifi", "--out", "nowhere"], "factory"),
        (["verify", "--only", "friis", "--out", "nowhere"], "factory"),
        (["bench"], "factory"),
    ],
)
def test_a_command_without_its_extra_ends_in_one_line(arguments: list[str], extra: str) -> None:
    done = without_extras("dataset_factory.cli", *arguments)
    assert done.returncode == 2, done.stderr
    assert "Traceback" not in done.stderr
    assert done.stderr.strip().splitlines()[-1].endswith(f"run: pip install 'rfgs[{extra}]'")
    assert not (ROOT / "nowhere").exists()


def test_an_import_that_fails_names_its_extra(capsys: pytest.CaptureFixture[str]) -> None:
    def absent() -> None:
        raise ModuleNotFoundError("No module named 'sionna.rt'", name="sionna.rt")

    assert run_cli(absent) == 2
    said = capsys.readouterr().err
    assert said == "error: sionna is not installed; run: pip install 'rfgs[factory]'\n"


def test_other_failed_imports_stay_bugs() -> None:
    def absent() -> None:
        raise ModuleNotFoundError("No module named 'rfgs_core.trian'", name="rfgs_core.trian")

    with pytest.raises(ModuleNotFoundError):
        run_cli(absent)
    with pytest.raises(MissingToolError, match="no_such_package is not installed"):
        require("no_such_package")
