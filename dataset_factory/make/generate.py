# SPDX-License-Identifier: Apache-2.0
"""Makes a dataset stage by stage; a stopped run continues with what is missing."""

from __future__ import annotations

import logging
import shutil
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from dataset_factory.make.encode import encode_empty, encode_frame, rendered_whole
from dataset_factory.make.impair import impair_radio
from dataset_factory.make.sequence import describe_sequence, write_geometry
from dataset_factory.plan.contents import frame_runs, missing_pictures, versions
from dataset_factory.plan.disk import keep_space, refuse_small_disk, space
from dataset_factory.plan.folder import claim_taken_back, locked, open_folder
from dataset_factory.plan.job import Job
from dataset_factory.plan.price import price_line
from dataset_factory.plan.progress import progress_bar
from dataset_factory.plan.scene_size import refuse_large_scene
from dataset_factory.plan.stages import size_of, speeds_noted
from dataset_factory.scene.bundle import Bundle, read_bundle
from dataset_factory.scene.devices import check_scene, choose_devices
from dataset_factory.scene.radios import SCENE_RADIO, scene_radio
from dataset_factory.scene.report import table
from dataset_factory.scene.report_rows import read_report
from dataset_factory.schedule.channels import trace
from rfgs_core.dataset import Sequence
from rfgs_core.dataset.csi_store import create_csi
from rfgs_core.dataset.impaired_store import has_impaired, remove_impaired
from rfgs_core.dataset.schema import DatasetInfo, SequenceInfo
from rfgs_core.dataset.writer import (
    finish_dataset,
    write_dataset_info,
    write_sequence_info,
    write_transforms,
)
from rfgs_core.errors import RfgsError
from rfgs_core.files import read_json, sweep, write_json
from rfgs_core.frames import parse_frames
from rfgs_core.past import Clock
from rfgs_core.radio import DevicePose, frame_samples, layout, pose_span_s
from rfgs_core.radio.impairments import impairments_from_json
from rfgs_core.schedule.workers import count_workers

logger = logging.getLogger(__name__)


def generate(job: Job) -> bool:
    """Makes the dataset, or what is missing of it.

    Returns:
        False if everything had been there already.

    Raises:
        RfgsError: The folder holds something else, or the scene cannot be used.
    """
    if not open_folder(job):
        # Killed while tidying up: nothing is missing.
        shutil.rmtree(job.work, ignore_errors=True)
        return False
    if job.scheduler:
        # A cluster that is not there is known before the scene is exported for it.
        job.workers = count_workers(job.scheduler)
    asked = job.plan
    begun = (job.out / "dataset.json").exists()
    logger.info("%s: %s", job.out, "continuing" if begun else "a new dataset")
    with locked(job):
        sweep(job.out, ".tmp-*", "*.partial")
        info = DatasetInfo(versions(), asdict(job.plan), job.plan.seed, _contents(job), [job.name])
        with job.stage("export"):
            bundle = _export(job)
        logger.info("%s", table(read_report(bundle.path / "check.json")))
        if SCENE_RADIO in job.plan.radios:
            job = replace(job, plan=job.plan.with_radio(scene_radio(bundle)))
        _tell_depth(job)
        devices, guesses = _choose(job, bundle)
        # Only a usable scene claims the folder: who mends theirs may use the same --out again.
        if not (job.out / "dataset.json").exists():
            write_dataset_info(job.out, info)
        sequence = _prepare(job, bundle, devices, guesses)
        needed = space(job, bundle, sequence)
        with claim_taken_back(job, begun):
            refuse_small_disk(job, needed.bytes(len(sequence.frames)))
        # Later estimates ask before they know the scene's radio.
        known, size = replace(job, plan=asked), size_of(job.plan, sequence)
        logger.info("%s", price_line(known, size, needed.bytes(size.frames)))
        with speeds_noted(known, size):
            _fill(job, bundle, sequence)
        keep_space(known, space(job, bundle, sequence))
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


def _fill(job: Job, bundle: Bundle, sequence: SequenceInfo) -> None:
    """Makes the channels and pictures that are missing."""
    with job.stage("trace"):
        trace(job, bundle, sequence)
    if job.plan.impairments:
        with job.stage("impair"):
            _impair(job)
    if job.plan.images:
        with job.stage("render"):
            render(job, sequence)


def _tell_depth(job: Job) -> None:
    for name in job.plan.radios:
        radio = job.plan.radio(name)
        if radio.deepest < job.plan.depth:
            why = "its antennas move" if radio.antennas_move else "its band is ultra-wide"
            logger.info("%s: traced at depth %d, as %s", name, radio.deepest, why)


def _contents(job: Job) -> list[str]:
    pictures = ["images", "depth", "normal", "mask"] if job.plan.images else []
    impaired = ["csi_impaired"] if job.plan.impairments else []
    paths = ["paths"] if job.plan.paths else []
    return ["csi", "csi_static", *impaired, *paths, *pictures, "geometry"]


def _impair(job: Job) -> None:
    settings = impairments_from_json(job.plan.impairments)
    sequence = Sequence(job.files.root, job.name)
    for radio in sequence.radios:
        if not has_impaired(job.files.csi(radio)):
            remove_impaired(job.files.csi(radio))
            impair_radio(sequence, radio, settings, job.plan.seed)


def _export(job: Job) -> Bundle:
    target, plan_file = job.work / "bundle", job.work / "plan.json"
    plan = asdict(job.plan)
    if not plan_file.is_file() or read_json(plan_file) != plan:
        shutil.rmtree(target, ignore_errors=True)
        write_json(plan_file, plan)
    if not (target / "bundle.json").is_file():
        refuse_large_scene(job)
        fresh = job.work / "bundle.new"
        shutil.rmtree(fresh, ignore_errors=True)
        logger.info("exporting the scene from Blender")
        arguments = ["--out", str(fresh), *job.picture_size]
        frames = ["--frames", job.plan.frames] if job.plan.frames else []
        spans = {pose_span_s(job.plan.radio(name)) for name in job.plan.radios}
        spans_s = sorted(span_s for span_s in spans if span_s is not None)
        poses = [text for span_s in spans_s for text in ("--span", repr(span_s))]
        more = [*frames, *poses, *(["--velocities"] if job.plan.paths else [])]
        with progress_bar("export", "frame") as progress, job.clock("export") as clock:

            def step(done: int, total: int) -> None:
                progress(done, total)
                clock.step()

            job.run_blender("export", *arguments, *more, progress=step)
        read_bundle(fresh)
        fresh.rename(target)
    return read_bundle(target)


def _choose(job: Job, bundle: Bundle) -> tuple[dict[str, list[DevicePose]], list[dict[str, Any]]]:
    """Chooses each radio's devices and refuses what cannot be traced."""
    radios = [job.plan.radio(name) for name in job.plan.radios]
    devices, guesses = {}, []
    for radio in radios:
        devices[radio.name], guess = choose_devices(bundle, radio)
        own = f"{len(devices[radio.name])} devices, the scene's own"
        logger.info("%s: %s", radio.name, guess["value"] if guess else own)
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
        radio = job.plan.radio(name)
        samples = frame_samples(radio, sequence.fps, poses)
        create_csi(
            job.files.csi(name), radio, layout(radio, poses), sequence.frames, times, samples
        )
    return sequence


def render(job: Job, sequence: SequenceInfo) -> None:
    """Renders and encodes every picture that is missing.

    Raises:
        RfgsError: Blender failed, or a picture lacks a pass.
    """
    cameras = [row["name"] for row in sequence.cameras]
    rendered = job.work / "rendered"
    missing = missing_pictures(job.files, sequence.frames)
    size = ["--out", str(rendered), *job.picture_size, "--samples", str(job.plan.samples)]
    for run in frame_runs(missing):
        shutil.rmtree(rendered, ignore_errors=True)
        frames = list(parse_frames(run))
        with progress_bar("render") as progress, job.clock("render") as clock:

            def encode(
                done: int, total: int, frames: list[int] = frames, clock: Clock = clock
            ) -> None:
                progress(done, total)
                clock.step()
                # Frames are rendered one after the other with all cameras, so these are whole.
                _encode(job, rendered, cameras, frames[: done // len(cameras)])

            arguments = [*size, "--frames", run, "--passes"]
            job.run_blender("groundtruth", *arguments, progress=encode)
        _encode(job, rendered, cameras, frames)
    if any(not job.files.image_empty(camera).is_file() for camera in cameras):
        with progress_bar("empty room") as progress:
            frame = str(sequence.frames[0])
            arguments = [*size, "--frames", f"{frame}:{frame}", "--empty"]
            job.run_blender("groundtruth", *arguments, progress=progress)
        encode_empty(rendered, job.files, cameras)


def _encode(job: Job, rendered: Path, cameras: list[str], frames: list[int]) -> None:
    for frame in missing_pictures(job.files, frames):
        if rendered_whole(rendered, cameras, frame):
            encode_frame(rendered, job.files, cameras, frame)
            # What Blender wrote is larger than what is kept of it.
            for camera in cameras:
                for file in (rendered / camera).glob(f"{frame:06d}.*"):
                    file.unlink()
