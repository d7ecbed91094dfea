# SPDX-License-Identifier: Apache-2.0
"""Makes a dataset stage by stage; a stopped run continues with what is missing."""

from __future__ import annotations

import fcntl
import logging
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from tqdm import tqdm

from dataset_factory.blender import Blender, Progress
from dataset_factory.bundle import Bundle, read_bundle, sanitised
from dataset_factory.devices import check_scene, choose_devices
from dataset_factory.encode import encode_empty, encode_frame, rendered_whole
from dataset_factory.plan import (
    Plan,
    frame_runs,
    missing_channels,
    missing_pictures,
    refuse_other_plan,
    versions,
)
from dataset_factory.sequence import describe_sequence, write_geometry
from dataset_factory.workers import Task, run_tasks
from rfgs_core.dataset.csi_store import create_csi
from rfgs_core.dataset.names import SequenceFiles
from rfgs_core.dataset.schema import (
    DatasetInfo,
    SequenceInfo,
    device_pose,
    read_dataset_info,
)
from rfgs_core.dataset.writer import (
    finish_dataset,
    write_dataset_info,
    write_sequence_info,
    write_transforms,
)
from rfgs_core.errors import RfgsError
from rfgs_core.files import read_json, write_json
from rfgs_core.frames import parse_frames
from rfgs_core.radio import DevicePose, frame_samples, layout, preset

logger = logging.getLogger(__name__)


@dataclass
class Job:
    """One run of the factory on one folder."""

    out: Path
    """Folder of the dataset."""
    plan: Plan
    """What it shall hold."""
    blender: Blender
    """Opens the scene."""
    workers: int
    """Tracing processes."""
    seconds: dict[str, float] = field(default_factory=dict)
    """Wall time per stage of this run [s]."""

    @property
    def work(self) -> Path:
        """Half-made work, removed at the end."""
        return self.out / ".work"

    @property
    def name(self) -> str:
        """Name of the sequence."""
        return sanitised(self.plan.scene)

    @property
    def files(self) -> SequenceFiles:
        """Where the sequence's files lie."""
        return SequenceFiles(self.out / self.name)

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Measures a stage; times go to the log, never into the data."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[name] = round(time.perf_counter() - start, 3)
            write_json(self.out / "log" / "generate.json", {"seconds": self.seconds})


def generate(job: Job) -> bool:
    """Makes the dataset, or what is missing of it.

    Returns:
        False if everything had been there already.

    Raises:
        RfgsError: The folder holds something else, or the scene cannot be used.
    """
    if not _open_folder(job):
        return False
    begun = (job.out / "dataset.json").exists()
    logger.info("%s: %s", job.out, "continuing" if begun else "a new dataset")
    with _locked(job):
        _sweep(job.out)
        info = DatasetInfo(versions(), asdict(job.plan), job.plan.seed, _contents(job), [job.name])
        with job.stage("export"):
            bundle = _export(job)
        devices, guesses = _choose(job, bundle)
        # Only a usable scene claims the folder: who mends theirs may use the same --out again.
        if not (job.out / "dataset.json").exists():
            write_dataset_info(job.out, info)
        sequence = _prepare(job, bundle, devices, guesses)
        with job.stage("trace"):
            _trace(job, bundle, sequence)
        if job.plan.images:
            with job.stage("render"):
                _render(job, sequence)
        with job.stage("finish"):
            write_geometry(job.files, bundle)
            if job.plan.images:
                write_transforms(job.files, sequence)
            made = {**info.versions, "blender": bundle.info["blender_version"]}
            finish_dataset(
                job.out,
                DatasetInfo(made, info.config, info.root_seed, info.has, info.sequences),
            )
    shutil.rmtree(job.work)
    return True


def _contents(job: Job) -> list[str]:
    pictures = ["images", "depth", "normal", "mask"] if job.plan.images else []
    return ["csi", "csi_static", *pictures, "geometry"]


def _open_folder(job: Job) -> bool:
    file = job.out / "dataset.json"
    if file.is_file():
        stored = read_dataset_info(file)
        made_with = {} if stored.manifest_sha256 else stored.versions
        refuse_other_plan(job.out, job.plan, stored.config, made_with)
        if stored.manifest_sha256:
            # Killed while tidying up: nothing is missing.
            shutil.rmtree(job.work, ignore_errors=True)
            return False
    elif job.out.is_dir() and any(
        entry.name not in (".work", "log") and not entry.name.startswith(".tmp-")
        for entry in job.out.iterdir()
    ):
        raise RfgsError(f"{job.out}: not empty and no dataset; choose another --out")
    elif job.out.exists() and not job.out.is_dir():
        raise RfgsError(f"{job.out}: a file of that name exists; choose another --out")
    return True


@contextmanager
def _locked(job: Job) -> Iterator[None]:
    job.work.mkdir(parents=True, exist_ok=True)
    with (job.work / "lock").open("w") as stream:
        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise RfgsError(f"{job.out}: another rfgs-factory is working on it") from error
        yield


def _sweep(out: Path) -> None:
    """Removes half-written files that a killed run left behind."""
    for entry in [*out.rglob(".tmp-*"), *out.rglob("*.partial")]:
        if entry.is_dir():
            shutil.rmtree(entry)
        else:
            entry.unlink(missing_ok=True)


def _export(job: Job) -> Bundle:
    target, plan_file = job.work / "bundle", job.work / "plan.json"
    plan = asdict(job.plan)
    if not plan_file.is_file() or read_json(plan_file) != plan:
        shutil.rmtree(target, ignore_errors=True)
        write_json(plan_file, plan)
    if not (target / "bundle.json").is_file():
        fresh = job.work / "bundle.new"
        shutil.rmtree(fresh, ignore_errors=True)
        logger.info("exporting the scene from Blender")
        arguments = ["--out", str(fresh), *_picture_size(job)]
        frames = ["--frames", job.plan.frames] if job.plan.frames else []
        with _bar("export", "frame") as progress:
            job.blender.run("export", *arguments, *frames, progress=progress)
        read_bundle(fresh)
        fresh.rename(target)
    return read_bundle(target)


def _picture_size(job: Job) -> list[str]:
    cameras = ["--cameras", str(job.plan.cameras)] if job.plan.cameras else []
    return [*cameras, "--resolution", str(job.plan.resolution)]


def _choose(job: Job, bundle: Bundle) -> tuple[dict[str, list[DevicePose]], list[dict[str, Any]]]:
    """Chooses each radio's devices and refuses what cannot be traced."""
    radios = [preset(name) for name in job.plan.radios]
    devices, guesses = {}, []
    for radio in radios:
        devices[radio.name], guess = choose_devices(bundle, radio)
        whose = guess["value"] if guess else "the scene's own"
        logger.info("%s: %d devices, %s", radio.name, len(devices[radio.name]), whose)
        guesses += [guess] if guess else []
    check_scene(bundle, devices, radios)
    if job.plan.images and not bundle.cameras:
        raise RfgsError(f"{job.blender.blend}: no camera; add one or use --no-images")
    return devices, guesses


def _prepare(
    job: Job,
    bundle: Bundle,
    devices: dict[str, list[DevicePose]],
    guesses: list[dict[str, Any]],
) -> SequenceInfo:
    """Writes `sequence.json` and an empty store for each radio."""
    sequence = describe_sequence(job.plan, bundle, devices, guesses)
    write_sequence_info(job.files, sequence)
    times = [(frame - sequence.frame_start) / sequence.fps for frame in sequence.frames]
    for name, poses in devices.items():
        radio = preset(name)
        samples = frame_samples(radio, sequence.fps)
        create_csi(
            job.files.csi(name), radio, layout(radio, poses), sequence.frames, times, samples
        )
    return sequence


def _trace(job: Job, bundle: Bundle, sequence: SequenceInfo) -> None:
    tasks = [
        Task(radio, frame)
        for radio in job.plan.radios
        for frame in missing_channels(job.files, radio, sequence.frames)
    ]
    if not tasks:
        return
    request = {
        "bundle": str(bundle.path),
        "sequence": str(job.files.root),
        "devices": {
            radio: [asdict(device_pose(row)) for row in rows]
            for radio, rows in sequence.devices.items()
        },
        "depth": job.plan.depth,
        "shadow": job.plan.shadow,
        "seed": job.plan.seed,
    }
    with tqdm(total=len(tasks), desc="trace", unit="frame") as bar:
        seconds = run_tasks(
            request, tasks, job.workers, job.out / "log", lambda task: _step(bar, task)
        )
    job.seconds.update({f"trace.{name}": value for name, value in seconds.items()})


def _step(bar: tqdm, task: Task) -> None:
    bar.set_postfix_str(f"{task.radio} {task.frame or 'static'}", refresh=False)
    bar.update()


def _render(job: Job, sequence: SequenceInfo) -> None:
    cameras = [row["name"] for row in sequence.cameras]
    rendered = job.work / "rendered"
    missing = missing_pictures(job.files, sequence.frames)
    size = ["--out", str(rendered), *_picture_size(job), "--samples", str(job.plan.samples)]
    for run in frame_runs(missing):
        shutil.rmtree(rendered, ignore_errors=True)
        frames = list(parse_frames(run))
        with _bar("render") as progress:

            def encode(done: int, total: int, frames: list[int] = frames) -> None:
                progress(done, total)
                # Frames are rendered one after the other with all cameras, so these are whole.
                _encode(job, rendered, cameras, frames[: done // len(cameras)])

            arguments = [*size, "--frames", run, "--passes"]
            job.blender.run("groundtruth", *arguments, progress=encode)
        _encode(job, rendered, cameras, frames)
    if any(not job.files.image_empty(camera).is_file() for camera in cameras):
        with _bar("empty room") as progress:
            frame = str(sequence.frames[0])
            arguments = [*size, "--frames", f"{frame}:{frame}", "--empty"]
            job.blender.run("groundtruth", *arguments, progress=progress)
        encode_empty(rendered, job.files, cameras)


def _encode(job: Job, rendered: Path, cameras: list[str], frames: list[int]) -> None:
    for frame in missing_pictures(job.files, frames):
        if rendered_whole(rendered, cameras, frame):
            encode_frame(rendered, job.files, cameras, frame)


@contextmanager
def _bar(name: str, unit: str = "picture") -> Iterator[Progress]:
    with tqdm(desc=name, unit=unit) as bar:

        def progress(done: int, total: int) -> None:
            bar.total = total
            bar.update(done - bar.n)

        yield progress
