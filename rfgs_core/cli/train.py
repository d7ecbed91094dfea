# SPDX-License-Identifier: Apache-2.0
"""`rfgs train`: fits Gaussians to the channel of a sequence."""

from __future__ import annotations

import contextlib
import sys
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from rfgs_core.settings import Packets, TrainConfig, TrainOptions

if TYPE_CHECKING:
    from rfgs_core.dataset import Dataset, Sequence


@dataclass(frozen=True)
class TrainArgs:
    """Fits Gaussians to the channel of a sequence, frame by frame, and keeps them in a run.

    Pictures are only used afterwards, to colour frozen Gaussians for display. Running the same
    command again continues where it stopped.
    """

    dataset: tyro.conf.Positional[Path]
    """Dataset folder, as `rfgs-factory generate` makes it."""
    radio: str
    """Which of the dataset's radios, for example wifi."""
    out: Path
    """Folder of the run."""
    sequence: str | None = None
    """Which sequence; may be left out when there is only one."""
    frames: str | None = None
    """Frames A:B[:STEP] (inclusive), or one number; all when left out."""
    encoder: str = "matched_filter"
    """What gives the 32 features at a point: matched_filter; cnn:FILE with a file of
    `rfgs encode`; or paths, which reads traced paths (of datasets generated with --paths)."""
    people: Literal["auto", "sensed", "told"] | int = "auto"
    """How many people there are: sensed, counted by the radio alone; told, by the dataset's
    instances; a number, so many; or auto, sensed where the radio allows it, else told."""
    excess_path: Literal["auto"] | float = "auto"
    """What waves travel further to people and back than straight lines, as through a wall [m]:
    auto looks for it where people can be sensed; 0 leaves it."""
    packets: Packets | None = None
    """Of several packets (chirps) per frame: all, which tells the channel's change from noise by
    delay, direction and Doppler; or first, the one at the frame's own time. Left out: all, but
    first with --calibrate or with an --observe that has no phases."""
    iterations: int | None = None
    """Adam steps per frame; the recipe's own number when left out."""
    gaussians: int | None = None
    """Moving Gaussians at the start; the recipe's own number when left out."""
    log: bool = False
    """Write curves of loss and number of Gaussians into OUT/log, for `tensorboard --logdir`."""
    view: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    """Watch meanwhile: serves the viewer's page, prints its address, and shows each frame as soon
    as it is fitted; ends with the training."""
    shader: Annotated[bool, tyro.conf.arg(name="shader")] = True
    """Colour the frozen Gaussians from training pictures afterwards, for display only. Without any
    such picture they stay grey."""
    options: Annotated[TrainOptions, tyro.conf.arg(name="")] = field(default_factory=TrainOptions)


def run(args: TrainArgs) -> int:
    """Trains, then colours the result where the dataset has pictures."""
    from rfgs_core.cli.calls import watched
    from rfgs_core.dataset import open_dataset
    from rfgs_core.errors import RfgsError
    from rfgs_core.frames import chosen_frames
    from rfgs_core.measure.observations import packets_to_read
    from rfgs_core.past import count_in_words
    from rfgs_core.render.shader import ShaderConfig
    from rfgs_core.render.view import fit_run_shader
    from rfgs_core.run.calibration import calibration_text
    from rfgs_core.run.encoders import with_encoder
    from rfgs_core.run.people import HeadCount
    from rfgs_core.run.training import train_sequence
    from rfgs_core.seeds import sub_seed

    config = TrainConfig.chosen(
        args.options, iterations=args.iterations, num_gaussians=args.gaussians
    )
    config, encoder_file = with_encoder(config, args.encoder)
    dataset = open_dataset(args.dataset)
    sequence = dataset.sequence(args.sequence)
    if args.radio not in sequence.radios:
        raise RfgsError(
            f"{args.dataset} ({sequence.name}) has no radio {args.radio!r}; "
            f"it has {', '.join(sequence.radios)}"
        )
    config = replace(config, packets=packets_to_read(args.packets, sequence, args.radio, config))
    frames = chosen_frames(args.frames, sequence.frames)
    shader = args.shader and _can_color(dataset, sequence, frames)
    with watched(args.out) if args.view else contextlib.nullcontext():
        trained = train_sequence(
            dataset, sequence, args.radio, frames, config, args.out, encoder_file,
            people=args.people, excess=args.excess_path, log=args.log,
        )  # fmt: skip
    if (heads := HeadCount.read(args.out)) is not None:
        sys.stdout.write(f"people: {heads}\n")
    if args.options.calibrate != "none":
        sys.stdout.write(f"offsets: {calibration_text(args.out, frames)}\n")
    if shader and not (args.out / "shader.npz").exists():
        seed = sub_seed(config.seed, "shader")
        fit_run_shader(trained, ShaderConfig.for_recipe(config.recipe, seed), config.device)
    sys.stdout.write(
        f"{args.out}: {count_in_words(len(frames), 'frame')}, "
        f"{len(trained.moving(frames[0]))} Gaussians, {trained.config.train_s:.0f} s; "
        f"next: rfgs eval {args.out}\n"
    )
    return 0


def _can_color(dataset: Dataset, sequence: Sequence, frames: list[int]) -> bool:
    """Whether there are pictures that the shader may be fitted to; says so where there are none."""
    from rfgs_core.render.view import split_pictures

    missing = [name for name in ("images", "mask") if name not in dataset.has]
    if missing:
        why = f"the dataset holds no {' and no '.join(missing)}"
    elif split_pictures(sequence, frames, "train"):
        return True
    else:
        why = "all pictures of these frames are held out for testing"
    sys.stderr.write(f"training without the shader, so that Gaussians stay grey: {why}\n")
    return False
