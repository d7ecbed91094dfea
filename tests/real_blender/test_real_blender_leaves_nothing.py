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
