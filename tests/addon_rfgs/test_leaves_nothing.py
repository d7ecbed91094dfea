# SPDX-License-Identifier: Apache-2.0
"""A file that carries other add-ons' data is the same before RF-GS and after it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from leaving_nothing import SCRIPT, compare, write_material


def test_install_use_uninstall_leaves_the_file_as_it_was(
    python: Callable[..., Any], tmp_path: Path
) -> None:
    write_material(tmp_path)
    done = python(SCRIPT, "--", tmp_path, "addon_rfgs")
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-3000:]
    compare(tmp_path)
