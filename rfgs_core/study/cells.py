# SPDX-License-Identifier: Apache-2.0
"""Cells of the paper's tables: methods × radios × seeds on generated scenes, a file each."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

from msgspec import Struct

from rfgs_core.dataset import Dataset, open_dataset
from rfgs_core.errors import RfgsFormatError
from rfgs_core.evaluate.field_run import Given, fit_fields
from rfgs_core.evaluate.metrics import METHOD, evaluate_method, evaluate_run
from rfgs_core.evaluate.provenance import hardware, now, versions
from rfgs_core.evaluate.residual import GAUSSIANS_ALONE
from rfgs_core.evaluate.scene import EvaluatedRun
from rfgs_core.links import refuse_link
from rfgs_core.measure.observations import observe
from rfgs_core.neural.settings import FieldSettings
from rfgs_core.radio import preset
from rfgs_core.records import record
from rfgs_core.render.bench import frames_per_second
from rfgs_core.run import Run
from rfgs_core.run.training import train_sequence
from rfgs_core.seals import read_sealed_json, write_sealed_json
from rfgs_core.seeds import sub_seed
from rfgs_core.settings import TrainConfig, TrainOptions
from rfgs_core.study.ablation import VARIANTS
from rfgs_core.study.cases import SCENES

SizeName = Literal["smoke", "paper-cpu", "full"]
TableName = Literal["table1", "table2", "table3"]

#: Settings of neural fields that `rfgs bench fields` found best, see `docs/results/fields.json`.
TUNED: dict[tuple[str, str], dict[str, Any]] = {
    ("nerf", "features"): {"octaves": 4, "contrast": 2.0},
    ("mip", "features"): {"octaves": 4, "contrast": 1.0},
    ("ngp", "features"): {"finest_m": 0.06, "contrast": 2.0},
    ("nerf", "propagation"): {"octaves": 4, "learning_rate": 2e-3},
    ("mip", "propagation"): {"octaves": 4, "learning_rate": 2e-3},
    ("ngp", "propagation"): {"finest_m": 0.06, "learning_rate": 2e-3},
}


@dataclass(frozen=True)
class Size:
    """How much of everything a table is made of."""

    scenes: tuple[str, ...]
    """Scenes."""
    seeds: int
    """Seeds of trainings; the data have seed 0."""
    frames: str | None
    """Frames of each scene; None takes the study's."""
    field_steps: int
    """Adam steps of neural fields."""
    field_width: int
    """Width of their networks."""
    paper_steps: int
    """Adam steps of the paper's recipe."""
    grid_side: int
    """Sample points per side, of the paper's recipe and neural fields alike."""
    refine_levels: int
    """How often sample points are refined, of both."""


SIZES: dict[SizeName, Size] = {
    "smoke": Size(("living_room_walk",), 2, "10:40:30", 200, 64, 500, 32, 2),
    "paper-cpu": Size(tuple(SCENES), 3, None, 2000, 128, 10_000, 64, 0),
    "full": Size(tuple(SCENES), 5, None, 10_000, 256, 10_000, 64, 0),
}

#: Methods of ours that are trained, and the options that make them.
TRAINED: dict[str, TrainOptions] = {
    "rfgs": TrainOptions(),
    "rfgs_no_limbs": TrainOptions(limbs="off"),
    "paper": TrainOptions(recipe="paper"),
    "paper_prior": TrainOptions(recipe="paper", start="prior"),
}
#: The paper's recipe from our start, whole and less one part at a time; whole, it is table 1's
#: `paper_prior`. From the paper's start, a cell takes too long for a small table.
ABLATED: dict[str, TrainOptions] = {
    row.method: replace(TRAINED["paper_prior"], without=row.without, density=row.density)
    for row in VARIANTS
}
#: Methods with neural fields.
FIELDS: dict[str, FieldSettings] = {
    f"{kind}_{objective}" + ("_prior" if prior else ""): FieldSettings(
        kind=kind,  # type: ignore[arg-type]
        objective=objective,  # type: ignore[arg-type]
        prior=prior,
        **changes,
    )
    for (kind, objective), changes in TUNED.items()
    for prior in (False, True)
}


@dataclass(frozen=True)
class Table:
    """What one of the paper's tables compares."""

    radios: tuple[str, ...]
    """Radios."""
    methods: tuple[str, ...]
    """Names of `TRAINED`, `ABLATED` or `FIELDS`."""


TABLES: dict[TableName, Table] = {
    "table1": Table(("wifi", "mmwave"), (*TRAINED, *FIELDS)),
    # RF-GS brings every baseline, so that the strongest is named.
    "table2": Table(("wifi",), ("rfgs", "paper", *ABLATED)),
    "table3": Table(("wifi", "mmwave", "uwb", "sar"), ("rfgs",)),
}


@dataclass(frozen=True)
class Cell:
    """One method on one scene and radio with one seed."""

    scene: str
    radio: str
    method: str
    """A name of `TRAINED`, `ABLATED` or `FIELDS`; `rfgs` brings all baselines without training."""
    seed: int

    @property
    def dataset(self) -> Path:
        """Folder of the dataset within the table's; seeds and methods share it."""
        return Path("data") / f"{self.scene}-{self.radio}"

    @property
    def name(self) -> str:
        """Name of its file and of its run."""
        return f"{self.scene}-{self.radio}-{self.method}-seed{self.seed}"

    def generate(self, out: Path, size: Size) -> tuple[str, ...]:
        """Arguments of the command that makes the dataset: fast tracer, people over walls too.

        The fast tracer's antennas stand still, and Sionna RT traces those that move. Where a radio
        is not traced over walls, people are heard directly.
        """
        scene, radio = SCENES[self.scene], preset(self.radio)
        depth = min(max(2, scene.least_depth), radio.deepest)
        tracer = "sionna" if radio.antennas_move else "fast"
        return (
            *("dataset_factory", "generate", self.scene, "--radio", self.radio),
            *("--frames", size.frames or scene.frames, "--no-images", "--tracer", tracer),
            *("--depth", str(depth), "--out", str(out / self.dataset)),
        )


class _Geometry(Struct):
    f05: float | None = None
    f10: float | None = None
    f20: float | None = None
    centroid_m: float | None = None


class _Channel(Struct):
    element_snr_db: float | None = None
    subcarrier_snr_db: float | None = None


class _Groups(Struct):
    geometry: _Geometry
    rf: _Channel


class _Made(Struct):
    """What is read of a cell's file."""

    scene: str
    radio: str
    method: str
    settings: dict[str, Any]
    methods: dict[str, _Groups]
    train_s: float
    gaussians: int | None = None
    render_fps: float | None = None


def cells(table: Table, size: Size, seeds: int) -> list[Cell]:
    """All cells: first one seed of everything, of each dataset ours first.

    A scene that nobody is heard in by as few bounces as a radio is traced over has no cell of it.
    """
    return [
        Cell(scene, radio, method, seed)
        for seed in range(seeds)
        for scene in size.scenes
        for radio in table.radios
        if SCENES[scene].least_depth <= preset(radio).deepest
        for method in table.methods
    ]


def stored(cell: Cell, out: Path, size: Size) -> dict[str, Any] | None:
    """What a cell's file says, if it was made by the same settings.

    Raises:
        RfgsFormatError: The file is damaged, or would lie elsewhere, where a link leads.
    """
    path = out / "cells" / f"{cell.name}.json"
    refuse_link(path)
    if not path.exists():
        return None
    remedy = "delete it to make it again"
    found = read_sealed_json(path, remedy)
    record(path, found, _Made, remedy)
    if (found["scene"], found["radio"], found["method"]) != (cell.scene, cell.radio, cell.method):
        raise RfgsFormatError(f"{path}: tells of another cell; {remedy}")
    return found if found.get("settings") == settings_of(cell, size) else None


def settings_of(cell: Cell, size: Size) -> dict[str, Any]:
    """All settings of a cell, as JSON holds them."""
    config = asdict(train_config(cell, size))
    # Which device a cell was made on is no setting of it.
    del config["device"]
    own: dict[str, Any] = {"train": {**config, "without": list(config["without"])}}
    own["frames"] = size.frames or SCENES[cell.scene].frames
    if cell.method in FIELDS:
        own["field"] = asdict(field_settings(cell, size))
    return own


def train_config(cell: Cell, size: Size) -> TrainConfig:
    """Settings of a training, or of what a neural field takes from one."""
    fields = TRAINED["paper_prior"]
    options = {**TRAINED, **ABLATED}.get(cell.method, fields)
    steps = size.paper_steps if options.recipe == "paper" else None
    config = TrainConfig.chosen(replace(options, seed=cell.seed), iterations=steps)
    if options.recipe == "paper":
        config = replace(config, grid_side=size.grid_side, refine_levels=size.refine_levels)
    return config


def field_settings(cell: Cell, size: Size) -> FieldSettings:
    """Settings of a neural field of this size."""
    return replace(
        FIELDS[cell.method], seed=cell.seed, steps=size.field_steps, width=size.field_width
    )


def make(cell: Cell, out: Path, size: Size) -> dict[str, Any]:
    """Trains and evaluates a cell, and writes its file.

    Raises:
        RfgsError: Nobody is heard, or the dataset is missing.
    """
    dataset = open_dataset(out / cell.dataset)
    maker = _field if cell.method in FIELDS else _trained
    run, groups = maker(cell, dataset, out, size)
    result = {
        **asdict(cell),
        "settings": settings_of(cell, size),
        "dataset": dataset.fingerprint,
        "trace_depth": dataset.sequence().trace_depth(cell.radio),
        "methods": groups,
        "train_s": run.config.train_s,
        **_rendering(run),
        "hardware": hardware(),
        "versions": versions(),
        "date": now(),
    }
    write_sealed_json(out / "cells" / f"{cell.name}.json", result)
    return result


def _rendering(run: EvaluatedRun) -> dict[str, Any]:
    """How many moving Gaussians the first frame has, and how fast it is drawn."""
    if not isinstance(run, Run):
        return {}
    gaussians = run.moving(run.frames[0])
    return {"gaussians": len(gaussians), "render_fps": frames_per_second(gaussians)}


def _trained(
    cell: Cell, dataset: Dataset, out: Path, size: Size
) -> tuple[EvaluatedRun, dict[str, Any]]:
    """Gaussians; with `rfgs` all baselines that are looked at the same frames."""
    sequence = dataset.sequence()
    (out / "runs").mkdir(parents=True, exist_ok=True)
    run = train_sequence(
        dataset, sequence, cell.radio, sequence.frames, train_config(cell, size),
        out / "runs" / cell.name,
    )  # fmt: skip
    if cell.method != "rfgs":
        return run, _named(cell.method, evaluate_method(run))
    metrics = evaluate_run(run, oracle=False)
    own = {group: metrics[group] for group in ("geometry", "rf")}
    others = {
        name: {group: values[group] for group in own}
        for name, values in metrics["baselines"].items()
        if any(value is not None for group in own for value in values[group].values())
    }
    return run, {"rfgs": own, **others}


def _field(
    cell: Cell, dataset: Dataset, out: Path, size: Size
) -> tuple[EvaluatedRun, dict[str, Any]]:
    """A neural field per frame."""
    sequence = dataset.sequence()
    people = sum(1 for row in sequence.instances if row["class"] == "person")
    config = replace(train_config(cell, size), bodies=max(people, 1))
    shared = replace(config, seed=0)
    run = fit_fields(
        dataset, cell.radio, sequence.frames, field_settings(cell, size), config,
        lambda frame, _: _given(dataset.path, cell.radio, frame, shared), out,
    )  # fmt: skip
    return run, _named(cell.method, evaluate_method(run))


def _named(method: str, groups: dict[str, Any]) -> dict[str, Any]:
    rows = {method: groups[METHOD], f"{method}, alone": groups[GAUSSIANS_ALONE]}
    return {
        name: {group: values[group] for group in ("geometry", "rf")}
        for name, values in rows.items()
    }


@lru_cache(maxsize=8)
def _given(dataset: Path, radio: str, frame: int, config: TrainConfig) -> Given:
    """What fields of a frame share, over all seeds."""
    observations = observe(open_dataset(dataset).sequence(), radio, frame)
    return Given.of(observations, config, sub_seed(0, "given", radio, frame))
