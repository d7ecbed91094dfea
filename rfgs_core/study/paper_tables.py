# SPDX-License-Identifier: Apache-2.0
"""What the paper's tables consist of: sizes, methods, and a cell for each seed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from rfgs_core.errors import RfgsError
from rfgs_core.neural.direct_sum import SumSettings
from rfgs_core.neural.settings import FieldSettings
from rfgs_core.neural.signal_splat import SplatSettings
from rfgs_core.radio import preset
from rfgs_core.settings import TrainOptions
from rfgs_core.study.ablation import VARIANTS
from rfgs_core.study.cases import EVERY_SCENE, SCENES

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
#: Sample points per side of neural fields, at every size, and how often they are refined: those
#: that the settings were searched with. On a grid of 64³ alone, as the paper's, fields find nobody.
FIELD_POINTS = (32, 2)


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
    """Sample points per side, of the paper's recipe."""
    refine_levels: int
    """How often they are refined."""


SIZES: dict[SizeName, Size] = {
    "smoke": Size(("living_room_walk",), 1, "10:40:30", 200, 64, 500, 32, 2),
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


#: Published fields of channels, each fitted to the channels of a frame.
CHANNEL_FIELDS: dict[str, SumSettings | SplatSettings] = {
    "ngrf": SumSettings(places=2000, tried=16, steps=15, apart_m=0.2, ridge=1.0, entries=2500),
    "wrfgs": SplatSettings(),
}


@dataclass(frozen=True)
class Table:
    """What one of the paper's tables compares."""

    radios: tuple[str, ...]
    """Radios."""
    methods: tuple[str, ...]
    """Names of `TRAINED`, `ABLATED`, `FIELDS` or `CHANNEL_FIELDS`."""


TABLES: dict[TableName, Table] = {
    "table1": Table(("wifi", "mmwave"), (*TRAINED, *FIELDS, *CHANNEL_FIELDS)),
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
    """A name of `TRAINED`, `ABLATED`, `FIELDS` or `CHANNEL_FIELDS`; `rfgs` brings all baselines
    without training."""
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
        scene, radio = EVERY_SCENE[self.scene], preset(self.radio)
        depth = min(max(2, scene.least_depth), radio.deepest)
        tracer = "sionna" if radio.antennas_move else "fast"
        return (
            *("dataset_factory", "generate", self.scene, "--radio", self.radio),
            *("--frames", size.frames or scene.frames, "--no-images", "--tracer", tracer),
            *("--depth", str(depth), "--out", str(out / self.dataset)),
        )


def cells(table: Table, size: Size, seeds: int) -> list[Cell]:
    """All cells: first one seed of everything, of each dataset ours first.

    A scene that nobody is heard in by as few bounces as a radio is traced over has no cell of it.
    """
    return [
        Cell(scene, radio, method, seed)
        for seed in range(seeds)
        for scene in size.scenes
        for radio in table.radios
        if EVERY_SCENE[scene].least_depth <= preset(radio).deepest
        for method in table.methods
    ]


def narrowed(
    name: TableName,
    size: Size,
    scenes: Sequence[str] = (),
    radios: Sequence[str] = (),
    methods: Sequence[str] = (),
) -> tuple[Table, Size]:
    """A table of any scenes, and of some of its radios and methods; empty takes what it has.

    Raises:
        RfgsError: A scene is unknown, or the table has no such radio or method.
    """
    table = TABLES[name]
    for kind, asked, known in (
        ("scenes", scenes, tuple(EVERY_SCENE)),
        ("radios", radios, table.radios),
        ("methods", methods, table.methods),
    ):
        for one in asked:
            if one not in known:
                raise RfgsError(f"--{kind} {one}: expected some of {', '.join(known)} in {name}")
    # Whoever names one twice wants it once.
    narrow = Table(_each(radios or table.radios), _each(methods or table.methods))
    return narrow, replace(size, scenes=_each(scenes or size.scenes))


def _each(names: Sequence[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(names))
