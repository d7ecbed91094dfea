# SPDX-License-Identifier: Apache-2.0
"""`rfgs-factory scenes`."""

from __future__ import annotations

import sys
from dataclasses import dataclass


@dataclass(frozen=True)
class ScenesArgs:
    """Lists the scenes that come with RF-GS."""


def run(_args: ScenesArgs) -> int:
    """Prints name, frames, description and file of each scene."""
    from dataset_factory.scene.catalogue import catalogue

    for scene in catalogue():
        sys.stdout.write(
            f"{scene.name:<20} frames {scene.frames} at {scene.fps:g} fps\n"
            f"{'':<20} {scene.description}\n{'':<20} {scene.blend}\n"
        )
    return 0
