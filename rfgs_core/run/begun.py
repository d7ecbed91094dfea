# SPDX-License-Identifier: Apache-2.0
"""What a folder holds of a run that is asked for: nothing, some of it, all, or something else."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from rfgs_core.dataset import Dataset, Sequence
from rfgs_core.dataset.observed import Observed
from rfgs_core.errors import RfgsError
from rfgs_core.links import refuse_link
from rfgs_core.run.checkpoint import is_finished, lost_limbs
from rfgs_core.run.config import CONFIG_FILE, RunConfig, relative_dataset
from rfgs_core.run.excess import ExcessPath, excess_of_run
from rfgs_core.run.folder import Run, open_run
from rfgs_core.run.people import HeadCount, People, counted
from rfgs_core.settings import TrainConfig

#: Static Gaussians and those of the first frame, for any splat viewer; written last.
POINT_CLOUD_FILE = "point_cloud.ply"


def finished_run(
    out: Path,
    dataset: Dataset,
    sequence: Sequence,
    radio: str,
    frames: list[int],
    config: TrainConfig,
    *,
    people: People,
    excess: ExcessPath,
) -> Run | None:
    """The run of a folder where it is fitted to the end; None where it has to be trained yet.

    The arguments are those of `train_sequence`.

    Raises:
        RfgsError: The folder holds a run with other settings, or something else.
    """
    refuse_other_files(out)
    if not (out / CONFIG_FILE).exists():
        return None
    asked, _ = asked_of(out, dataset, sequence, radio, frames, config, people, excess)
    run = open_or_create(out, asked)
    whole = (out / POINT_CLOUD_FILE).exists() and not lost_limbs(run)
    return run if whole and all(is_finished(run, frame) for frame in run.frames) else None


def asked_of(
    out: Path,
    dataset: Dataset,
    sequence: Sequence,
    radio: str,
    frames: list[int],
    config: TrainConfig,
    people: People,
    excess: ExcessPath,
) -> tuple[RunConfig, HeadCount | None]:
    """What a run is asked for, once it is known who is heard; a run keeps what it began with.

    Raises:
        RfgsError: Who is heard cannot be known in the way that is asked for.
    """
    config = replace(config, excess_m=excess_of_run(out, sequence, radio, frames, config, excess))
    heads = counted(out, sequence, radio, frames, config, people)
    asked = RunConfig(
        dataset=relative_dataset(out, dataset.path),
        dataset_fingerprint=_fingerprint(out, dataset, config.channel),
        sequence=sequence.name,
        radio=radio,
        frames=frames,
        settings=config if heads is None else replace(config, bodies=max(heads.count, 1)),
    )
    return asked, heads


def _fingerprint(out: Path, dataset: Dataset, channel: Observed) -> str:
    """By which digest a run knows its dataset; one that is there keeps its own."""
    known = dataset.fingerprints(channel)
    if (out / CONFIG_FILE).exists():
        stored = RunConfig.read(out).dataset_fingerprint
        if stored in known:
            return stored
    return known[0]


def refuse_other_files(out: Path) -> None:
    """Refuses a place that holds something else than a run.

    Raises:
        RfgsError: It does.
    """
    if out.exists() and not out.is_dir():
        raise RfgsError(f"{out} is a file; expected a folder, choose another --out")
    refuse_link(out / CONFIG_FILE)
    if (out / CONFIG_FILE).exists() or not out.exists():
        return
    # Whoever starts a training from elsewhere keeps its log there; a killed one leaves the rest.
    kept = [path.name for path in out.iterdir() if not path.name.startswith(".tmp-")]
    if kept not in ([], ["log"]):
        raise RfgsError(f"{out} is not empty and not a run; choose another --out")


def open_or_create(out: Path, config: RunConfig) -> Run:
    """The run of a folder, begun where there is none.

    Raises:
        RfgsError: The folder holds a run with other settings.
    """
    if not (out / CONFIG_FILE).exists():
        config.write(out)
        return Run(out, config)
    run = open_run(out)
    if config.dataset_fingerprint == run.config.dataset_fingerprint:
        run = run.with_dataset(out / config.dataset)
    differing = config.differing(run.config)
    if differing:
        raise RfgsError(
            f"{out} holds a run with another {', '.join(differing)}; choose another --out or "
            "delete that folder"
        )
    return run
