# SPDX-License-Identifier: GPL-3.0-or-later
"""Which version of the add-on this is."""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path


@cache
def version() -> str:
    """As the manifest of the extension says."""
    with Path(__file__).with_name("blender_manifest.toml").open("rb") as stream:
        return str(tomllib.load(stream)["version"])
