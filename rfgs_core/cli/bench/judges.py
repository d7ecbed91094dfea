# SPDX-License-Identifier: Apache-2.0
"""Parts of `rfgs bench` that judge results beside what knows less."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from rfgs_core.cli.bench.numbers import Part, need_at_least_one, note
from rfgs_core.dataset.observed import Observed


def flat(table: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Rows of a table as one dictionary, without what a row does not have."""
    return {
        f"{row}: {name}": value
        for row, values in table.items()
        for name, value in values.items()
        if value is not None
    }


@dataclass(frozen=True, kw_only=True)
class Tracers:
    """The fast tracer beside Sionna RT on our scenes, as `rfgs-factory tracers`."""

    json: Path | None = None
    """Also write the numbers to this file."""

    def run(self) -> int:
        """Traces and compares; exit code 0."""
        from rfgs_core.cli.calls import call

        call("dataset_factory", "tracers", *(["--json", self.json] if self.json else []))
        return 0


@dataclass(frozen=True, kw_only=True)
class Limbs(Part):
    """Joints and surface of a dataset's one person beside what knows less."""

    dataset: Path
    """The dataset, see `rfgs-factory generate`."""
    radio: str = "wifi"
    """Which of its radios."""
    network: Path | None = None
    """Network, as `rfgs limbs` makes it; left out: the one that comes with the package."""
    hold_out: bool = False
    """Hide what the dataset holds out, as training does."""
    channel: Observed = "clean"
    """clean: the traced channel; impaired: what `rfgs-factory impair` made of it. Of several
    packets per frame all are read."""

    def numbers(self) -> dict[str, Any]:
        """Judges every row on every frame."""
        from tqdm import tqdm

        from rfgs_core.bench import hardware
        from rfgs_core.dataset import open_dataset
        from rfgs_core.evaluate.limbs import limb_table
        from rfgs_core.limbs.weights import load_network, own_network

        sequence = open_dataset(self.dataset).sequence()
        freq_hz = sequence.coordinates(self.radio)["freq_hz"].values
        trained = load_network(self.network) if self.network else own_network(freq_hz)
        network = None if trained is None else trained.network
        with tqdm(total=len(sequence.frames), desc="limbs") as bar:
            table = limb_table(
                sequence, self.radio, network, sequence.frames,
                everything=not self.hold_out, channel=self.channel, on_frame=bar.update,
            )  # fmt: skip
        return {**flat(table), "frames": len(sequence.frames), **hardware()}


@dataclass(frozen=True, kw_only=True)
class People(Part):
    """How often people are counted right, or joints of real people in a public set.

    With --dataset, of ours: beside channels without any people. With --data, a set of others
    (MM-Fi, mmBody, HuPR, RT-Pose, M4Human): by our network, which saw synthetic radio alone.
    """

    dataset: Path | None = None
    """A dataset of ours, see `rfgs-factory generate`."""
    data: Path | None = None
    """Folder of a public set, see docs/captures.md."""
    radio: str = "wifi"
    """Which of the dataset's radios."""
    frames: str | None = None
    """Frames A:B[:STEP] (inclusive) of the dataset; all when left out."""
    hold_out: bool = False
    """Hide what the dataset holds out, as training does."""
    network: Path | None = None
    """Network for a public set, as `rfgs limbs` makes it; left out: the package's own."""

    def numbers(self) -> dict[str, Any]:
        """Counts people of a dataset, or judges joints of a public set."""
        from rfgs_core.errors import RfgsError

        if self.data is not None and self.dataset is not None:
            raise RfgsError(
                "bench people: expected either --dataset FOLDER of ours or "
                "--data FOLDER of a public set, not both"
            )
        if self.data is not None:
            return self._public_set(self.data)
        if self.dataset is None:
            raise RfgsError(
                "bench people: expected --dataset FOLDER of ours, see `rfgs-factory generate`, or "
                "--data FOLDER of a public set, see docs/captures.md"
            )
        return self._counted(self.dataset)

    def _counted(self, dataset: Path) -> dict[str, Any]:
        from tqdm import tqdm

        from rfgs_core.bench import hardware
        from rfgs_core.dataset import open_dataset
        from rfgs_core.evaluate.head_count import head_count_table
        from rfgs_core.frames import chosen_frames
        from rfgs_core.threads import one_torch_thread

        sequence = open_dataset(dataset).sequence()
        frames = chosen_frames(self.frames, sequence.frames)
        with tqdm(total=len(frames), desc="people") as bar, one_torch_thread():
            table = head_count_table(
                sequence, self.radio, frames, everything=not self.hold_out, on_frame=bar.update
            )
        return {**table, **hardware()}

    def _public_set(self, folder: Path) -> dict[str, Any]:
        from tqdm import tqdm

        from rfgs_core.bench import hardware
        from rfgs_core.limbs.weights import load_network, own_network
        from rfgs_core.people_sets.judge import MOST_FRAMES, judge_people
        from rfgs_core.radio import PRESETS
        from rfgs_core.threads import one_torch_thread

        own = own_network(PRESETS["mmwave"].freq_hz)
        trained = load_network(self.network) if self.network else own
        assert trained is not None
        with tqdm(total=MOST_FRAMES, desc="people") as bar, one_torch_thread():
            table = judge_people(folder, trained.network, bar.update)
        return {**table, **hardware()}


@dataclass(frozen=True, kw_only=True)
class Pictures(Part):
    """A run beside Gaussians fitted to the pictures themselves, what cameras alone would tell.

    Judged by test cameras and the true surface. The run's colours are those of `rfgs train`.
    """

    run_folder: Annotated[Path, tyro.conf.arg(name="run")]
    """The run, see `rfgs train`; its dataset holds pictures."""
    steps: int = 200
    """Adam steps on the pictures of each frame."""

    def numbers(self) -> dict[str, Any]:
        """Fits pictures of every frame, and compares."""
        from tqdm import tqdm

        from rfgs_core.bench import hardware
        from rfgs_core.evaluate.picture_bound import picture_table
        from rfgs_core.run import open_run

        need_at_least_one(steps=self.steps)
        run = open_run(self.run_folder)
        with tqdm(total=len(run.frames) * self.steps, desc="pictures", unit="step") as bar:
            table = picture_table(run, self.steps, bar.update)
        return {**flat(table), "frames": len(run.frames), **hardware()}


@dataclass(frozen=True, kw_only=True)
class Live(Part):
    """Six receivers of 1,000 packets/s each over UDP, made here: lost, latency, updates."""

    seconds: float = 60.0
    """How long to follow them [s]."""

    def numbers(self) -> dict[str, Any]:
        """Sends, receives and counts."""
        from rfgs_core.bench import hardware
        from rfgs_core.errors import RfgsError
        from rfgs_core.live.bench import bench_live

        if not 1.0 <= self.seconds <= 3600.0:
            raise RfgsError(f"--seconds {self.seconds:g}: expected 1 to 3600")
        return {**bench_live(self.seconds, note=note), **hardware()}


@dataclass(frozen=True, kw_only=True)
class Real(Part):
    """How well measured data are explained, each part beside a baseline."""

    data: Path
    """Folder of real captures; docs/captures.md names the files."""

    def numbers(self) -> dict[str, Any]:
        """Judges what is there."""
        from rfgs_core.real import bench_real

        return bench_real(self.data, note)


@dataclass(frozen=True, kw_only=True)
class Fields(Part):
    """The grid search that settings of neural fields, our baselines, were taken from."""

    dataset: Path
    """The dataset, see `rfgs-factory generate`."""
    radio: str = "wifi"
    """Which of its radios."""
    frame: int | None = None
    """Which frame; the first one when left out."""
    steps: int | None = None
    """Adam steps of each field; left out: a field's own number."""

    def numbers(self) -> dict[str, Any]:
        """Fits a field for every point of the grid."""
        from tqdm import tqdm

        from rfgs_core.bench import hardware
        from rfgs_core.dataset import open_dataset
        from rfgs_core.evaluate.field_search import candidates, search, search_table
        from rfgs_core.frames import chosen_frames
        from rfgs_core.neural.settings import FieldSettings
        from rfgs_core.settings import TrainConfig
        from rfgs_core.study.paper_tables import FIELD_POINTS

        need_at_least_one(steps=self.steps)
        dataset = open_dataset(self.dataset)
        frames = dataset.sequence().frames
        frame = chosen_frames(None if self.frame is None else str(self.frame), frames)[0]
        tried = candidates(self.steps or FieldSettings().steps)
        with tqdm(total=len(tried), desc="fields") as bar:
            points = TrainConfig(grid_side=FIELD_POINTS[0], refine_levels=FIELD_POINTS[1])
            rows = search(dataset, self.radio, frame, points, tried, bar.update)
        note(search_table(rows))
        names = ("kind", "objective", "learning_rate", "octaves", "finest_m", "contrast")
        table = {
            " ".join(f"{name} {row[name]}" for name in (*names, "evenness")): [
                row[key] for key in ("f05", "f10", "f20")
            ]
            for row in rows
        }
        steps = {"steps": tried[0].steps, "radio": self.radio, "frame": frame}
        return {**table, **steps, **hardware()}
