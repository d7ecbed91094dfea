# SPDX-License-Identifier: Apache-2.0
"""`rfgs train`: fits Gaussians to the channels of sequences."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from rfgs_core.cli.spreading import Spreading, need_folder, watched
from rfgs_core.settings import Packets, TrainOptions

if TYPE_CHECKING:
    from rfgs_core.cli.trainings import Training
    from rfgs_core.schedule.spread import Spread


@dataclass(frozen=True)
class TrainArgs:
    """Fits Gaussians to the channel of a sequence, frame by frame, and keeps them in a run.

    Pictures are only used afterwards, to colour frozen Gaussians for display. Running the same
    command again continues where it stopped. Several sequences and radios are trained one after
    another, or side by side by --workers or a --scheduler, with the same result; one that fails is
    named, and the others go on.
    """

    dataset: tyro.conf.Positional[Path]
    """Dataset folder, as `rfgs-factory generate` makes it."""
    out: Path
    """Folder of the run; with several sequences or radios, of their runs SEQUENCE-RADIO."""
    radio: tyro.conf.UseAppendAction[tuple[str, ...]] = ()
    """Which of the dataset's radios, for example wifi; repeat the option for several. May be left
    out when there is only one."""
    sequence: tyro.conf.UseAppendAction[tuple[str, ...]] = ()
    """Which sequence, or all; repeat the option for several. May be left out when there is only
    one."""
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
    """Write curves of loss and number of Gaussians into log of the run's folder, for
    `tensorboard --logdir`."""
    view: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    """Watch meanwhile: serves the viewer's page, prints its address, and shows each frame as soon
    as it is fitted; ends with the training. Of a single run that is trained here."""
    shader: Annotated[bool, tyro.conf.arg(name="shader")] = True
    """Colour the frozen Gaussians from training pictures afterwards, for display only. Without any
    such picture they stay grey."""
    spread: Annotated[Spreading, tyro.conf.arg(name="")] = field(default_factory=Spreading)
    options: Annotated[TrainOptions, tyro.conf.arg(name="")] = field(default_factory=TrainOptions)


def run(args: TrainArgs) -> int:
    """Trains and says where to go on; exit code 1 when some of several runs have failed."""
    from rfgs_core.cli.trainings import settings_of, trainings
    from rfgs_core.errors import RfgsError

    settings_of(args)
    chosen = trainings(args)
    if args.view and (len(chosen) > 1 or args.spread.scheduler):
        raise RfgsError(
            "--view watches a single run while it is trained here; expected one --sequence and "
            "one --radio, without --scheduler"
        )
    spread = args.spread.checked()
    if len(chosen) > 1:
        return _train_many(chosen, args.out, spread)
    if spread.workers > 1 and not spread.scheduler:
        sys.stderr.write("one run keeps one process busy; --workers spreads several\n")
    if spread.scheduler:
        # The run's folder comes back whole, and takes its place by name.
        place = Path(os.path.abspath(args.out))
        place.parent.mkdir(parents=True, exist_ok=True)
        named = [replace(chosen[0], run=Path(place.name))]
        for _one, failure in _outcomes(named, place.parent, spread, lambda _: None):
            if failure:
                raise RfgsError(failure)
    else:
        chosen[0].make(args.out.parent)
    fitted, *about = _account(args.out)
    sys.stdout.write("".join(f"{line}\n" for line in about))
    sys.stdout.write(f"{args.out}: {fitted}; next: rfgs eval {args.out}\n")
    return 0


def _train_many(chosen: Sequence[Training], out: Path, spread: Spread) -> int:
    """Trains into folders of `out`, and tells of each when it is there or has failed."""
    from tqdm import tqdm

    from rfgs_core.errors import RfgsError
    from rfgs_core.locks import alone_in
    from rfgs_core.run.config import CONFIG_FILE

    need_folder(out)
    for name, what in ((CONFIG_FILE, "a run"), ("dataset.json", "a dataset")):
        if (out / name).exists():
            raise RfgsError(
                f"{out} is {what}; expected a folder for {len(chosen)} runs, choose another --out"
            )
    out.mkdir(parents=True, exist_ok=True)
    failed = 0
    with alone_in(out, out, "rfgs train"):
        walk = partial(_outcomes, chosen, out, spread)
        for one, failure in watched(walk, len(chosen), "trainings", "run"):
            place = out / one.run
            try:
                said = f"failed: {failure}" if failure else "; ".join(_account(place))
            except RfgsError as error:
                # A file of a run that was finished before is damaged.
                said = f"failed: {error}"
            failed += said.startswith("failed: ")
            tqdm.write(f"{place}: {said}")
    left = f", {failed} failed" if failed else f"; next: rfgs eval {out / chosen[0].run}"
    sys.stdout.write(f"{out}: {len(chosen) - failed} of {len(chosen)} runs are trained{left}\n")
    return 1 if failed else 0


def _outcomes(
    chosen: Sequence[Training], out: Path, spread: Spread, tell: Callable[[str], None]
) -> Iterator[tuple[Training, str]]:
    """Runs as they are there, and why they are not; first what is finished."""
    from rfgs_core.run.folder import open_run
    from rfgs_core.study import parts

    for one, failure in parts.outcomes(
        chosen, out, spread, lambda one: one.is_made(out), None, tell,
        lambda one: one.parcel(out),
    ):  # fmt: skip
        if not failure:
            # At a worker, the dataset was elsewhere.
            open_run(out / one.run).with_dataset(one.args.dataset)
        yield one, failure


def _account(place: Path) -> list[str]:
    """What was fitted of a run, then how many people there are, and its offsets if it has some."""
    from rfgs_core.past import count_in_words
    from rfgs_core.run.calibration import calibration_text
    from rfgs_core.run.folder import open_run
    from rfgs_core.run.people import HeadCount

    trained = open_run(place)
    frames, train_s = trained.frames, trained.config.train_s
    said = [
        f"{count_in_words(len(frames), 'frame')}, {len(trained.moving(frames[0]))} Gaussians, "
        f"{train_s:.0f} s"
    ]
    if (heads := HeadCount.read(place)) is not None:
        said.append(f"people: {heads}")
    if trained.calibrated:
        said.append(f"offsets: {calibration_text(place, frames)}")
    return said
