# SPDX-License-Identifier: Apache-2.0
"""Cells of the paper's tables: methods × radios × seeds on generated scenes, a file each."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from msgspec import Struct

from rfgs_core.dataset import Dataset, open_dataset
from rfgs_core.device import Device
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.evaluate.channel_fields import evaluate_channel_field
from rfgs_core.evaluate.field_run import FieldRun, Given, fit_fields
from rfgs_core.evaluate.metrics import METHOD, evaluate_method, evaluate_run
from rfgs_core.evaluate.provenance import hardware, now, versions
from rfgs_core.evaluate.residual import GAUSSIANS_ALONE
from rfgs_core.evaluate.scene import EvaluatedRun, Scene
from rfgs_core.frames import parse_frames
from rfgs_core.links import refuse_link
from rfgs_core.measure.observations import observe
from rfgs_core.neural.settings import FieldSettings
from rfgs_core.records import record
from rfgs_core.render.bench import frames_per_second
from rfgs_core.run import Run
from rfgs_core.run.training import train_sequence
from rfgs_core.seals import read_sealed_json, write_sealed_json
from rfgs_core.seeds import sub_seed
from rfgs_core.settings import TrainConfig
from rfgs_core.study.cases import EVERY_SCENE
from rfgs_core.study.paper_tables import (
    ABLATED,
    CHANNEL_FIELDS,
    FIELD_POINTS,
    FIELDS,
    TRAINED,
    Cell,
    Size,
)
from rfgs_core.threads import one_torch_thread


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
    voxels: list[tuple[float, float, float]] | None = None


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
    own["frames"] = size.frames or EVERY_SCENE[cell.scene].frames
    if cell.method in FIELDS:
        own["field"] = asdict(field_settings(cell, size))
    elif cell.method in CHANNEL_FIELDS:
        own["field"] = asdict(CHANNEL_FIELDS[cell.method])
    return own


def train_config(cell: Cell, size: Size) -> TrainConfig:
    """Settings of a training, or of what a neural field takes from one."""
    fields = TRAINED["paper_prior"]
    options = {**TRAINED, **ABLATED}.get(cell.method, fields)
    steps = size.paper_steps if options.recipe == "paper" else None
    config = TrainConfig.chosen(replace(options, seed=cell.seed), iterations=steps)
    if options.recipe == "paper":
        points = FIELD_POINTS if cell.method in FIELDS else (size.grid_side, size.refine_levels)
        config = replace(config, grid_side=points[0], refine_levels=points[1])
    return config


def field_settings(cell: Cell, size: Size) -> FieldSettings:
    """Settings of a neural field of this size."""
    return replace(
        FIELDS[cell.method], seed=cell.seed, steps=size.field_steps, width=size.field_width
    )


@dataclass(frozen=True)
class CellPart:
    """A cell as a part of a table, by itself."""

    cell: Cell
    """Which one."""
    size: Size
    """How much of everything."""
    device: Device = "cpu"
    """Where Gaussians are trained."""

    def __str__(self) -> str:
        return self.cell.name

    @property
    def dataset(self) -> Path:
        """Folder of its dataset within the table's."""
        return self.cell.dataset

    @property
    def made(self) -> tuple[Path, ...]:
        """Its run, if it has one, and its file."""
        fitted = self.cell.method in (*FIELDS, *CHANNEL_FIELDS)
        run = () if fitted else (Path("runs") / self.cell.name,)
        return (*run, Path("cells") / f"{self.cell.name}.json")

    def make(self, out: Path) -> None:
        """Trains and evaluates it."""
        make(self.cell, out, self.size, self.device)


def make(cell: Cell, out: Path, size: Size, device: Device = "cpu") -> dict[str, Any]:
    """Trains and evaluates a cell, and writes its file.

    Raises:
        RfgsError: Nobody is heard, or the dataset is missing or has other frames.
    """
    dataset = open_dataset(out / cell.dataset)
    settings = settings_of(cell, size)
    # A cell of another size may have left it.
    held, wanted = dataset.sequence().frames, list(parse_frames(settings["frames"]))
    if held != wanted:
        raise RfgsError(
            f"{dataset.path}: expected frames {wanted}, found {held}; delete it or choose "
            "another --out"
        )
    maker = _trained
    if cell.method in (*FIELDS, *CHANNEL_FIELDS):
        maker = _field if cell.method in FIELDS else _channel_field
    config = replace(train_config(cell, size), device=device)
    # Otherwise a field's sums, and so its figures, would follow from how many cores there are.
    with one_torch_thread():
        run, groups = maker(cell, dataset, out, config, size)
    result = {
        **asdict(cell),
        "settings": settings,
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
    """How many moving Gaussians the first frame has, and how fast it is drawn.

    Of a neural field also the voxels that this frame is scored by [m]: no run of it is kept.
    """
    if not isinstance(run, Run) or (isinstance(run, FieldRun) and not run.readouts):
        return {}
    first = run.frames[0]
    gaussians = run.moving(first)
    told = {"gaussians": len(gaussians), "render_fps": frames_per_second(gaussians)}
    if not isinstance(run, FieldRun):
        return told
    scene = Scene.of(run)
    return {**told, "voxels": scene.predicted(scene.score(first)).round(3).tolist()}


def _trained(
    cell: Cell, dataset: Dataset, out: Path, config: TrainConfig, size: Size
) -> tuple[EvaluatedRun, dict[str, Any]]:
    """Gaussians; with `rfgs` all baselines that are looked at the same frames."""
    run = trained(dataset, cell.radio, config, out / "runs" / cell.name)
    if cell.method != "rfgs":
        return run, _named(cell.method, evaluate_method(run))
    return run, beside_baselines(run)


def trained(dataset: Dataset, radio: str, config: TrainConfig, place: Path) -> Run:
    """A run of all frames of a dataset, in a folder of its own."""
    sequence = dataset.sequence()
    place.parent.mkdir(parents=True, exist_ok=True)
    frames = sequence.frames
    return train_sequence(dataset, sequence, radio, frames, config, place, excess="auto")


def beside_baselines(run: Run) -> dict[str, Any]:
    """Geometry and channel of a run of ours and of every baseline that has any, by name."""
    metrics = evaluate_run(run, oracle=False)
    own = {group: metrics[group] for group in ("geometry", "rf")}
    others = {
        name: {group: values[group] for group in own}
        for name, values in metrics["baselines"].items()
        if any(value is not None for group in own for value in values[group].values())
    }
    return {"rfgs": own, **others}


def _field(
    cell: Cell, dataset: Dataset, out: Path, config: TrainConfig, size: Size
) -> tuple[EvaluatedRun, dict[str, Any]]:
    """A neural field per frame."""
    sequence = dataset.sequence()
    people = sum(1 for row in sequence.instances if row["class"] == "person")
    config = replace(config, bodies=max(people, 1))
    shared = replace(config, seed=0)
    run = fit_fields(
        dataset, cell.radio, sequence.frames, field_settings(cell, size), config,
        lambda frame, _: _given(dataset.path, cell.radio, frame, shared), out,
    )  # fmt: skip
    return run, _named(cell.method, evaluate_method(run))


def _channel_field(
    cell: Cell, dataset: Dataset, out: Path, config: TrainConfig, size: Size
) -> tuple[EvaluatedRun, dict[str, Any]]:
    """A published field of channels per frame, of which no Gaussians are kept."""
    run = FieldRun.over(dataset, cell.radio, dataset.sequence().frames, config, out)
    groups, train_s = evaluate_channel_field(run, CHANNEL_FIELDS[cell.method], cell.seed)
    return replace(run, config=replace(run.config, train_s=train_s)), _named(cell.method, groups)


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
