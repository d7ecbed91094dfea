# SPDX-License-Identifier: Apache-2.0
"""What the stages of a training cost, so that the time left is right from the first frame on."""

from __future__ import annotations

import os
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass

from tqdm import tqdm

from rfgs_core.dataset import Sequence
from rfgs_core.past import (
    Clock,
    Speed,
    Stage,
    count_in_words,
    forecast,
    in_words,
    note_speed,
    size_in_words,
)
from rfgs_core.run.config import RunConfig
from rfgs_core.run.folder import Run


@dataclass(frozen=True)
class Costs:
    """Time of one frame's stages [s]."""

    find_s: float
    """Finding bodies and drawing Gaussians."""
    solve_s: float
    """Solving reflectivities."""
    step_s: float
    """One step of the refinement."""

    def frame_s(self, iterations: int) -> float:
        """Time of a frame with so many steps."""
        return self.find_s + self.solve_s + iterations * self.step_s


#: Frames of Wi-Fi, 4 x 256 antenna elements and 64 subcarriers, on two cores of an
#: AMD EPYC, 2026-11-24; `rfgs train` of the README's quick start.
USUAL = Costs(find_s=1.3, solve_s=0.77, step_s=0.049)
#: Gaussians of a frame there.
USUAL_GAUSSIANS = 6000
#: With the objective of the paper alone, on two cores of an Intel Xeon, 2026-11-26: a sample
#: point; a step, and as much more for each Gaussian of the start, of which four come [s].
USUAL_POINT_S, USUAL_PAPER_STEP_S, USUAL_PAPER_GAUSSIAN_S = 3e-4, 0.01, 2e-6
#: Bars of what comes before frames are fitted.
FIND, POSE = "finding people", "posing people"
#: Finding who is in a frame there, times the square of their number, and a look at a frame while
#: one of them is posed, 2026-11-30 [s].
USUAL_FIND_S, USUAL_LOOK_S = 1.2, 0.13
#: Counting people in a frame there, times the square of their number [s].
USUAL_COUNT_S = 6.0
#: PLY, features and checkpoint of a Gaussian of a frame [B].
BYTES_PER_GAUSSIAN = 420.0


def stages(config: RunConfig, sequence: Sequence, frames: int, iterations: int) -> list[Stage]:
    """The stages of so many frames of a training."""
    settings, radio = config.settings, config.radio
    shape = sequence.layout(radio).measured.shape
    what = {**asdict(settings), "radio": radio, "shape": shape}
    for free in ("seed", "iterations"):
        what.pop(free)
    share = settings.num_gaussians / USUAL_GAUSSIANS
    steps = {"find": frames, "solve": frames, "step": frames * iterations}
    usual = {"find": USUAL.find_s, "solve": USUAL.solve_s, "step": share * USUAL.step_s}
    if settings.objective == "paper":
        # The grid of sample points, which refining makes no larger by an order.
        usual["find"] += USUAL_POINT_S * settings.grid_side**3
        usual["step"] = USUAL_PAPER_STEP_S + USUAL_PAPER_GAUSSIAN_S * settings.num_gaussians
    return [
        Stage(name, f"train-{name}", what, count, Speed(0.0, usual[name]))
        for name, count in steps.items()
    ]


def expected(run: Run) -> Costs:
    """What a frame is taken to cost: as trainings like this did here, else as usual."""
    each = forecast(stages(run.config, run.sequence, 1, 1)).seconds
    return Costs(each["find"], each["solve"], each["step"])


def pose_stages(run: Run, frames: int, looks: int, people: int) -> list[Stage]:
    """Finding people and posing them before frames are fitted.

    Args:
        run: The run.
        frames: How many frames are read.
        looks: How often frames are looked at to pose people.
        people: How many people there are.
    """
    what = [run.config.radio, run.sequence.layout(run.config.radio).measured.shape, people]
    find_s = USUAL_FIND_S * max(people, 1) ** 2
    both = (
        Stage(FIND, "train-find-people", what, frames, Speed(0.0, find_s)),
        Stage(POSE, "train-pose", what, looks, Speed(0.0, USUAL_LOOK_S)),
    )
    return [stage for stage in both if stage.steps]


def count_stage(sequence: Sequence, radio: str, votes: int, instances: int) -> Stage:
    """Counting people before anything is fitted, in so many frames.

    Args:
        sequence: The data.
        radio: Which radio.
        votes: In how many frames.
        instances: People that the dataset has, which says nothing but how long it may take: each is
            settled beside all others.
    """
    what = [radio, sequence.layout(radio).measured.shape, instances]
    usual_s = USUAL_COUNT_S * max(instances, 1) ** 2
    return Stage("count", "train-count", what, votes, Speed(0.0, usual_s))


def count_price(stage: Stage) -> str:
    """One line before people are counted: in how many frames, how long, and what does without."""
    found = forecast([stage])
    return (
        f"counting people in up to {stage.steps} frames first: about {in_words(found.total_s)}, "
        f"{found.source}; --people told, or their number, does without"
    )


@contextmanager
def speed_noted(stage: Stage) -> Iterator[Clock]:
    """A clock whose speed is kept for later estimates, once enough steps have ended."""
    clock = Clock()
    yield clock
    speed = clock.speed()
    if speed is not None:
        note_speed(stage, speed)


def price_line(run: Run, posing: Iterable[Stage] = ()) -> str:
    """One line before a training begins: how much, how long, and what would be less.

    Args:
        run: The run; its settings say how many steps and Gaussians.
        posing: What comes before frames are fitted; see `pose_stages`.
    """
    settings = run.config.settings
    frames = sum(not run.ply_path(frame).is_file() for frame in run.frames)
    size = size_in_words(frames * settings.num_gaussians * BYTES_PER_GAUSSIAN)
    before = posing if frames else []
    found = forecast([*before, *stages(run.config, run.sequence, frames, settings.iterations)])
    return (
        f"{count_in_words(frames, 'frame')} to fit, {settings.iterations} steps each, "
        f"about {size}; about {in_words(found.total_s)}, {found.source}; fewer --frames or "
        "--iterations are less"
    )


_FORMAT = "{desc}: {percentage:3.0f}%|{bar}| {elapsed}<{remaining}{postfix}"


class CostBar:
    """A progress bar that counts what stages cost, not how many they are."""

    def __init__(self, run: Run, iterations: int) -> None:
        """Begins with what is remembered, or what is usual."""
        self._run, self._iterations = run, iterations
        self._costs = expected(run)
        self._left = len(run.frames)
        self._begin = self._found = self._solved = 0.0
        self._steps = 0
        # It counts expected seconds, which nobody wants to read; who sets a format has their own.
        form = os.environ.get("TQDM_BAR_FORMAT", _FORMAT)
        self._bar = tqdm(total=self._total(), desc=f"train {run.config.radio}", bar_format=form)

    def _total(self) -> float:
        return round(self._left * self._costs.frame_s(self._iterations), 2)

    def _advance(self, cost_s: float) -> None:
        # Rounding may carry the sum past the total, which tqdm complains of.
        self._bar.update(min(cost_s, max(self._bar.total - self._bar.n, 0.0)))

    def skip(self) -> None:
        """A frame was fitted before."""
        self._left -= 1
        self._bar.total = self._bar.n + self._total()
        self._bar.refresh()

    def begin(self, said: str) -> None:
        """A frame is begun: bodies are found."""
        self._begin, self._steps = time.perf_counter(), 0
        self._bar.set_postfix_str(said)

    def found(self, said: str) -> None:
        """Bodies are found: reflectivities are solved."""
        self._found = time.perf_counter()
        self._advance(self._costs.find_s)
        self._bar.set_postfix_str(said)

    def solved(self) -> None:
        """Reflectivities are solved: the refinement begins."""
        self._solved = time.perf_counter()
        self._advance(self._costs.solve_s)

    def step(self, said: str) -> None:
        """A step of the refinement is done."""
        self._steps += 1
        self._bar.set_postfix_str(said, refresh=False)
        self._advance(self._costs.step_s)

    def finish_frame(self) -> None:
        """A frame is fitted: what it took is what the others are taken to cost."""
        now = time.perf_counter()
        self._left -= 1
        # A frame that was continued has skipped what would tell.
        if self._steps == self._iterations and self._begin < self._found < self._solved:
            self._costs = Costs(
                self._found - self._begin,
                self._solved - self._found,
                (now - self._solved) / max(self._steps, 1),
            )
            one = stages(self._run.config, self._run.sequence, 1, 1)
            for stage, cost_s in zip(one, asdict(self._costs).values(), strict=True):
                note_speed(stage, Speed(0.0, cost_s))
        self._bar.total = self._bar.n + self._total()
        self._bar.refresh()

    def close(self) -> None:
        """Ends the bar."""
        self._bar.close()


@contextmanager
def cost_bar(run: Run, iterations: int) -> Iterator[CostBar]:
    """A bar for as long as the block runs."""
    bar = CostBar(run, iterations)
    try:
        yield bar
    finally:
        bar.close()
