# SPDX-License-Identifier: Apache-2.0
"""The `rfgs` command: train, evaluate and look at radio Gaussians."""

from __future__ import annotations

from collections.abc import Sequence

#: Modules of commands that are not called as the command.
_FILES = {"inspect": "inspect_capture", "import": "import_capture"}
#: Command name → module below `rfgs_core.cli` and its arguments dataclass.
COMMANDS: dict[str, tuple[str, str]] = {
    name: (_FILES.get(name, name), f"{name.capitalize()}Args")
    for name in (
        *("info", "demo", "encode", "limbs", "train", "eval", "render", "pose", "export", "view"),
        *("report", "compare", "study", "predict", "csi", "room", "inspect", "import", "live"),
        *("addon", "bench", "selftest"),
    )
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs `rfgs`; returns the exit code."""
    import logging

    from rfgs_core.program import Program

    logging.basicConfig(level=logging.WARNING, format="%(levelname)s: %(message)s")
    program = Program(
        name="rfgs",
        package=__name__,
        commands=COMMANDS,
        introduction="Radio-frequency Gaussian splatting: fits 3D Gaussians to channel state "
        "information alone.",
        closing="Start with `rfgs info`, then `rfgs demo`.",
        continuing=("train",),
    )
    return program.main(arguments)
