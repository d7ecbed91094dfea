# SPDX-License-Identifier: Apache-2.0
"""A dataset made from a real Blender file, and what happens when making it is disturbed."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from dataset_factory.check.validate import validate
from dataset_factory.make.generate import generate
from dataset_factory.plan.job import Job
from rfgs_core.dataset import open_dataset
from rfgs_core.errors import RfgsError

MakeJob = Callable[..., Job]
Factory = Callable[..., subprocess.CompletedProcess[str]]
Bytes = Callable[[Path], dict[str, bytes]]


def test_dataset_shows_one_scene_to_radio_and_cameras(box_dataset: Path) -> None:
    dataset = open_dataset(box_dataset)
    sequence = dataset.sequence()
    assert sequence.name == "box_room" and sequence.frames == [1, 2] and sequence.fps == 10
    assert np.allclose(sequence.bounds_m, [[0, 0, 0], [3, 3, 2.5]], atol=1e-4)
    assert [row["class"] for row in sequence.instances] == ["person"]
    assert sequence.instances[0]["nominal_surface_m2"] == 1.6
    change = sequence.csi("wifi", 1) - sequence.csi_static("wifi")
    ratio = np.linalg.norm(change) / np.linalg.norm(sequence.csi_static("wifi"))
    assert 0.01 < ratio < 1.0
    vertices, faces, instance = sequence.moving_mesh(2)
    assert np.allclose(np.ptp(vertices, axis=0), [0.2, 0.15, 0.85], atol=1e-4)
    assert len(faces) == len(instance) == 12
    camera = sequence.cameras[0]
    mask, depth = sequence.mask("cam00", 2), sequence.depth("cam00", 2)
    local = np.linalg.inv(camera["world_from_camera"]) @ [*vertices.mean(0), 1]
    u = camera["cx"] - camera["fl_x"] * local[0] / local[2]
    v = camera["cy"] + camera["fl_y"] * local[1] / local[2]
    assert mask[int(v), int(u)] == 1
    assert abs(-local[2] - 0.075 - depth[int(v), int(u)]) < 0.05
    assert np.isinf(depth).any() and (sequence.image("cam00", 2)[np.isinf(depth)][:, 3] < 255).all()
    empty = sequence.image_empty("cam00").astype(float)
    assert np.abs(empty - sequence.image("cam00", 2))[mask == 1].mean() > 10


def test_devices_that_were_placed_are_told(box_dataset: Path) -> None:
    guesses = open_dataset(box_dataset).sequence().info.guesses
    placed = [row for row in guesses if row["what"] == "devices"]
    assert placed[0]["object"] == "wifi" and "4 in the corners" in placed[0]["value"]


def test_pictures_hold_no_metadata(box_dataset: Path) -> None:
    for file in box_dataset.rglob("*.png"):
        with Image.open(file) as image:
            assert not image.info, file
    for file in box_dataset.rglob("*.exr"):
        head = file.read_bytes()[:1000]
        assert not any(word in head for word in (b"Date", b"capDate", b"Time", b"Host")), file


def test_finished_work_is_reused(make_job: MakeJob, box_dataset: Path) -> None:
    before = {file: file.stat().st_mtime_ns for file in box_dataset.rglob("*")}
    assert not generate(make_job(box_dataset))
    assert before == {file: file.stat().st_mtime_ns for file in box_dataset.rglob("*")}


def test_other_settings_in_the_same_folder_are_refused(
    make_job: MakeJob, box_dataset: Path
) -> None:
    with pytest.raises(RfgsError, match="seed = 0, this run asks for 5"):
        generate(make_job(box_dataset, seed=5))
    with pytest.raises(RfgsError, match="frames = '1:2', this run asks for '1:3'"):
        generate(make_job(box_dataset, frames="1:3"))
    assert make_job(box_dataset, frames="2").plan.frames == "2:2"


def test_foreign_folders_are_left_alone(make_job: MakeJob, tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").write_text("precious")
    with pytest.raises(RfgsError, match="not empty and no dataset"):
        generate(make_job(tmp_path))
    assert [file.name for file in tmp_path.iterdir()] == ["thesis.txt"]


def test_a_run_stopped_between_pictures_ends_in_the_same_bytes(
    make_job: MakeJob,
    box_copy: Path,
    box_dataset: Path,
    data_of: Bytes,
    unfinish: Callable[[Path], None],
) -> None:
    unfinish(box_copy)
    root = box_copy / "box_room"
    (root / "images/done/000002").unlink()
    (root / "depth/cam00/000002.exr").unlink()
    (root / "mask/cam00/.tmp-1234abcd-000002.png").write_bytes(b"half")
    (root / "radio/wifi/csi.zarr/csi/c/1/0/0/0.12.partial").write_bytes(b"half")
    (root / "geometry/000002.npz").unlink()
    assert generate(make_job(box_copy))
    assert data_of(box_copy) == data_of(box_dataset)


def test_a_run_stopped_while_tidying_up_is_complete(
    make_job: MakeJob, box_copy: Path, box_dataset: Path, data_of: Bytes
) -> None:
    (box_copy / ".work").mkdir()
    (box_copy / ".work" / "lock").touch()
    assert not generate(make_job(box_copy))
    assert data_of(box_copy) == data_of(box_dataset)


@pytest.mark.slow
def test_a_lost_frame_is_traced_again_by_another_number_of_workers(
    make_job: MakeJob,
    box_copy: Path,
    box_dataset: Path,
    data_of: Bytes,
    unfinish: Callable[[Path], None],
) -> None:
    unfinish(box_copy)
    radio = box_copy / "box_room/radio/wifi"
    (radio / "done/000002").unlink()
    shutil.rmtree(radio / "csi.zarr/csi/c/0")
    assert generate(make_job(box_copy, workers=2))
    assert data_of(box_copy) == data_of(box_dataset)
    assert validate(box_copy) == []


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT])
def test_killed_again_and_again_ends_in_the_same_bytes(
    box_room: Path,
    box_dataset: Path,
    make_job: MakeJob,
    data_of: Bytes,
    tmp_path: Path,
    number: signal.Signals,
) -> None:
    """Stops the run as soon as each of its traces appears, then lets it finish."""
    out = tmp_path / "dataset"
    command = [sys.executable, "-m", "dataset_factory", "generate", str(box_room)]
    command += ["--radio", "wifi", "--frames", "1:2", "--cameras", "1", "--resolution", "32"]
    command += ["--samples", "2", "--depth", "1", "--workers", "2", "--out", str(out)]
    for trace in (
        ".work/bundle.new",
        ".work/bundle/bundle.json",
        "box_room/sequence.json",
        "box_room/radio/wifi/done/static",
        "box_room/radio/wifi/done/000001",
        ".work/rendered",
        "box_room/images/done/000001",
        "box_room/images_empty/cam00.png",
        "MANIFEST.sha256",
    ):
        log = tmp_path / "log"
        with log.open("w") as stream:
            process = subprocess.Popen(command, stderr=stream, stdout=subprocess.DEVNULL)
        # A Python that has not yet begun to run the program cannot answer for it.
        while process.poll() is None and not (log.stat().st_size and (out / trace).exists()):
            time.sleep(0.005)
        process.send_signal(number)
        code = process.wait()
        if number == signal.SIGINT:
            assert code in (0, 130), log.read_text()
            assert "Traceback" not in log.read_text()
            assert code == 0 or log.read_text().count("stopped; finished work is kept") == 1
    generate(make_job(out))
    assert data_of(out) == data_of(box_dataset)
    assert os.listdir(out / "log")


@pytest.mark.slow
def test_a_stopped_run_with_a_radio_of_ones_own_ends_in_the_same_bytes(
    box_room: Path, factory: Factory, data_of: Bytes, tmp_path: Path
) -> None:
    radio = tmp_path / "lab.yaml"
    radio.write_text("like: wifi24\nheights_m: [1, 2]\npolarization: VH\nrx_rows: 2\n")
    common = ["generate", str(box_room), "--radio", str(radio), "--frames", "1:4", "--no-images"]
    common += ["--depth", "1", "--workers", "1", "--out"]
    whole, stopped = tmp_path / "whole", tmp_path / "stopped"
    done = stopped / "box_room/radio/lab/done"
    command = [sys.executable, "-m", "dataset_factory", *common, str(stopped)]
    with (tmp_path / "log").open("w") as stream:
        process = subprocess.Popen(command, stderr=stream, stdout=subprocess.DEVNULL)
    while process.poll() is None and not (done / "000001").exists():
        time.sleep(0.005)
    process.kill()
    process.wait()
    assert (done / "000001").exists() and not (stopped / "MANIFEST.sha256").exists()
    for out in (stopped, whole):
        run = factory(*common, str(out))
        assert run.returncode == 0, run.stderr
    assert data_of(stopped) == data_of(whole)
    assert open_dataset(stopped).sequence().radio_spec("lab").heights_m == (1.0, 2.0)
