# SPDX-License-Identifier: Apache-2.0
"""Random worlds as datasets: one small folder each, whole or not there."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from pathlib import Path

from dataset_factory.make.world_files import name_of, write_world
from dataset_factory.plan.contents import make_plan, versions
from dataset_factory.scene.builder import build_scene
from dataset_factory.scene.catalogue import find_scene
from rfgs_core.errors import RfgsError
from rfgs_core.files import read_json, replacing_folder, write_json
from rfgs_core.links import refuse_link
from rfgs_core.locks import alone_in
from rfgs_core.schedule.archive import unpack
from rfgs_core.schedule.spread import Spread
from rfgs_core.worlds.settings_file import SETTINGS_FILE, WorldsFile
from rfgs_core.worlds.world import random_world, refuse_radio, sounded

#: Folder of the worlds' scenes, where they are rendered or traced by Sionna RT.
SCENES = "scenes"
#: Worlds of one folder at most.
MOST = 10_000_000
_SHARD = re.compile(r"(\d{1,6})/(\d{1,6})", re.ASCII)


def parse_shard(text: str) -> tuple[int, int]:
    """Number of a shard, from 1, and how many there are.

    Raises:
        RfgsError: It is not of the form K/N with K from 1 to N.

    Example:
        >>> parse_shard("2/8")
        (2, 8)
    """
    match = _SHARD.fullmatch(text)
    number, count = (int(match[1]), int(match[2])) if match else (0, 0)
    if not 1 <= number <= count:
        raise RfgsError(f"--shard {text!r}: expected K/N with K from 1 to N, as in 2/8")
    return number, count


def claim(out: Path, shared: WorldsFile) -> None:
    """Makes the folder, or checks that its worlds are of the same settings.

    Raises:
        RfgsError: The folder holds something else, or worlds made with other settings.
    """
    asked = {**shared.as_json(), "rfgs": versions()["rfgs"]}
    file = out / SETTINGS_FILE
    refuse_link(file)
    if file.is_file():
        if read_json(file) != asked:
            raise RfgsError(f"{file}: made with other settings; choose another --out")
        return
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise RfgsError(f"{out}: not empty and no worlds; choose another --out")
    write_json(file, asked)


def missing(out: Path, indices: range) -> list[int]:
    """Worlds that are not there yet."""
    return [index for index in indices if not (out / name_of(index) / "dataset.json").is_file()]


def _tidy(out: Path, indices: range) -> None:
    """Removes what a killed run of these worlds left; others may be at work on others."""
    shutil.rmtree(out / f".work-{indices.start}-{indices.step}", ignore_errors=True)
    for old in out.glob(".tmp-*-world_*"):
        if int(old.name.rpartition("_")[2]) in indices:
            shutil.rmtree(old, ignore_errors=True)


def make_worlds(
    out: Path, shared: WorldsFile, named: str, indices: range, spread: Spread | None = None
) -> Iterator[int]:
    """Makes the worlds that are missing, each a dataset of its own below a folder.

    Args:
        out: The folder.
        shared: What the worlds have in common.
        named: How `--radio` names their radio.
        indices: Which worlds.
        spread: Who makes them; None is this process.

    Yields:
        The number of every world that was made, when it is whole.

    Raises:
        RfgsError: The folder holds something else, somebody else makes the same worlds, a radio
            cannot be traced in such rooms, or there are no workers.
    """
    shared.settings.check()
    refuse_radio(shared.radio)
    spread = spread or Spread()
    if spread.scheduler:
        # A cluster that is not there is known before the folder is claimed.
        from rfgs_core.schedule.workers import count_workers

        count_workers(spread.scheduler)
    claim(out, shared)
    lock = out / f".lock-{indices.start}-{indices.step}"
    refuse_link(lock)
    lock.touch()
    with alone_in(lock, out, "rfgs-factory worlds"):
        _tidy(out, indices)
        left = missing(out, indices)
        if shared.in_blender:
            yield from _in_blender(out, shared, named, left, spread)
        elif left and (spread.scheduler or spread.workers > 1):
            yield from _by_workers(out, shared, left, spread, f"{indices.start}-{indices.step}")
        else:
            yield from _here(out, shared, left)


def _here(out: Path, shared: WorldsFile, left: list[int]) -> Iterator[int]:
    """Makes worlds in this process."""
    for index in left:
        world = random_world(shared.radio, shared.settings, shared.seed, index)
        with replacing_folder(out / name_of(index)) as folder:
            heard = sounded(world, shared.settings, shared.seed)
            write_world(folder, heard, shared.settings, shared.seed)
        yield index


def _by_workers(
    out: Path, shared: WorldsFile, left: list[int], spread: Spread, share: str
) -> Iterator[int]:
    """Has worlds made by Dask's workers; `share` tells this process from others at the folder."""
    from dataset_factory.make.world_workers import archives_of

    scratch, log = out / f".work-{share}", out / "log" / share
    refuse_link(scratch)
    try:
        with spread.ready(len(left), scratch, log) as workers:
            for index, archive in archives_of(workers, shared, left, log):
                with replacing_folder(out / name_of(index)) as folder:
                    unpack(archive, folder)
                yield index
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def _in_blender(
    out: Path, shared: WorldsFile, named: str, left: list[int], spread: Spread
) -> Iterator[int]:
    """Makes worlds as scenes of Blender one after another; workers share the frames of each."""
    for index in left:
        # Without space for its people a world is refused before a scene is made of it.
        random_world(shared.radio, shared.settings, shared.seed, index)
        with replacing_folder(out / name_of(index)) as folder:
            _generate(folder, _scene(out, index), shared, named, spread)
        yield index


def _scene(out: Path, index: int) -> Path:
    """Builds a world as a scene of Blender."""
    scenes = out / SCENES
    refuse_link(scenes)
    scenes.mkdir(exist_ok=True)
    blend = scenes / f"{name_of(index)}.blend"
    refuse_link(blend)
    source = str(out / SETTINGS_FILE)
    build_scene("a world", "world", source, "--index", str(index), "--out", str(blend))
    return blend


def _generate(folder: Path, blend: Path, shared: WorldsFile, named: str, spread: Spread) -> None:
    """Makes the dataset of a world's scene."""
    # Worlds without Blender do without what traces and renders scenes, Dask among it.
    from dataset_factory.make.generate import generate
    from dataset_factory.plan.job import Job
    from dataset_factory.scene.blender import Blender

    settings, pictures = shared.settings, shared.pictures
    plan = make_plan(
        find_scene(str(blend)),
        (named,),
        f"1:{settings.frames}",
        cameras=pictures.cameras if pictures else 0,
        resolution=pictures.resolution_px if pictures else 16,
        samples=pictures.samples if pictures else 1,
        depth=min(settings.depth, shared.radio.deepest),
        seed=shared.seed,
        shadow="kirchhoff",
        tracer=shared.tracer,
        images=pictures is not None,
        impairments=None,
        packets_per_frame=1,
        paths=False,
        overrides={},
    )
    job = Job(
        folder,
        plan,
        Blender(blend, None),
        workers=spread.workers,
        worker_memory_gb=spread.memory_gb,
        scheduler=spread.scheduler,
    )
    generate(job)
