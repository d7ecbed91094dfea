# SPDX-License-Identifier: Apache-2.0
"""Tables of paths in datasets: asked for, stored, read, checked."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from dataset_factory.check.paths import channel_error_db, path_faults
from dataset_factory.check.stats import stats
from dataset_factory.check.validate import validate
from dataset_factory.make.generate import generate
from dataset_factory.plan.disk import space
from dataset_factory.plan.job import Job
from rfgs_core.dataset import Sequence, open_dataset
from rfgs_core.dataset.path_store import read_paths, write_paths
from rfgs_core.dataset.writer import write_arrays
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.radio.images import SCATTERING
from rfgs_core.radio.path_table import PathTable

MakeJob = Callable[..., Job]
Bytes = Callable[[Path], dict[str, bytes]]


@pytest.fixture(scope="module")
def with_paths(make_job: MakeJob, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished dataset with tables of paths."""
    out = tmp_path_factory.mktemp("paths") / "dataset"
    assert generate(make_job(out, images=False, paths=True))
    return out


@pytest.fixture
def sequence(with_paths: Path, tmp_path: Path) -> Sequence:
    """The sequence of a copy that may be changed."""
    return open_dataset(Path(shutil.copytree(with_paths, tmp_path / "dataset"))).sequence()


def test_tables_are_stored_and_add_up(with_paths: Path) -> None:
    dataset = open_dataset(with_paths)
    assert "paths" in dataset.has
    assert validate(with_paths) == []
    sequence = dataset.sequence()
    spread, freq_hz = sequence.layout("wifi"), sequence.radio_spec("wifi").freq_hz
    static = sequence.paths_static("wifi")
    assert not (static.kind == SCATTERING).any() and not static.doppler_hz.any()
    assert channel_error_db(static, spread, freq_hz, sequence.csi_static("wifi")) < -60
    for frame in sequence.frames:
        table = sequence.paths("wifi", frame)
        assert channel_error_db(table, spread, freq_hz, sequence.csi("wifi", frame)) < -30
        body = table.select((table.kind == SCATTERING).any(axis=1))
        names = {row["id"]: row["name"] for row in sequence.info.objects}
        assert {names[i] for i in body.object[body.kind == SCATTERING]} == {"Box person"}
        assert {names[i] for i in np.unique(static.object) if i} <= {
            *("Floor", "Wall 0", "Wall 1", "Wall 2", "Wall 3")
        }
    numbers = stats(with_paths)["sequences"]["box_room"]["radios"]["wifi"]["paths"]
    assert numbers["per_frame"] > numbers["by_people_per_frame"] > 0


def test_doppler_follows_the_animation(with_paths: Path) -> None:
    sequence = open_dataset(with_paths).sequence()
    table = sequence.paths("wifi", 2)
    body = table.select(table.kind[:, 0] == SCATTERING)
    velocity = sequence.segment_velocity(2)
    # A box without a rig moves as one, along x; joints are not known.
    assert np.isnan(velocity).all()
    way_m = [sequence.moving_mesh(frame)[0].mean(axis=0)[0] for frame in (1, 2)]
    k = np.diff(body.vertices[:, :3].astype(float), axis=1)
    k /= np.linalg.norm(k, axis=2, keepdims=True)
    per_m_s = (k[:, 1, 0] - k[:, 0, 0]) / (3e8 / 5.8e9)
    clear = np.abs(per_m_s) > 5.0
    speed = np.median(body.doppler_hz[clear] / per_m_s[clear])
    # Eased in from rest at frame 1: faster at frame 2 than on the way there.
    assert 1.0 * (way_m[1] - way_m[0]) * 10 < speed < 3.0 * (way_m[1] - way_m[0]) * 10
    assert np.ptp(body.doppler_hz[clear] / per_m_s[clear]) < 0.1 * speed


@pytest.mark.slow
def test_two_workers_write_the_same_bytes(
    with_paths: Path, make_job: MakeJob, data_of: Bytes, tmp_path: Path
) -> None:
    out = tmp_path / "dataset"
    assert generate(make_job(out, images=False, paths=True, workers=2))
    assert data_of(out) == data_of(with_paths)


@pytest.mark.slow
def test_a_lost_table_is_made_again(
    with_paths: Path,
    make_job: MakeJob,
    data_of: Bytes,
    unfinish: Callable[[Path], None],
    tmp_path: Path,
) -> None:
    out = Path(shutil.copytree(with_paths, tmp_path / "dataset"))
    unfinish(out)
    (out / "box_room/radio/wifi/paths/000002.npz").unlink()
    assert generate(make_job(out, images=False, paths=True))
    assert data_of(out) == data_of(with_paths)


def test_plan_counts_the_tables(make_job: MakeJob, with_paths: Path) -> None:
    from dataset_factory.scene.bundle import Bundle

    sequence = open_dataset(with_paths).sequence()
    sizes = [sequence.files.paths("wifi", frame).stat().st_size for frame in sequence.frames]
    frame = sequence.files.geometry(1)
    folder = with_paths / "log" / "bundle"
    (folder / "frames").mkdir(parents=True, exist_ok=True)
    shutil.copy(frame, folder / "frames" / "000001.npz")
    bundle = replace_path(Bundle, folder)
    jobs = [make_job(with_paths, images=False, paths=wanted) for wanted in (False, True)]
    needed = [space(job, bundle, sequence.info) for job in jobs]
    assert needed[1].frame_bytes - needed[0].frame_bytes == max(sizes)
    shutil.rmtree(folder)


def replace_path(kind: type, folder: Path):
    """A bundle of which only the folder is known."""
    empty = dict.fromkeys((spec.name for spec in fields(kind)), None)
    return kind(**{**empty, "path": folder})


def changed(table: PathTable, name: str, by: float, rows: slice = slice(None)) -> PathTable:
    values = getattr(table, name).copy()
    values[rows] += np.array(by).astype(values.dtype)
    return replace(table, **{name: values})


@pytest.mark.parametrize(
    ("name", "by", "told"),
    [
        ("delay_s", 1e-9, "delay_s: differs from the length of vertices"),
        ("vertices", 0.05, "vertices: paths that do not end at their tx_site"),
        ("departure_zenith_rad", 0.01, "departure_zenith_rad: differs from the direction"),
        ("arrival_azimuth_rad", 0.01, "arrival_azimuth_rad: differs from the direction"),
        ("object", 90, "object: ids missing in sequence.json"),
        ("tx_device", 1, "tx_device: not the device of tx_site"),
        ("kind", 32, "kind: unknown codes"),
        ("node_hz", 1e6, "node_hz: expected the edges of the band"),
    ],
)
def test_what_is_wrong_is_named(sequence: Sequence, name: str, by: float, told: str) -> None:
    file = sequence.files.paths("wifi", 2)
    write_paths(file, changed(read_paths(file), name, by))
    faults = list(path_faults(sequence, "wifi"))
    assert any(told in fault and "000002.npz" in fault for fault in faults), faults


def test_amplitudes_of_another_channel_are_found(sequence: Sequence) -> None:
    file = sequence.files.paths("wifi", 2)
    table = read_paths(file)
    write_paths(file, replace(table, amplitude=table.amplitude * np.complex64(1.2)))
    assert "adds up to another channel" in next(iter(path_faults(sequence, "wifi")))


def test_damaged_and_missing_tables_are_refused(sequence: Sequence, box_dataset: Path) -> None:
    file = sequence.files.paths("wifi", 1)
    table = read_paths(file)
    columns = {spec.name: getattr(table, spec.name) for spec in fields(table)}
    write_arrays(file, **{**columns, "delay_s": table.delay_s.astype(np.float32)})
    with pytest.raises(RfgsFormatError, match="delay_s: expected float64"):
        sequence.paths("wifi", 1)
    file.write_bytes(file.read_bytes()[:-100])
    with pytest.raises(RfgsFormatError, match=r"000001\.npz: damaged"):
        sequence.paths("wifi", 1)
    with pytest.raises(RfgsError, match=r"no such file; .*--paths"):
        open_dataset(box_dataset).sequence().paths("wifi", 1)
