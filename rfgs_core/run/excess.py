# SPDX-License-Identifier: Apache-2.0
"""Whether people of a run are heard through a wall: told by option, kept, or found."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Literal

from tqdm import tqdm

from rfgs_core.bodies.excess_path import FIRST_LOOK, excess_path_m
from rfgs_core.dataset import Sequence
from rfgs_core.errors import RfgsError
from rfgs_core.frames import spread_frames
from rfgs_core.run.config import CONFIG_FILE
from rfgs_core.run.folder import open_run
from rfgs_core.run.people import AUTO_PAIRS, reader, why_not_sensed
from rfgs_core.seeds import sub_seed
from rfgs_core.settings import TrainConfig
from rfgs_core.threads import one_torch_thread

#: auto: looked for where people can be sensed; a number: so much [m].
ExcessPath = Literal["auto"] | float
#: The most that may be told [m].
MOST_M = 20.0
#: Frames that are asked where the first one asked says that there is a wall.
FRAMES = 3


def excess_of_run(
    out: Path,
    sequence: Sequence,
    radio: str,
    frames: list[int],
    config: TrainConfig,
    asked: ExcessPath,
) -> float:
    """Excess path of a run in a folder [m]; it is not looked for again where the run knows.

    Args:
        out: Folder of the run, which may be new.
        sequence: The data.
        radio: Which radio.
        frames: Frames of the run.
        config: What of the channel is read.
        asked: How to know.

    Raises:
        RfgsError: An excess path is out of range, or the settings have no use for it.
    """
    if asked != "auto":
        if not 0.0 <= asked <= MOST_M:
            raise RfgsError(f"--excess-path {asked:g}: expected auto, or 0 to {MOST_M:g} m")
        if asked and config.observe != "complex":
            raise RfgsError(
                f"--excess-path {asked:g}: expected the phases that --observe complex reports, "
                f"found --observe {config.observe}; leave one of them out"
            )
        return asked
    if (out / CONFIG_FILE).exists():
        return open_run(out).config.settings.excess_m
    if config.start == "random" or why_not_sensed(sequence, radio, config, AUTO_PAIRS):
        return 0.0
    return _found(sequence, radio, frames, config)


def _found(sequence: Sequence, radio: str, frames: list[int], config: TrainConfig) -> float:
    """Looks for an excess path in up to `FRAMES` frames, first in the one in the middle."""
    some = spread_frames(frames, FRAMES)
    some.insert(0, some.pop(len(some) // 2))
    seen = list(map(reader(sequence, radio, config), some))
    seed = sub_seed(config.seed, sequence.name, radio, "excess path")
    with (
        tqdm(total=FIRST_LOOK, desc="looking for a wall", unit="look", delay=2.0) as bar,
        one_torch_thread(),
    ):

        def look(left: int) -> None:
            bar.total = bar.n + 1 + left
            bar.update()

        found_m = excess_path_m(seen, config, seed, look)
    if found_m:
        sys.stderr.write(
            f"paths over people are {found_m:g} m longer than straight lines, as through a wall; "
            "taken off before the fit (--excess-path 0 leaves it)\n"
        )
    return found_m
