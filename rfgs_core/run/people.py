# SPDX-License-Identifier: Apache-2.0
"""How many people a run is about: sensed from the radio, told by the dataset, or asked for."""

from __future__ import annotations

import logging
import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

from msgspec import Meta
from tqdm import tqdm

from rfgs_core.background.learned import learned_background
from rfgs_core.bodies.count import count_bodies
from rfgs_core.bodies.gain import FEWEST_PAIRS
from rfgs_core.dataset import Sequence
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.frames import spread_frames
from rfgs_core.measure.observations import Observations, observe
from rfgs_core.records import record
from rfgs_core.run.config import CONFIG_FILE
from rfgs_core.run.costs import count_price, count_stage, speed_noted
from rfgs_core.run.folder import Run
from rfgs_core.seals import read_sealed_json, write_sealed_json
from rfgs_core.seeds import sub_seed
from rfgs_core.settings import TrainConfig
from rfgs_core.threads import one_torch_thread

#: auto: sensed where that can be, else told; sensed: from the radio alone; told: by the dataset's
#: instances; a number: so many.
People = Literal["auto", "sensed", "told"] | int
#: Where a run keeps how many there are, and how that is known.
PEOPLE_FILE = "people.json"
#: Frames of a sequence that have a vote.
VOTES = 5
#: Visible device pairs without which people are not sensed unasked: three radars count too many.
AUTO_PAIRS = 4
#: Nobody counts more (`settings`).
_Count = Annotated[int, Meta(ge=0, le=10**4)]
_LOG = logging.getLogger(__name__)
_REMEDY = "delete the run and train again"


@dataclass(frozen=True)
class HeadCount:
    """How many people there are in a sequence."""

    count: _Count
    """People."""
    source: Literal["sensed", "told", "asked"]
    """From the radio alone, from the dataset's instances, or by the option."""
    votes: dict[str, _Count] = field(default_factory=dict)
    """What single frames said, by their numbers; empty unless sensed."""

    def __str__(self) -> str:
        """One line for people to read."""
        if self.source != "sensed":
            return f"{self.count}, {self.source}"
        same = sum(vote == self.count for vote in self.votes.values())
        return f"{self.count}, sensed ({same} of {len(self.votes)} frames)"

    def write(self, run: Path) -> None:
        """Keeps it in a run."""
        write_sealed_json(run / PEOPLE_FILE, asdict(self))

    @staticmethod
    def read(run: Path) -> HeadCount | None:
        """What a run keeps; None of a run that was told without a word.

        Raises:
            RfgsFormatError: The file is damaged.
        """
        path = run / PEOPLE_FILE
        if not path.exists():
            return None
        kept: HeadCount = record(path, read_sealed_json(path, _REMEDY), HeadCount, _REMEDY)
        if kept.votes and kept.count != voted(list(kept.votes.values())):
            raise RfgsFormatError(f"{path}: {kept.count} is not what most votes say; {_REMEDY}")
        return kept


def told(sequence: Sequence) -> int:
    """People among the dataset's instances."""
    return sum(1 for row in sequence.instances if row["class"] == "person")


def known_people(run: Run) -> int:
    """How many people a run takes to be there."""
    kept = HeadCount.read(run.path)
    return told(run.sequence) if kept is None else kept.count


def why_not_sensed(sequence: Sequence, radio: str, config: TrainConfig, fewest: int) -> str | None:
    """Why people cannot be counted by a radio; None where they can be."""
    if config.observe != "complex":
        return f"--observe {config.observe} has no phases"
    if config.calibrate != "none":
        return f"--calibrate {config.calibrate} finds offsets only where people are known"
    if sequence.radio_spec(radio).antennas_move:
        return f"the antennas of {radio} move within a frame"
    if any(row["class"] == "vehicle" for row in sequence.instances):
        return "a vehicle is no person, and changes the channel more"
    pairs = len(observe(sequence, radio, sequence.frames[0], config.channel).pairs[1])
    if pairs < fewest:
        return f"{radio} has {pairs} visible device pairs, fewer than {fewest}"
    return None


def need_no_people(config: TrainConfig, people: People) -> None:
    """Refuses to count people for a start that knows of none.

    Raises:
        RfgsError: They shall be sensed, or so many be there.
    """
    if config.start == "random" and people not in ("auto", "told"):
        raise RfgsError(
            f"--people {people}: --start random knows of no people; leave it out, or choose "
            "--start prior"
        )


def counted(
    out: Path,
    sequence: Sequence,
    radio: str,
    frames: list[int],
    config: TrainConfig,
    people: People,
) -> HeadCount | None:
    """How many people a run in a folder is about; sensing is not repeated where it knows.

    None of a run from a random start, which knows of nobody.

    Args:
        out: Folder of the run, which may be new.
        sequence: The data.
        radio: Which radio.
        frames: Frames of the run.
        config: What of the channel is read.
        people: How to know.

    Raises:
        RfgsError: They shall be sensed where that cannot be, or nobody is sensed.
    """
    if config.start == "random":
        return None
    kept = HeadCount.read(out)
    if kept is None and (out / CONFIG_FILE).exists():
        # Runs without a word of it were told.
        kept = HeadCount(told(sequence), "told")
    if kept is not None and people in ("auto", kept.source):
        return kept
    stage = count_stage(sequence, radio, votes_of(frames), told(sequence))
    with (
        tqdm(total=stage.steps, desc="counting people", delay=1.0) as bar,
        speed_noted(stage) as clock,
        one_torch_thread(),
    ):

        def step(done: int) -> None:
            if done == 0:
                sys.stderr.write(f"{count_price(stage)}\n")
            else:
                clock.step()
                bar.update()

        heads = head_count(sequence, radio, frames, config, people, step)
        bar.total = bar.n
    if heads.source == "sensed" and heads.count == 0:
        if people == "auto":
            _LOG.warning("%s senses nobody; taken to be there: %d, told", radio, told(sequence))
            return HeadCount(told(sequence), "told")
        raise RfgsError(
            f"{radio} senses nobody in most of these frames; choose other --frames, or say "
            "--people and how many there are"
        )
    return heads


def head_count(
    sequence: Sequence,
    radio: str,
    frames: list[int],
    config: TrainConfig,
    asked: People = "auto",
    on_frame: Callable[[int], Any] = lambda _done: None,
) -> HeadCount:
    """How many people there are: what most of some frames say, spread over all.

    Frames that can no longer change that are not asked.

    Args:
        sequence: The data.
        radio: Which radio.
        frames: Which frames.
        config: What of the channel is read.
        asked: How to know.
        on_frame: Called with the number of frames that are counted: 0 before the first, and not
            at all where nobody is sensed.

    Raises:
        RfgsError: They shall be sensed where that cannot be, or be fewer than one.
    """
    if isinstance(asked, int):
        if asked < 1:
            raise RfgsError(f"--people {asked}: expected at least 1")
        return HeadCount(asked, "asked")
    fewest = FEWEST_PAIRS if asked == "sensed" else AUTO_PAIRS
    why_not = None if asked == "told" else why_not_sensed(sequence, radio, config, fewest)
    if asked == "sensed" and why_not:
        raise RfgsError(f"--people sensed: {why_not}; expected --people told, or their number")
    if asked == "told" or why_not:
        return HeadCount(told(sequence), "told")
    seen, votes = reader(sequence, radio, config), {}
    on_frame(0)
    for frame in _middle_and_ends_first(spread_frames(frames, votes_of(frames))):
        seed = sub_seed(config.seed, sequence.name, radio, frame, "people")
        votes[str(frame)] = len(count_bodies(seen(frame), config, seed))
        on_frame(len(votes))
        if decided(list(votes.values()), votes_of(frames)):
            break
    return HeadCount(voted(list(votes.values())), "sensed", votes)


def reader(sequence: Sequence, radio: str, config: TrainConfig) -> Callable[[int], Observations]:
    """Reads frames as a training would, before there is a run: a background is learned once."""
    empty = None
    if config.background == "learned":
        empty = learned_background(sequence, radio, config.channel, config.observe, config.packets)

    def read(frame: int) -> Observations:
        seen = observe(
            sequence, radio, frame, config.channel, config.observe, empty, config.packets
        )
        return seen.lengthened(-config.excess_m)

    return read


def votes_of(frames: list[int]) -> int:
    """How many of some frames have a vote."""
    return min(VOTES, len(frames))


def _middle_and_ends_first(frames: list[int]) -> list[int]:
    """Frames in an order of which the first few are spread over all."""
    half = len(frames) // 2
    first = [frames[half], frames[0], frames[-1]]
    return list(dict.fromkeys([*first, *frames]))


def decided(votes: list[int], everybody: int) -> bool:
    """Whether the votes that are still to come, of so many, can change nothing."""
    tally = Counter(votes)
    most = tally.pop(voted(votes))
    return most > max(tally.values(), default=0) + everybody - len(votes)


def voted(votes: list[int]) -> int:
    """What most frames say, of equals the larger: people hide each other more often than not."""
    tally = Counter(votes)
    return max(tally, key=lambda count: (tally[count], count))
