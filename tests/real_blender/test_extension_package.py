# SPDX-License-Identifier: Apache-2.0
"""Blender's own tool accepts the add-on as an extension; needs no Blender program."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def test_manifest_is_valid(extension_tool: list[str]) -> None:
    done = subprocess.run(
        [*extension_tool, "validate", str(ROOT / "addon_rfgs")],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_package_holds_the_sources_and_nothing_else(extension_zip: Path) -> None:
    with zipfile.ZipFile(extension_zip) as package:
        names = set(package.namelist())
    folder = ROOT / "addon_rfgs"
    sources = {path.relative_to(folder).as_posix() for path in folder.rglob("*.py")}
    assert names == sources | {"blender_manifest.toml", "tables.json"}


def test_add_on_imports_only_itself_numpy_and_the_standard_library() -> None:
    blenders_own = {"bpy", "bpy_extras", "bmesh", "mathutils", "_cycles"}
    blenders_own |= {"blf", "gpu", "gpu_extras"}
    allowed = {*blenders_own, "numpy", *sys.stdlib_module_names}
    for path in (ROOT / "addon_rfgs").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.Import):
                assert {alias.name.split(".")[0] for alias in node.names} <= allowed, path
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                assert str(node.module).split(".")[0] in allowed, path


#: The one place that opens a connection: to this machine alone.
FEED = ROOT / "addon_rfgs" / "live" / "feed.py"


def test_add_on_reaches_for_no_network_shell_or_pickle() -> None:
    everywhere = {"ssl", "http", "urllib", "ftplib", "smtplib", "xmlrpc", "pickle", "shelve"}
    for path in (ROOT / "addon_rfgs").rglob("*.py"):
        banned = everywhere if path == FEED else everywhere | {"socket"}
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.Import):
                assert not {alias.name.split(".")[0] for alias in node.names} & banned, path
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                assert str(node.module).split(".")[0] not in banned, path
            elif isinstance(node, ast.Call):
                assert not any(row.arg in {"shell", "allow_pickle"} for row in node.keywords), path
                name = ast.unparse(node.func)
                assert name not in {"eval", "exec", "os.system", "os.popen", "compile"}, path


def test_the_live_feed_is_of_this_machine_alone_and_declared() -> None:
    text = FEED.read_text("utf-8")
    opened = [
        node
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Call)
        and re.search(r"connect|bind|socket\.socket|addrinfo", ast.unparse(node.func))
    ]
    reached = [ast.unparse(node.args[0]) for node in opened if node.args]
    assert reached and all(place.startswith("(_LOOPBACK, ") for place in reached), reached
    assert '_LOOPBACK = "127.0.0.1"' in text
    manifest = tomllib.loads((ROOT / "addon_rfgs" / "blender_manifest.toml").read_text("utf-8"))
    assert "this machine" in manifest["permissions"]["network"]


@pytest.mark.blender
def test_blender_itself_builds_and_validates(blender, tmp_path: Path) -> None:
    made = tmp_path / "made.zip"
    build = ("--source-dir", ROOT / "addon_rfgs", "--output-filepath", made)
    done = blender.run("-b", "--command", "extension", "build", *build)
    assert done.returncode == 0 and made.is_file(), done.stdout + done.stderr
    for what in (made, ROOT / "addon_rfgs"):
        done = blender.run("-b", "--command", "extension", "validate", what)
        assert done.returncode == 0, done.stdout + done.stderr
