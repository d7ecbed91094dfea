# SPDX-License-Identifier: Apache-2.0
"""What was converted is read back by readers of the other formats' own rules."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from plyfile import PlyData
from scipy.spatial.transform import Rotation

from dataset_factory.convert import FORMATS, convert
from dataset_factory.convert.coco import run_lengths
from rfgs_core.dataset import Sequence, open_dataset
from rfgs_core.dataset.mesh_ply import write_mesh
from rfgs_core.dataset.writer import finish_dataset, write_sequence_info
from rfgs_core.errors import RfgsError

#: Middle of the tiny dataset's sphere: joint 8 of its only person.
CENTRE = 8


@pytest.fixture
def sequence(tiny_dataset: Path) -> Sequence:
    return open_dataset(tiny_dataset).sequence()


def pixels(file: Path) -> np.ndarray:
    with Image.open(file) as image:
        return np.asarray(image)


def on_mask(sequence: Sequence, name: str, frame: int, column: float, row: float) -> bool:
    return bool(sequence.mask(name, frame)[int(row), int(column)] == 1)


def opengl_pixel(matrix: Any, lens: dict[str, float], point: np.ndarray) -> tuple[float, float]:
    """Projection by a camera-to-world matrix whose camera looks along its own −Z."""
    x, y, z = (np.linalg.inv(np.asarray(matrix)) @ [*point, 1.0])[:3]
    assert z < 0.0
    return lens["cx"] - lens["fl_x"] * x / z, lens["cy"] + lens["fl_y"] * y / z


def test_nerfstudio_cameras_depths_and_masks(
    tiny_dataset: Path, sequence: Sequence, tmp_path: Path
) -> None:
    out = tmp_path / "ns"
    convert(tiny_dataset, "nerfstudio", out)
    value = json.loads((out / "transforms.json").read_text())
    assert len(value["frames"]) == 8
    assert sorted(value["train_filenames"] + value["test_filenames"]) == sorted(
        row["file_path"] for row in value["frames"]
    )
    for row in value["frames"]:
        camera, _, number = Path(row["file_path"]).stem.partition("_")
        frame = int(number)
        assert row["time"] == frame - 1
        column, line = opengl_pixel(row["transform_matrix"], row, sequence.joints(frame)[0, CENTRE])
        assert on_mask(sequence, camera, frame, column, line)
        assert np.array_equal(pixels(out / row["file_path"]), sequence.image(camera, frame))
        depth_m = pixels(out / row["depth_file_path"]) / 1000.0
        assert np.abs(depth_m - sequence.depth(camera, frame)).max() <= 0.00051
        still = pixels(out / row["mask_path"])
        assert set(np.unique(still)) == {0, 255} and still[int(line), int(column)] == 0
        held = camera in sequence.splits["images"]["test_cameras"] or (
            frame in sequence.splits["images"]["test_frames"]
        )
        assert (row["file_path"] in value["test_filenames"]) == held
    points = PlyData.read(str(out / value["ply_file_path"]))["vertex"].data
    xyz = np.stack([points[axis] for axis in "xyz"], -1)
    # Every point lies on a wall of the box, and walls were painted 90 or 150 per channel.
    low, high = sequence.bounds_m
    assert np.abs(np.concatenate([xyz - low, xyz - high], 1)).min(axis=1).max() < 1e-4
    seen = points["red"] != 128
    assert seen.mean() > 0.5 and set(np.unique(points["red"][seen])) <= set(range(90, 151))


def test_d_nerf_splits_times_and_angle(
    tiny_dataset: Path, sequence: Sequence, tmp_path: Path
) -> None:
    out = tmp_path / "dn"
    convert(tiny_dataset, "d-nerf", out)
    seen = []
    for split in ("train", "test"):
        value = json.loads((out / f"transforms_{split}.json").read_text())
        focal = 0.5 * 24 / np.tan(0.5 * value["camera_angle_x"])
        for row in value["frames"]:
            image = pixels(out / (row["file_path"] + ".png"))
            assert image.shape == (24, 24, 4)
            lens = {"fl_x": focal, "fl_y": focal, "cx": 12.0, "cy": 12.0}
            camera, _, number = Path(row["file_path"]).name.partition("_")
            frame = int(number)
            point = sequence.joints(frame)[0, CENTRE]
            assert on_mask(
                sequence, camera, frame, *opengl_pixel(row["transform_matrix"], lens, point)
            )
            assert row["time"] == {1: 0.0, 2: 1.0}[frame]
            seen.append((camera, frame))
    assert len(seen) == len(set(seen)) == 8
    test = (out / "transforms_test.json").read_text()
    assert (out / "transforms_val.json").read_text() == test


def test_d_nerf_keeps_lenses_apart_and_refuses_what_it_cannot_say(
    tiny_copy: Path, tmp_path: Path
) -> None:
    dataset = open_dataset(tiny_copy)
    sequence = dataset.sequence()
    sequence.cameras[1].update(fl_x=20.0, fl_y=20.0)
    write_sequence_info(sequence.files, sequence.info)
    finish_dataset(tiny_copy, dataset.info)
    convert(tiny_copy, "d-nerf", tmp_path / "two")
    angles = {
        folder.name: json.loads((folder / "transforms_train.json").read_text())["camera_angle_x"]
        for folder in (tmp_path / "two").iterdir()
    }
    assert np.isclose(angles["cam00"], 2 * np.arctan(12 / 16.0))
    assert np.isclose(angles["cam01"], 2 * np.arctan(12 / 20.0))
    sequence.cameras[1].update(cx=3.0)
    write_sequence_info(sequence.files, sequence.info)
    finish_dataset(tiny_copy, dataset.info)
    with pytest.raises(RfgsError, match="cam01 is off-centre"):
        convert(tiny_copy, "d-nerf", tmp_path / "three")
    assert not (tmp_path / "three").exists()


def read_colmap(model: Path) -> tuple[dict, dict, np.ndarray]:
    """Cameras, images and points of a text model, by COLMAP's documentation of the format."""

    def lines(name: str) -> list[list[str]]:
        text = (model / f"{name}.txt").read_text().splitlines()
        return [line.split() for line in text if not line.startswith("#")]

    cameras = {}
    for row in lines("cameras"):
        assert row[1] == "PINHOLE"
        cameras[int(row[0])] = [int(v) for v in row[2:4]] + [float(v) for v in row[4:8]]
    images, rows = {}, lines("images")
    for head, key_points in zip(rows[::2], rows[1::2], strict=True):
        assert key_points == [] and len(head) == 10
        images[head[9]] = ([float(v) for v in head[1:8]], int(head[8]))
    points = np.array([[float(v) for v in row[:8]] for row in lines("points3D")])
    return cameras, images, points


def test_colmap_model_projects_the_person_onto_its_mask(
    tiny_dataset: Path, sequence: Sequence, tmp_path: Path
) -> None:
    out = tmp_path / "colmap"
    convert(tiny_dataset, "colmap", out)
    cameras, images, points = read_colmap(out / "sparse" / "0")
    assert len(cameras) == len(images) == 4
    for name, ((w, x, y, z, *shift), number) in images.items():
        width, height, fx, fy, cx, cy = cameras[number]
        assert pixels(out / "images" / name).shape[:2] == (height, width)
        view = Rotation.from_quat([x, y, z, w]).as_matrix()
        a, b, depth_m = view @ sequence.joints(1)[0, CENTRE] + shift
        assert depth_m > 0.0
        camera = name.removesuffix(".png")
        assert on_mask(sequence, camera, 1, fx * a / depth_m + cx, fy * b / depth_m + cy)
        world = np.asarray(
            next(r for r in sequence.cameras if r["name"] == camera)["world_from_camera"]
        )
        assert np.allclose(-view.T @ shift, world[:3, 3], atol=1e-9)
    assert len(np.unique(points[:, 0])) == len(points) == 20_000
    low, high = sequence.bounds_m
    assert (points[:, 1:4] >= low - 1e-5).all() and (points[:, 1:4] <= high + 1e-5).all()


def unrolled(found: dict[str, Any]) -> np.ndarray:
    """The mask of a COCO annotation, by the format's own rule."""
    height, width = found["segmentation"]["size"]
    flat, value = [], 0
    for count in found["segmentation"]["counts"]:
        flat += [value] * count
        value = 1 - value
    flat += [0] * (height * width - len(flat))
    return np.array(flat).reshape(width, height).T


def test_coco_masks_boxes_and_joints_are_the_persons(
    tiny_dataset: Path, sequence: Sequence, tmp_path: Path
) -> None:
    convert(tiny_dataset, "coco", tmp_path / "coco")
    folder = tmp_path / "coco"
    parts = [json.loads((folder / f"{name}.json").read_text()) for name in ("train", "test")]
    images = [row for part in parts for row in part["images"]]
    assert len(images) == 4 * len(sequence.frames) == len({row["id"] for row in images})
    files = {row["id"]: row["file_name"] for row in images}
    for part in parts:
        (category,) = part["categories"]
        assert category["keypoints"][CENTRE] == "thorax" and [9, 10] in category["skeleton"]
        for found in part["annotations"]:
            name, number = Path(files[found["image_id"]]).stem.split("_")
            mask = sequence.mask(name, int(number)) == found["instance"]
            np.testing.assert_array_equal(unrolled(found), mask)
            assert found["area"] == mask.sum()
            left, top, width, height = found["bbox"]
            assert mask[top : top + height, left : left + width].sum() == mask.sum()
            assert mask[:, left].any() and mask[top].any()
            column, row, seen = found["keypoints"][3 * CENTRE : 3 * CENTRE + 3]
            assert seen == 2 and on_mask(sequence, name, int(number), column, row)
    assert sum(len(part["annotations"]) for part in parts) == len(images)


@pytest.mark.parametrize(
    ("mask", "counts"),
    [([[0, 1], [0, 1]], [2, 2]), ([[1, 0], [1, 1]], [0, 2, 1, 1]), ([[0, 0], [1, 0]], [1, 1, 2])],
)
def test_run_lengths_go_down_the_columns(mask: list[list[int]], counts: list[int]) -> None:
    assert run_lengths(np.array(mask, bool)) == counts


@pytest.mark.parametrize("target", sorted(set(FORMATS) - {"deepmimo"}))
def test_the_same_dataset_gives_the_same_bytes(
    target: str, tiny_dataset: Path, tmp_path: Path, data_of: Callable[[Path], dict[str, bytes]]
) -> None:
    convert(tiny_dataset, target, tmp_path / "a")
    convert(tiny_dataset, target, tmp_path / "b")
    assert data_of(tmp_path / "a") == data_of(tmp_path / "b")


def test_wrong_requests_are_explained(tiny_copy: Path, tmp_path: Path) -> None:
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine.txt").write_text("keep me")
    with pytest.raises(RfgsError, match="exists already"):
        convert(tiny_copy, "mat", tmp_path / "full")
    with pytest.raises(RfgsError, match="inside the dataset"):
        convert(tiny_copy, "mat", tiny_copy / "mat")
    (tiny_copy / "tiny/images/cam00/000001.png").unlink()
    with pytest.raises(RfgsError, match=r"cam00/000001\.png: no such picture"):
        convert(tiny_copy, "d-nerf", tmp_path / "d")
    assert not (tmp_path / "d").exists()
    assert not list(tmp_path.glob(".tmp-*"))


def test_device_names_are_no_paths(tiny_copy: Path, tmp_path: Path) -> None:
    file = open_dataset(tiny_copy).sequence().files.info
    info = json.loads(file.read_text())
    for row, name in zip(info["devices"]["wifi"], ("../../a", "AP 1", "AP_1", ""), strict=True):
        row["name"] = name
    file.write_text(json.dumps(info))
    out = tmp_path / "below" / "nerf2"
    convert(tiny_copy, "nerf2", out)
    assert sorted(path.name for path in (out / "wifi").iterdir()) == [
        "AP_1",
        "AP_1_2",
        "_3",
        "______a",
    ]
    assert [path.name for path in out.iterdir()] == ["wifi"]


@pytest.mark.parametrize("target", ["colmap", "nerfstudio"])
def test_scenes_without_a_room_start_without_points(
    tiny_copy: Path, tmp_path: Path, target: str
) -> None:
    files = open_dataset(tiny_copy).sequence().files
    write_mesh(files.static_mesh, np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int32))
    convert(tiny_copy, target, tmp_path / "out")
    if target == "colmap":
        text = (tmp_path / "out" / "sparse" / "0" / "points3D.txt").read_text()
        assert text.count("\n") == 1
    else:
        assert len(PlyData.read(str(tmp_path / "out" / "points.ply"))["vertex"].data) == 0
