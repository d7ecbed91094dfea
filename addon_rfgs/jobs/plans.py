# SPDX-License-Identifier: GPL-3.0-or-later
"""What jobs do: their settings, the command line each becomes, and whether its work is done.

A job is kept on disk by its settings, never by its command line: what lies in a folder may come
from anywhere, and only these commands are ever run. Programs are no such settings: Blender, like
Python, is the one of the user's preferences whenever a job starts.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any, ClassVar

from ..errors import AddonError
from ..json_file import Fields, read_json

#: Largest JSON file that is read [bytes].
_LARGEST_JSON = 4_000_000
#: Settings that name a program.
_PROGRAMS = ("blender",)


@dataclass(frozen=True)
class GeneratePlan:
    """A dataset from the saved file, by `rfgs-factory generate`."""

    kind: ClassVar[str] = "generate"
    label: ClassVar[str] = "Generate"

    out: str
    """Folder of the dataset, absolute."""
    blend: str
    """The saved file, absolute."""
    blender: str = ""
    """Program that opens it; empty: the environment's own bpy."""
    radios: str = "wifi"
    """Presets, files or `scene`, with commas between."""
    frames: str = ""
    cameras: int = 0
    resolution: int = 256
    samples: int = 16
    images: bool = True
    depth: int = 0
    """Interactions of a path that meets a person; 0 takes what the scene needs."""
    workers: int = 2
    paths: bool = False
    seed: int = 0

    def arguments(self) -> list[str]:
        """Command line behind the Python program."""
        radios = [name.strip() for name in self.radios.split(",") if name.strip()]
        if not radios:
            raise AddonError("no radio is chosen; expected a preset such as wifi")
        return [
            *("-m", "dataset_factory", "generate", self.blend, f"--out={self.out}"),
            *(f"--radio={name}" for name in radios),
            *([f"--frames={self.frames}"] if self.frames else []),
            *([f"--depth={self.depth}"] if self.depth else []),
            *([f"--blender={self.blender}"] if self.blender else []),
            *(f"--cameras={self.cameras}", f"--resolution={self.resolution}"),
            *(f"--samples={self.samples}", f"--workers={self.workers}", f"--seed={self.seed}"),
            "--paths" if self.paths else "--no-paths",
            "--images" if self.images else "--no-images",
        ]

    def complete(self) -> bool:
        """Whether the dataset is finished: its checksums are written last."""
        form = Fields({"manifest_sha256": str})
        try:
            info = read_json(Path(self.out) / "dataset.json", form, "make it anew", _LARGEST_JSON)
        except AddonError:
            return False
        return bool(info["manifest_sha256"])


@dataclass(frozen=True)
class TrainPlan:
    """Gaussians fitted to a dataset, by `rfgs train`."""

    kind: ClassVar[str] = "train"
    label: ClassVar[str] = "Train"

    out: str
    """Folder of the run, absolute."""
    dataset: str
    """Folder of the dataset, absolute."""
    radio: str = "wifi"
    frames: str = ""
    iterations: int = 0
    """Steps per frame; 0 takes the recipe's own number."""
    gaussians: int = 0
    """Moving Gaussians at the start; 0 takes the recipe's own number."""
    seed: int = 0

    def arguments(self) -> list[str]:
        """Command line behind the Python program."""
        return [
            *("-m", "rfgs_core.cli", "train", self.dataset, f"--out={self.out}"),
            *(f"--radio={self.radio}", f"--seed={self.seed}"),
            *([f"--frames={self.frames}"] if self.frames else []),
            *([f"--iterations={self.iterations}"] if self.iterations else []),
            *([f"--gaussians={self.gaussians}"] if self.gaussians else []),
        ]

    def complete(self) -> bool:
        """Whether every frame is fitted: the joint cloud is written after the last."""
        return (Path(self.out) / "point_cloud.ply").is_file()


@dataclass(frozen=True)
class EvaluatePlan:
    """Metrics of a run beside its baselines, by `rfgs eval`."""

    kind: ClassVar[str] = "evaluate"
    label: ClassVar[str] = "Evaluate"

    out: str
    """Folder of the run, absolute."""
    oracle: bool = False
    """Also start the fit on the true surface, as the ceiling."""

    def arguments(self) -> list[str]:
        """Command line behind the Python program."""
        oracle = "--oracle" if self.oracle else "--no-oracle"
        return ["-m", "rfgs_core.cli", "eval", self.out, oracle]

    def complete(self) -> bool:
        """Whether the metrics are written, by this evaluation and not by an earlier one."""
        metrics, begun = Path(self.out) / "metrics.json", Path(self.out) / "log/job_evaluate.json"
        both = metrics.is_file() and begun.is_file()
        return both and metrics.stat().st_mtime >= begun.stat().st_mtime


Plan = GeneratePlan | TrainPlan | EvaluatePlan
KINDS: dict[str, type[Plan]] = {kind.kind: kind for kind in (GeneratePlan, TrainPlan, EvaluatePlan)}


def plan_to_json(plan: Plan) -> dict[str, Any]:
    """The plan as JSON, without the programs that it runs."""
    settings = {name: value for name, value in asdict(plan).items() if name not in _PROGRAMS}
    return {"kind": plan.kind, "settings": settings}


def with_blender(plan: Plan, blender: str) -> Plan:
    """A plan that was kept, with the program that opens its file; others need none."""
    return replace(plan, blender=blender) if isinstance(plan, GeneratePlan) else plan


def plan_of_json(value: Any, file: Path) -> Plan:
    """The plan of what `plan_to_json` gave.

    Args:
        value: What was read.
        file: Where, for messages.

    Raises:
        AddonError: It is something else.
    """
    try:
        kind = KINDS[value["kind"]]
        # Earlier versions kept a program there, which is not for a folder to name.
        settings = {k: v for k, v in dict(value["settings"]).items() if k not in _PROGRAMS}
        known = {spec.name: type(spec.default) for spec in fields(kind)}
        for name, text in settings.items():
            expected = known[name] if known[name] in (int, bool) else str
            if type(text) is not expected or "\0" in str(text):
                raise TypeError(name)
        plan = kind(**settings)
        paths = [Path(settings[name]) for name in ("out", "blend", "dataset") if name in settings]
    except (TypeError, KeyError, ValueError, AttributeError) as error:
        raise AddonError(
            f"{file}: no job of this add-on; delete it and start the job anew"
        ) from error
    if not all(path.is_absolute() for path in paths):
        raise AddonError(f"{file}: expected absolute paths; delete it and start the job anew")
    return plan
