# SPDX-License-Identifier: Apache-2.0
"""Installing, using and disabling the extension leaves other add-ons' data as it was."""

from __future__ import annotations

from pathlib import Path

import pytest
from leaving_nothing import SCRIPT, compare, write_material

pytestmark = pytest.mark.blender


def test_the_extension_leaves_the_file_as_it_was(blender, tmp_path: Path) -> None:
    write_material(tmp_path)
    package = "bl_ext.user_default.addon_rfgs"
    done = blender.run("-b", "--python", SCRIPT, "--", tmp_path, package)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-3000:]
    compare(tmp_path)


def test_removing_the_extension_removes_its_files(blender, extension_zip: Path, tmp_path) -> None:
    own = blender.bare(tmp_path)
    command = ("-b", "--command", "extension")
    own.run(*command, "install-file", "-r", "user_default", "-e", extension_zip)
    installed = tmp_path / "extensions" / "user_default" / "addon_rfgs"
    assert (installed / "blender_manifest.toml").is_file()
    # Writes and removes the list of unfinished jobs, as Blender with a window does.
    listed = "__import__('bl_ext.user_default.addon_rfgs.jobs.following').user_default.addon_rfgs"
    write = f"{listed}.jobs.following._listed().write_text('[]')"
    done = own.run("-b", "--python-exit-code", "1", "--python-expr", write)
    assert done.returncode == 0, done.stdout + done.stderr
    written = {file for file in tmp_path.rglob("*") if file.is_file() and "jobs.json" in file.name}
    assert len(written) == 1 and ".user" in next(iter(written)).parts
    done = own.run(*command, "remove", "addon_rfgs")
    assert done.returncode == 0, done.stdout + done.stderr
    assert not installed.exists()
    assert not [file for file in tmp_path.rglob("*") if "rfgs" in file.name]
