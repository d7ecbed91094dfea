# SPDX-License-Identifier: Apache-2.0
"""Packages that only some commands need, and the extra of `pip install` that brings each."""

from __future__ import annotations

import importlib.util

from rfgs_core.errors import MissingToolError

#: Package as it is imported → extra of pyproject.toml.
EXTRA_OF = {
    "sionna": "factory", "mitsuba": "factory", "drjit": "factory", "bpy": "blender",
    "anny": "scenes", "distributed": "factory", "dask": "factory", "triton": "gpu", "gsplat": "gpu",
    "playwright": "picture", "imageio_ffmpeg": "video",
}  # fmt: skip


def how_to_install(package: str) -> str | None:
    """One line that says how to get a missing package; None for one that belongs to no extra.

    Args:
        package: Name as it is imported; what follows a dot does not count.
    """
    root = package.partition(".")[0]
    if root not in EXTRA_OF:
        return None
    return f"{root} is not installed; run: pip install 'rfgs[{EXTRA_OF[root]}]'"


def require(*packages: str) -> None:
    """Checks for packages before long work.

    Raises:
        MissingToolError: One is missing; the message names the command that installs it.
    """
    for package in packages:
        if importlib.util.find_spec(package) is None:
            raise MissingToolError(how_to_install(package) or f"{package} is not installed")
