# SPDX-License-Identifier: Apache-2.0
"""What a study takes, before it begins: datasets, trainings and evaluations that are missing."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from rfgs_core.frames import parse_frames
from rfgs_core.past import Speed, Stage, forecast, in_words, note_speed, size_in_words
from rfgs_core.radio import preset
from rfgs_core.run.costs import BYTES_PER_GAUSSIAN
from rfgs_core.settings import TrainConfig
from rfgs_core.study.cases import SCENES, Case

#: Four frames of `living_room_walk` with impairments and one packet, by radio and depth [s]: two
#: cores of an AMD EPYC, 2026-11-24, from processor time, as others were at work on the machine.
GENERATE_S = {
    ("wifi", 1): 10.0,
    ("wifi", 3): 61.0,
    ("mmwave", 1): 12.0,
    ("mmwave", 3): 66.0,
    ("uwb", 1): 60.0,
}
#: What each further packet takes, as a share of a dataset of one; from `mmwave` with 64.
PACKET = 0.04
#: Training, and evaluation with the fit from the true surface, by radio [s]; there.
TRAIN_S = {"wifi": 65.0, "mmwave": 27.0, "uwb": 98.0}
EVALUATE_S = {"wifi": 46.0, "mmwave": 41.0, "uwb": 170.0}

#: Work of a case in its order → the file that says that it is done.
_DONE = {"generate": "dataset.json", "train": "point_cloud.ply", "evaluate": "metrics.json"}


def work_left(chosen: Sequence[Case], out: Path) -> dict[Path, list[tuple[str, Case]]]:
    """What is missing of cases, by folder: seeds share a dataset.

    Args:
        chosen: The cases.
        out: Folder of the study.

    Returns:
        Folder within the study → work and case.
    """
    left: dict[Path, list[tuple[str, Case]]] = {}
    for case in chosen:
        if (out / case.run / _DONE["evaluate"]).exists():
            continue
        for work in _DONE:
            folder = case.dataset if work == "generate" else case.run
            if not (out / folder / _DONE[work]).exists() and (
                work != "generate" or folder not in left
            ):
                left.setdefault(folder, []).append((work, case))
    return left


def price_line(chosen: Sequence[Case], out: Path) -> str:
    """One line before a study begins: how much is left of what, how long, and what is less."""
    left = [row for rows in work_left(chosen, out).values() for row in rows]
    counts = {work: sum(name == work for name, _ in left) for work in _DONE}
    found = forecast(_stage(work, case) for work, case in left)
    size = sum(_bytes(work, case) for work, case in left)
    return (
        f"{len(chosen)} cases; {counts['generate']} datasets, {counts['train']} trainings and "
        f"{counts['evaluate']} evaluations to make; at most {size_in_words(size)}; about "
        f"{in_words(found.total_s)}" + (f", {found.source}" if left else "") + "; fewer --seeds, "
        "--radios, --conditions or --scenes make it less"
    )


@contextmanager
def timed_work(work: str, case: Case, out: Path) -> Iterator[None]:
    """Keeps how long a case's work took, unless it continued what was begun before.

    Args:
        work: generate, train or evaluate.
        case: The case.
        out: Folder of the study.
    """
    fresh = work == "evaluate" or not (out / _folder(work, case)).exists()
    begin = time.perf_counter()
    yield
    if fresh:
        note_speed(_stage(work, case), Speed(0.0, time.perf_counter() - begin))


def _folder(work: str, case: Case) -> Path:
    return case.dataset if work == "generate" else case.run


def _stage(work: str, case: Case) -> Stage:
    """One piece of work as a stage of a single step."""
    what = [case.scene, case.radio, case.depth, case.packets]
    if work != "generate":
        what.append(case.condition)
    if work == "generate":
        usual_s = GENERATE_S[case.radio, case.depth] * (1.0 + PACKET * (case.packets - 1))
    else:
        usual_s = (TRAIN_S if work == "train" else EVALUATE_S)[case.radio]
    return Stage(work, f"study-{work}-{case.radio}", what, 1, Speed(0.0, usual_s))


def _bytes(work: str, case: Case) -> float:
    """Disk of one piece of work, from above [B]."""
    frames = len(parse_frames(SCENES[case.scene].frames))
    if work == "train":
        return frames * TrainConfig().num_gaussians * BYTES_PER_GAUSSIAN
    if work == "evaluate":
        return 0.0
    radio = preset(case.radio)
    links = radio.tx_rows * radio.tx_cols * radio.rx_rows * radio.rx_cols * radio.num_devices
    links *= 1 if radio.own_device_links == "only" else radio.num_devices
    # Clean and impaired, complex64; the static channel has one packet.
    return 8.0 * links * radio.num_subcarriers * (2 * frames * case.packets + 1)
