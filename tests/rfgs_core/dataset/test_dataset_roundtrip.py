# SPDX-License-Identifier: Apache-2.0
"""What was written comes back bit for bit, and damage is named."""

from __future__ import annotations

import json
import shutil
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
from torch.utils.data import DataLoader

import rfgs_core
from rfgs_core.dataset import open_dataset
from rfgs_core.dataset.csi_store import chunk_file
from rfgs_core.dataset.schema import radio_from_json
from rfgs_core.dataset.torch_dataset import FrameDataset
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.radio import preset


@pytest.fixture
def copy(tiny_dataset: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(tiny_dataset, tmp_path / "copy"))


def edit(file: Path, **changes: object) -> None:
    value = json.loads(file.read_text())
    value.update(changes)
    file.write_text(json.dumps(value))


def test_xarray_and_checked_reader_agree_bit_for_bit(tiny_dataset: Path) -> None:
    sequence = rfgs_core.open_dataset(tiny_dataset).sequence()
    data = sequence.radio("wifi")
    assert data["csi"].dims == ("time", "tx", "rx", "subcarrier")
    assert data["csi"].dtype == np.complex64
    assert data["frame"].values.tolist() == sequence.frames == [1, 2]
    assert np.allclose(data["time_s"].values, [0.0, 0.1])
    for index, frame in enumerate(sequence.frames):
        assert np.array_equal(data["csi"][index].values, sequence.csi("wifi", frame))
    assert np.array_equal(data["csi_static"].values, sequence.csi_static("wifi"))
    layout = sequence.layout("wifi")
    assert np.array_equal(data["rx_xyz"].values, layout.rx_xyz)
    assert np.array_equal(data["measured"].values, layout.measured)


def test_coordinates_alone_are_those_of_the_store_and_read_once(tiny_dataset: Path) -> None:
    sequence = open_dataset(tiny_dataset).sequence()
    alone, data = sequence.coordinates("wifi"), sequence.radio("wifi")
    assert set(alone.variables) == set(data.coords) and not set(alone.data_vars)
    for name, values in data.coords.items():
        assert (alone[name].dims, alone[name].attrs) == (values.dims, values.attrs)
        np.testing.assert_array_equal(alone[name].values, values.values)
    assert sequence.coordinates("wifi") is alone
    with pytest.raises(RfgsError, match="no radio"):
        sequence.coordinates("lora")


def test_direct_path_delay_matches_geometry(tiny_dataset: Path) -> None:
    sequence = open_dataset(tiny_dataset).sequence()
    layout, radio = sequence.layout("wifi"), sequence.radio_spec("wifi")
    phase = np.angle(sequence.csi_static("wifi")[..., 1:] / sequence.csi_static("wifi")[..., :-1])
    delay_m = -phase.mean(-1) / (2 * np.pi) * radio.unambiguous_path_m
    true_m = np.linalg.norm(layout.tx_xyz[:, None] - layout.rx_xyz[None], axis=-1)
    assert np.allclose(delay_m % radio.unambiguous_path_m, true_m, atol=1e-3)


def test_pictures_agree_with_geometry(tiny_dataset: Path) -> None:
    sequence = open_dataset(tiny_dataset).sequence()
    for camera in sequence.cameras:
        mask = sequence.mask(camera["name"], 2)
        depth = sequence.depth(camera["name"], 2)
        assert mask.dtype == np.uint16 and set(np.unique(mask)) == {0, 1}
        assert sequence.image(camera["name"], 2).shape == (24, 24, 4)
        assert np.allclose(
            np.linalg.norm(sequence.normal(camera["name"], 2), axis=-1), 1, atol=1e-3
        )
        joint = sequence.joints(2)[0, 8]
        moved = (sequence.joints(2) - sequence.joints(1)) * sequence.fps
        np.testing.assert_allclose(sequence.segment_velocity(2), moved, rtol=1e-4, atol=1e-5)
        local = np.linalg.inv(camera["world_from_camera"]) @ [*joint, 1.0]
        u = camera["cx"] - camera["fl_x"] * local[0] / local[2]
        v = camera["cy"] + camera["fl_y"] * local[1] / local[2]
        assert mask[int(v), int(u)] == 1
        assert abs(-local[2] - depth[int(v), int(u)]) < 0.35
    vertices, faces, instance = sequence.moving_mesh(2)
    assert faces.max() < len(vertices) and len(instance) == len(faces)
    assert np.allclose(vertices.mean(0), [1.5, 1.4, 1.0], atol=0.03)
    walls, _ = sequence.static_mesh()
    assert np.allclose([walls.min(0), walls.max(0)], sequence.bounds_m)


def test_splits_hold_out_what_the_schema_says(tiny_dataset: Path) -> None:
    sequence = open_dataset(tiny_dataset).sequence()
    rf = sequence.splits["rf"]["wifi"]
    layout = sequence.layout("wifi")
    assert rf["rx_elements"] == np.flatnonzero(layout.rx_column == 3).tolist()
    assert rf["subcarriers"] == [10, 11]
    assert len(rf["device_pairs"]) == 1 and len(set(rf["device_pairs"][0])) == 2
    images = sequence.splits["images"]
    assert len(images["test_cameras"]) == len(images["test_frames"]) == 1
    for split, count in (("train", 3), ("test", 5)):
        rows = json.loads((sequence.path / f"transforms_{split}.json").read_text())["frames"]
        assert len(rows) == count
        assert all((sequence.path / row["file_path"]).is_file() for row in rows)


def test_torch_dataset_batches(tiny_dataset: Path) -> None:
    sequence = open_dataset(tiny_dataset).sequence("tiny")
    batch = next(iter(DataLoader(FrameDataset(sequence, "wifi"), batch_size=2)))
    assert batch["csi"].shape == (2, 4, 32, 16)
    assert batch["frame"].tolist() == [1, 2]


@pytest.mark.parametrize("keep", [0, 7, 200])
def test_truncated_chunk_is_named(copy: Path, keep: int) -> None:
    store = copy / "tiny/radio/wifi/csi.zarr"
    file = chunk_file(store, 1)
    file.write_bytes(file.read_bytes()[:keep])
    sequence = open_dataset(copy).sequence()
    sequence.csi("wifi", 1)
    with pytest.raises(RfgsFormatError, match=str(file)):
        sequence.csi("wifi", 2)


def test_altered_and_missing_chunks_are_named(copy: Path) -> None:
    store = copy / "tiny/radio/wifi/csi.zarr"
    shutil.copy(chunk_file(store, 0), chunk_file(store, 1))
    sequence = open_dataset(copy).sequence()
    with pytest.raises(RfgsFormatError, match=r"c/1/0/0/0: CSI chunk differs"):
        sequence.csi("wifi", 2)
    chunk_file(store, None).unlink()
    with pytest.raises(RfgsFormatError, match="never finished"):
        sequence.csi_static("wifi")
    (store / "csi" / "zarr.json").write_text("{")
    with pytest.raises(RfgsFormatError, match=r"csi\.zarr/csi"):
        sequence.csi("wifi", 1)


@pytest.mark.parametrize("file", ["dataset.json", "tiny/sequence.json"])
def test_newer_schema_is_refused(copy: Path, file: str) -> None:
    schema = json.loads((copy / file).read_text())["schema"].replace("/1", "/2")
    edit(copy / file, schema=schema)
    with pytest.raises(RfgsError, match="newer than"):
        open_dataset(copy).sequence()


@pytest.mark.parametrize("name", ["../copy/tiny", "/etc", "..", "", "a/b", ".hidden"])
def test_names_from_files_stay_inside(copy: Path, name: str) -> None:
    edit(copy / "dataset.json", sequences=[name])
    with pytest.raises(RfgsFormatError, match="leads outside"):
        open_dataset(copy)


def test_camera_names_from_files_stay_inside(copy: Path) -> None:
    cameras = json.loads((copy / "tiny/sequence.json").read_text())["cameras"]
    cameras[0]["name"] = "../../secret"
    edit(copy / "tiny/sequence.json", cameras=cameras)
    with pytest.raises(RfgsFormatError, match="leads outside"):
        open_dataset(copy).sequence()


@pytest.mark.parametrize(
    "change",
    [
        {"frames": ["1", "2"]},
        {"frames": [1.5]},
        {"frames": [[1]]},
        {"cameras": ["cam00"]},
        {"radios": {"wifi": []}},
        {"bounds_m": [["a", 0, 0], [1, 1, 1]]},
        {"bounds_m": [[0, 0], [1, 1, 1]]},
        {"bounds_m": [[0, 0, 0], [1, float("nan"), 1]]},
    ],
)
def test_numbers_that_are_none_are_refused(copy: Path, change: dict) -> None:
    edit(copy / "tiny/sequence.json", **change)
    with pytest.raises(RfgsFormatError, match=r"sequence\.json"):
        open_dataset(copy).sequence()


@pytest.mark.parametrize(
    ("field", "value"),
    [("num_subcarriers", "many"), ("own_device_links", "sometimes"), ("tx_rows", True)],
)
def test_radios_of_another_type_are_refused(copy: Path, field: str, value: object) -> None:
    radios = json.loads((copy / "tiny/sequence.json").read_text())["radios"]
    radios["wifi"][field] = value
    edit(copy / "tiny/sequence.json", radios=radios)
    found = str(value).lower()
    with pytest.raises(RfgsFormatError, match=f"radio 'wifi': {field}: expected .*{found}"):
        open_dataset(copy).sequence().layout("wifi")


@pytest.mark.parametrize(
    "row",
    [
        {"name": "a", "position_m": [0, 0, 0]},
        {"name": "a", "position_m": [0, 0], "quat_wxyz": [1, 0, 0, 0]},
        {"name": "a", "position_m": [0, 0, 0], "quat_wxyz": [0, 0, 0, 0]},
        {"name": "a", "position_m": [0, 0, "x"], "quat_wxyz": [1, 0, 0, 0]},
        7,
    ],
)
def test_devices_without_a_pose_are_refused(copy: Path, row: object) -> None:
    edit(copy / "tiny/sequence.json", devices={"wifi": [row]})
    with pytest.raises(RfgsFormatError, match="device"):
        open_dataset(copy).sequence().devices("wifi")


def test_triangles_of_missing_vertices_are_refused(copy: Path) -> None:
    file = copy / "tiny/geometry/topology.npz"
    np.savez(file, faces=np.array([[0, 1, 10**6]], np.int32), instance=np.array([1], np.int32))
    with pytest.raises(RfgsFormatError, match="existing vertices"):
        open_dataset(copy).sequence().moving_mesh(1)


def test_pickled_geometry_is_refused(copy: Path) -> None:
    file = copy / "tiny/geometry/000001.npz"
    np.savez(file, vertices=np.array([{"a": 1}], dtype=object))
    with pytest.raises(RfgsFormatError, match=str(file)):
        open_dataset(copy).sequence().joints(1)


@pytest.mark.parametrize("kind", ["image", "depth", "mask", "normal"])
def test_damaged_pictures_are_named(copy: Path, kind: str) -> None:
    sequence = open_dataset(copy).sequence()
    file = getattr(sequence.files, kind)("cam00", 1)
    data = file.read_bytes()
    for damaged in (b"", data[:20], data[: len(data) // 2]):
        file.write_bytes(damaged)
        with pytest.raises(RfgsFormatError, match=str(file)):
            getattr(sequence, kind)("cam00", 1)


def test_wrong_questions_get_one_clear_line(copy: Path, tmp_path: Path) -> None:
    with pytest.raises(RfgsError, match="no dataset there"):
        open_dataset(tmp_path / "nothing")
    sequence = open_dataset(copy).sequence()
    with pytest.raises(RfgsError, match="no frame 9"):
        sequence.csi("wifi", 9)
    with pytest.raises(RfgsError, match="no radio 'lora'; it holds wifi"):
        sequence.radio("lora")
    with pytest.raises(RfgsError, match="no camera"):
        sequence.image("cam99", 1)
    edit(copy / "dataset.json", sequences=["tiny", "other"])
    with pytest.raises(RfgsError, match="ambiguous sequence: it holds tiny, other"):
        open_dataset(copy).sequence()
    edit(copy / "dataset.json", manifest_sha256="")
    with pytest.raises(RfgsError, match="unfinished"):
        open_dataset(copy)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("num_subcarriers", 0),
        ("samples_per_frame", 0),
        ("rx_cols", -1),
        ("freq_min_hz", 0.0),
        ("freq_max_hz", float("nan")),
        ("pattern", "yagi"),
        ("polarization", "RHCP"),
    ],
)
def test_impossible_radios_are_named(tmp_path: Path, field: str, value: object) -> None:
    values = asdict(preset("wifi"))
    assert radio_from_json(tmp_path / "sequence.json", values) == preset("wifi")
    with pytest.raises(RfgsFormatError, match=r"sequence\.json: radio 'wifi': .* is impossible"):
        radio_from_json(tmp_path / "sequence.json", {**values, field: value})


def test_a_name_that_no_file_system_has_is_told_in_one_line() -> None:
    with pytest.raises(RfgsError, match="no dataset there") as caught:
        open_dataset("a" * 5000)
    assert len(str(caught.value)) < 300
