# SPDX-License-Identifier: Apache-2.0
"""The `rfgs-factory` command: makes, checks and shows datasets."""

from __future__ import annotations

import sys
from collections.abc import Sequence

#: Command name → module below `dataset_factory.cli` and its arguments dataclass.
COMMANDS: dict[str, tuple[str, str]] = {
    name: (name, f"{name.capitalize()}Args")
    for name in (
        *("scenes", "check", "plan", "radios", "generate", "worlds", "validate", "preview"),
        *("impair", "stats", "convert", "bench", "tracers", "verify", "coverage"),
    )
}

_FIRST_STEPS = r"""A first dataset, about two minutes on two cores:
  rfgs-factory generate living_room_walk --radio wifi --frames 10:30:10 --cameras 4 \
      --resolution 128 --out my_dataset
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs `rfgs-factory`; returns the exit code."""
    import logging

    from rfgs_core.program import Program

    logging.basicConfig(format="%(message)s", level=logging.INFO, stream=sys.stderr)
    program = Program(
        name="rfgs-factory",
        package=__name__,
        commands=COMMANDS,
        introduction="Makes datasets of radio channels with matching pictures from animated "
        "Blender files.",
        closing=_FIRST_STEPS,
        continuing=("plan", "generate"),
    )
    return program.main(arguments)
