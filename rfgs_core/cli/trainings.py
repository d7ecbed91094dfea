# SPDX-License-Identifier: Apache-2.0
"""Trainings that `rfgs train` is asked for: where each run lies, and how it is made."""

from __future__ import annotations

import contextlib
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from rfgs_core.settings import TrainConfig

if TYPE_CHECKING:
    from rfgs_core.cli.train import TrainArgs
    from rfgs_core.dataset import Dataset, Sequence
    from rfgs_core.study.parts import Parcel

#: Asks for every sequence of a dataset, unless one is called so.
ALL = "all"


@dataclass(frozen=True)
class Training:
    """One sequence as one radio hears it; by itself, as frames start from those before."""

    args: TrainArgs
    """Dataset and settings, which all trainings of a command have in common."""
    sequence: str
    """Which sequence."""
    radio: str
    """Which radio."""
    run: Path
    """Folder of its run within that of all."""

    def __str__(self) -> str:
        return self.run.name

    @property
    def dataset(self) -> Path:
        """Folder of its dataset within a worker's; sequences travel one by one."""
        return Path(".dataset") / self.sequence

    @property
    def made(self) -> tuple[Path, ...]:
        """Its run."""
        return (self.run,)

    def is_made(self, out: Path) -> bool:
        """Whether the run is there, fitted and coloured.

        Raises:
            RfgsError: It cannot be trained, or something else lies in its place.
        """
        from rfgs_core.render.view import SHADER_FILE
        from rfgs_core.run.begun import finished_run

        data = self._opened()
        run = finished_run(
            out / self.run, data.dataset, data.sequence, self.radio, data.frames, data.config,
            people=self.args.people, excess=self.args.excess_path,
        )  # fmt: skip
        if run is None:
            return False
        coloured = not self.args.shader or bool(_why_grey(data))
        return coloured or (run.path / SHADER_FILE).exists()

    def make(self, out: Path) -> None:
        """Trains, then colours the result where the dataset has pictures.

        Raises:
            RfgsError: It cannot be trained, or something else lies in its place.
        """
        from rfgs_core.cli.calls import watched
        from rfgs_core.render.shader import ShaderConfig
        from rfgs_core.render.view import SHADER_FILE, fit_run_shader
        from rfgs_core.run.training import train_sequence
        from rfgs_core.seeds import sub_seed

        args, data, place = self.args, self._opened(), out / self.run
        why_grey = _why_grey(data) if args.shader else ""
        if why_grey:
            sys.stderr.write(
                f"training without the shader, so that Gaussians stay grey: {why_grey}\n"
            )
        with watched(place) if args.view else contextlib.nullcontext():
            trained = train_sequence(
                data.dataset, data.sequence, self.radio, data.frames, data.config, place,
                data.encoder_file, people=args.people, excess=args.excess_path, log=args.log,
            )  # fmt: skip
        if args.shader and not why_grey and not (place / SHADER_FILE).exists():
            config = data.config
            colours = ShaderConfig.for_recipe(config.recipe, sub_seed(config.seed, "shader"))
            fit_run_shader(trained, colours, config.device)

    def parcel(self, out: Path) -> Parcel:
        """What a worker gets: the sequence, the encoder, and what is there of the run already."""
        from rfgs_core.schedule.archive import packed
        from rfgs_core.study.parts import Parcel

        _, encoder_file = settings_of(self.args)
        encoder = encoder_file.read_bytes() if encoder_file else b""
        place, source = out / self.run, self.args.dataset
        begun = packed(place) if place.is_dir() else b""
        wanted = ("dataset.json", self.sequence)
        return Parcel(Sent(self, encoder, begun), lambda: packed(source, only=wanted))

    def _opened(self) -> _Data:
        """Data and settings.

        Raises:
            RfgsError: The dataset does not hold what is asked for.
        """
        from rfgs_core.dataset import open_dataset
        from rfgs_core.errors import RfgsError
        from rfgs_core.frames import chosen_frames
        from rfgs_core.measure.observations import packets_to_read

        args, radio = self.args, self.radio
        config, encoder_file = settings_of(args)
        dataset = open_dataset(args.dataset)
        sequence = dataset.sequence(self.sequence)
        if radio not in sequence.radios:
            raise RfgsError(
                f"{args.dataset} ({sequence.name}) has no radio {radio!r}; "
                f"it has {', '.join(sequence.radios)}"
            )
        packets = packets_to_read(args.packets, sequence, radio, config)
        frames = chosen_frames(args.frames, sequence.frames)
        return _Data(dataset, sequence, frames, replace(config, packets=packets), encoder_file)


@dataclass(frozen=True)
class Sent:
    """A training as a worker makes it: what it reads has come along."""

    training: Training
    """Which one."""
    encoder: bytes
    """Its learned encoder's file; empty without one."""
    begun: bytes
    """Archive of what was there of its run; empty for nothing."""

    def __str__(self) -> str:
        return str(self.training)

    @property
    def dataset(self) -> Path:
        """Folder of its dataset within the worker's."""
        return self.training.dataset

    @property
    def made(self) -> tuple[Path, ...]:
        """Its run."""
        return self.training.made

    def make(self, out: Path) -> None:
        """Goes on with the run where it stopped.

        Raises:
            RfgsError: It cannot be trained.
        """
        from rfgs_core.files import write_bytes
        from rfgs_core.schedule.archive import unpack

        args = replace(self.training.args, dataset=out / self.dataset)
        if self.encoder:
            file = args.dataset.with_name("encoder.npz")
            write_bytes(file, self.encoder)
            args = replace(args, encoder=f"cnn:{file}")
        if self.begun:
            unpack(self.begun, out / self.training.run)
        replace(self.training, args=args).make(out)


@dataclass(frozen=True)
class _Data:
    """What a training reads, and how it is fitted."""

    dataset: Dataset
    sequence: Sequence
    frames: list[int]
    config: TrainConfig
    encoder_file: Path | None


def settings_of(args: TrainArgs) -> tuple[TrainConfig, Path | None]:
    """Settings of all trainings, and the file of their learned encoder.

    Raises:
        RfgsError: They do not go together, or there is no such encoder.
    """
    from rfgs_core.run.encoders import with_encoder

    config = TrainConfig.chosen(
        args.options, iterations=args.iterations, num_gaussians=args.gaussians
    )
    return with_encoder(config, args.encoder)


def trainings(args: TrainArgs) -> list[Training]:
    """Trainings that are asked for: runs SEQUENCE-RADIO in OUT; of a single one OUT is the run.

    Raises:
        RfgsError: There is no such dataset or sequence, it is not said which one or which radio of
            several is meant, or runs would get the same name.
    """
    from rfgs_core.errors import RfgsError

    sequences = _sequences(args)
    radios = dict.fromkeys(args.radio or _only_radio(args.dataset, sequences[0]))
    pairs = [(sequence, radio) for sequence in sequences for radio in radios]
    if len(pairs) == 1:
        return [Training(args, *pairs[0], Path(args.out.name))]
    chosen = [Training(args, *pair, Path("-".join(pair))) for pair in pairs]
    places: dict[Path, Training] = {}
    for one in chosen:
        if (other := places.setdefault(one.run, one)) is not one:
            raise RfgsError(
                f"{one.run}: radio {one.radio} of {one.sequence} and radio {other.radio} of "
                f"{other.sequence} would share this folder; train them one by one"
            )
    return chosen


def _only_radio(dataset: Path, sequence: str) -> list[str]:
    """The radio of a sequence that has one."""
    from rfgs_core.dataset import open_dataset
    from rfgs_core.errors import RfgsError

    there = open_dataset(dataset).sequence(sequence).radios
    if len(there) != 1:
        raise RfgsError(f"--radio is missing; {dataset} has {', '.join(there)}")
    return there


def _sequences(args: TrainArgs) -> list[str]:
    """Names of the sequences that are asked for."""
    from rfgs_core.dataset import open_dataset
    from rfgs_core.errors import RfgsError

    dataset = open_dataset(args.dataset)
    there, asked = dataset.sequences, list(dict.fromkeys(args.sequence))
    if not asked and len(there) != 1:
        raise RfgsError(
            f"{dataset.path}: ambiguous sequence: it holds {', '.join(there)}; choose some with "
            f"--sequence, or all with --sequence {ALL}"
        )
    if not asked or (asked == [ALL] and ALL not in there):
        return there
    for name in asked:
        if name not in there:
            raise RfgsError(
                f"{dataset.path}: no sequence {name!r}; expected one of {', '.join(there)}"
            )
    return asked


def _why_grey(data: _Data) -> str:
    """Why there are no pictures that the shader may be fitted to; empty where there are some."""
    from rfgs_core.render.view import split_pictures

    missing = [name for name in ("images", "mask") if name not in data.dataset.has]
    if missing:
        return f"the dataset holds no {' and no '.join(missing)}"
    if split_pictures(data.sequence, data.frames, "train"):
        return ""
    return "all pictures of these frames are held out for testing"
