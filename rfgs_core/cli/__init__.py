# SPDX-License-Identifier: Apache-2.0
"""The `rfgs` command: train, evaluate and look at radio Gaussians."""

from __future__ import annotations

from collections.abc import Sequence

#: Command name → module below `rfgs_core.cli` and its arguments dataclass.
COMMANDS: dict[str, tuple[str, str]] = {
    "info": ("info", "InfoArgs"),
    "demo": ("demo", "DemoArgs"),
    "encode": ("encode", "EncodeArgs"),
    "limbs": ("limbs", "LimbsArgs"),
    "train": ("train", "TrainArgs"),
    "eval": ("eval", "EvalArgs"),
    "render": ("render", "RenderArgs"),
    "pose": ("pose", "PoseArgs"),
    "export": ("export", "ExportArgs"),
    "view": ("view", "ViewArgs"),
    "report": ("report", "ReportArgs"),
    "compare": ("compare", "CompareArgs"),
    "study": ("study", "StudyArgs"),
    "predict": ("predict", "PredictArgs"),
    "csi": ("csi", "CsiArgs"),
    "room": ("room", "RoomArgs"),
    "inspect": ("inspect_capture", "InspectArgs"),
    "import": ("import_capture", "ImportArgs"),
    "live": ("live", "LiveArgs"),
    "addon": ("addon", "AddonArgs"),
    "bench": ("bench", "BenchArgs"),
    "selftest": ("selftest", "SelftestArgs"),
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
    )
    return program.main(arguments)
