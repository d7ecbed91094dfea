# SPDX-License-Identifier: Apache-2.0
"""Whatever is damaged in a dataset is found and named."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from dataset_factory.check.physics import blocked, channel_faults
from dataset_factory.check.validate import validate
from dataset_factory.make.generate import generate
from dataset_factory.plan.job import Job
from rfgs_core.dataset import open_dataset
from rfgs_core.dataset.csi_store import write_csi
from rfgs_core.dataset.pictures import write_png
from rfgs_core.example import example_folder
from rfgs_core.files import write_json

Faults = Callable[[Path], list[str]]


def test_a_fresh_dataset_is_sound(box_dataset: Path) -> None:
    assert validate(box_dataset) == []


def test_a_dataset_in_which_nobody_but_a_thing_moves_is_sound(
    build_scene: Callable[..., Path], make_job: Callable[..., Job], tmp_path: Path
) -> None:
    out = tmp_path / "dataset"
    assert generate(make_job(out, frames="2:2", images=False, blend=build_scene(kind="AUTO")))
    assert validate(out) == []
    assert open_dataset(out).sequence("box_room").joints(2).shape == (0, 17, 3)


def test_the_example_that_comes_along_is_sound() -> None:
    """A quarter of the subcarriers: late reflections stand where a profile's negative delays do."""
    assert validate(example_folder() / "dataset") == []


def test_missing_and_foreign_files_are_named(box_copy: Path) -> None:
    (box_copy / "box_room/mask/cam00/000001.png").unlink()
    (box_copy / "box_room/notes.txt").write_text("mine")
    faults = validate(box_copy)
    assert any("000001.png: missing" in fault for fault in faults)
    assert any("notes.txt: not in the manifest" in fault for fault in faults)
    (box_copy / "MANIFEST.sha256").unlink()
    assert any("MANIFEST.sha256: missing" in fault for fault in validate(box_copy))


def test_unknown_mask_ids_are_named(resealed: Faults, box_copy: Path) -> None:
    file = box_copy / "box_room/mask/cam00/000002.png"
    write_png(file, np.full((32, 32), 7, np.uint16))
    assert resealed(box_copy) == [f"{file}: ids [7] missing in sequence.json"]


def test_a_wrong_picture_size_and_a_lost_marker_are_named(resealed: Faults, box_copy: Path) -> None:
    file = box_copy / "box_room/mask/cam00/000002.png"
    write_png(file, np.zeros((8, 32), np.uint16))
    marker = box_copy / "box_room/images/done/000001"
    marker.unlink()
    faults = resealed(box_copy)
    assert any(str(file) in fault and "32 x 32" in fault for fault in faults)
    assert any(str(marker) in fault for fault in faults)


Damage = Callable[[np.ndarray], np.ndarray]


@pytest.mark.parametrize(
    ("damage", "word"),
    [
        (lambda csi: csi.conj(), "arrive before"),
        (lambda csi: 4 * csi, "free-space amplitude"),
        (lambda csi: 0 * csi, "silent"),
        (lambda csi: csi[..., ::-1].copy(), "arrive before"),
    ],
)
def test_unphysical_channels_are_named(
    resealed: Faults, box_copy: Path, damage: Damage, word: str
) -> None:
    sequence = open_dataset(box_copy).sequence()
    store = sequence.files.csi("wifi")
    write_csi(
        store, None, damage(sequence.csi_static("wifi")), sequence.files.csi_done("wifi", None)
    )
    faults = resealed(box_copy)
    assert any("csi_static" in fault and word in fault for fault in faults), faults


def test_a_channel_late_by_a_metre_is_named(box_dataset: Path) -> None:
    sequence = open_dataset(box_dataset).sequence()
    delay_s = 2.0 / 299_792_458.0
    late = np.exp(-2j * np.pi * sequence.radio_spec("wifi").freq_hz * delay_s)
    static = (sequence.csi_static("wifi") * late).astype(np.complex64)
    assert any(
        "half a delay cell" in f for f in channel_faults(sequence, "wifi", static[None], Path("x"))
    )


def test_people_missing_from_a_frame_are_noticed(resealed: Faults, box_copy: Path) -> None:
    sequence = open_dataset(box_copy).sequence()
    files = sequence.files
    write_csi(files.csi("wifi"), 1, sequence.csi_static("wifi"), files.csi_done("wifi", 2))
    assert any("frame 2: equals the static channel" in fault for fault in resealed(box_copy))


def test_an_unfinished_dataset_is_a_fault(box_copy: Path, unfinish: Callable[[Path], None]) -> None:
    unfinish(box_copy)
    assert "unfinished" in validate(box_copy)[0]
    write_json(box_copy / "dataset.json", {"schema": "rfgs-dataset/9"})
    assert "newer" in validate(box_copy)[0]


def test_segments_are_blocked_by_triangles_between_their_ends() -> None:
    wall = np.array([[[1.0, -9, -9], [1.0, 9, -9], [1.0, 0, 9]]])
    start = np.zeros(3)
    assert blocked(start, np.array([2.0, 0, 0]), wall)
    assert not blocked(start, np.array([0.9, 0, 0]), wall)
    assert not blocked(start, np.array([-2.0, 0, 0]), wall)
    assert not blocked(start, np.array([0.0, 2.0, 0]), wall)
