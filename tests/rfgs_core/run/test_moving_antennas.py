# SPDX-License-Identifier: Apache-2.0
"""An antenna that goes from place to place is trained on as one array of all its places."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
import tiny_dataset as tiny

from rfgs_core.cli import main
from rfgs_core.dataset import Sequence, open_dataset
from rfgs_core.dataset.aperture import whole_csi, whole_layout, whole_static
from rfgs_core.dataset.csi_store import create_csi, write_csi
from rfgs_core.dataset.mesh_ply import write_mesh
from rfgs_core.dataset.names import SequenceFiles
from rfgs_core.dataset.schema import PERSON_SURFACE_M2, DatasetInfo, SequenceInfo
from rfgs_core.dataset.splits import radio_split
from rfgs_core.dataset.writer import finish_dataset, write_arrays, write_sequence_info
from rfgs_core.files import read_json
from rfgs_core.radio import Radio, frame_samples, layout, place_devices
from rfgs_core.radio.constants import SPEED_OF_LIGHT

PLACES = 12
RADIO = Radio(
    name="ring",
    freq_min_hz=8e9,
    freq_max_hz=12e9,
    num_subcarriers=48,
    tx_rows=1,
    tx_cols=1,
    rx_rows=1,
    rx_cols=1,
    tx_offset_m=(0.0, 0.1, 0.0),
    own_device_links="only",
    placement="circle",
    num_devices=1,
    samples_per_frame=PLACES,
    antennas_move=True,
)
DEVICES = place_devices(RADIO, tiny.BOUNDS_M)


def channels(frame: int | None) -> np.ndarray:
    """The antennas' coupling and the sphere's vertices, (place, 1, 1, subcarrier)."""
    wavenumber = 2 * np.pi * RADIO.freq_hz / SPEED_OF_LIGHT
    rows = []
    for place in range(PLACES):
        at = layout(RADIO, DEVICES, place)
        distance = np.linalg.norm(at.tx_xyz[0] - at.rx_xyz[0])
        total = np.exp(-1j * wavenumber * distance) / (2 * wavenumber * distance)
        if frame is not None:
            points = tiny.centre_m(frame) + tiny.RADIUS_M * tiny.sphere()[0]
            out = np.linalg.norm(at.tx_xyz[0] - points, axis=1)
            back = np.linalg.norm(at.rx_xyz[0] - points, axis=1)
            echo = np.exp(-1j * wavenumber[:, None] * (out + back)) / (out * back)
            total = total + 0.01 / wavenumber * echo.sum(axis=1)
        rows.append(total[None, None])
    return np.stack(rows).astype(np.complex64)


@pytest.fixture(scope="module")
def ring(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The tiny scene, seen from a circle."""
    root = tmp_path_factory.mktemp("ring") / "dataset"
    files, elements = SequenceFiles(root / "tiny"), layout(RADIO, DEVICES)
    times_s = [(frame - 1) / tiny.FPS for frame in tiny.FRAMES]
    store, samples = files.csi("ring"), frame_samples(RADIO, tiny.FPS, DEVICES)
    create_csi(store, RADIO, elements, tiny.FRAMES, times_s, samples)
    write_csi(store, None, channels(None), files.csi_done("ring", None))
    unit, faces = tiny.sphere()
    write_arrays(files.topology, faces=faces, instance=np.ones(len(faces), np.int32))
    write_mesh(files.static_mesh, *tiny.box())
    for index, frame in enumerate(tiny.FRAMES):
        write_csi(store, index, channels(frame), files.csi_done("ring", frame))
        write_arrays(
            files.geometry(frame),
            vertices=(tiny.centre_m(frame) + tiny.RADIUS_M * unit).astype(np.float32),
            joints=np.full((1, 17, 3), np.nan, np.float32),
            segment_velocity=np.zeros((1, 17, 3), np.float32),
            person_instance=np.array([1], np.int32),
            action=np.array(["stand"]),
        )
    person = {"id": 1, "name": "ball", "class": "person"}
    info = SequenceInfo(
        scene="tiny",
        blend_sha256="0" * 64,
        frames=tiny.FRAMES,
        frame_start=1,
        fps=tiny.FPS,
        bounds_m=tiny.BOUNDS_M.tolist(),
        cameras=[],
        devices={"ring": [asdict(device) for device in DEVICES]},
        radios={"ring": asdict(RADIO)},
        splits={
            "rf": {"ring": radio_split(RADIO, elements, 0)},
            "images": {"test_cameras": [], "test_frames": []},
        },
        instances=[{**person, "nominal_surface_m2": PERSON_SURFACE_M2}],
    )
    write_sequence_info(files, info)
    has = ["csi", "csi_static", "geometry"]
    finish_dataset(root, DatasetInfo({"rfgs": "test"}, {}, 0, has, ["tiny"]))
    return root


@pytest.fixture
def sequence(ring: Path) -> Sequence:
    """Its only sequence."""
    return open_dataset(ring).sequence()


def test_places_are_elements_with_links_of_their_own(sequence: Sequence) -> None:
    whole = whole_layout(sequence, "ring")
    np.testing.assert_array_equal(whole.measured, np.eye(PLACES, dtype=bool))
    assert not whole.tx_device.any() and len(np.unique(whole.rx_site)) == PLACES
    apart = whole_layout(sequence, "ring", coherent=False)
    assert apart.tx_device.tolist() == apart.rx_device.tolist() == list(range(PLACES))
    for place in range(PLACES):
        expected = sequence.layout("ring", place)
        np.testing.assert_array_equal(whole.tx_xyz[place], expected.tx_xyz[0])
        np.testing.assert_array_equal(whole.rx_quat_wxyz[place], expected.rx_quat_wxyz[0])


def test_channels_stand_on_the_diagonal(sequence: Sequence) -> None:
    for whole, samples in (
        (whole_csi(sequence, "ring", 2), channels(2)),
        (whole_static(sequence, "ring"), channels(None)),
    ):
        assert whole.shape == (PLACES, PLACES, 48)
        np.testing.assert_array_equal(whole[np.arange(PLACES), np.arange(PLACES)], samples[:, 0, 0])
        assert not whole[~np.eye(PLACES, dtype=bool)].any()


def test_antennas_that_stand_still_are_what_they_were(tiny_dataset: Path) -> None:
    still = open_dataset(tiny_dataset).sequence()
    np.testing.assert_array_equal(whole_csi(still, "wifi", 1), still.csi("wifi", 1))
    np.testing.assert_array_equal(whole_static(still, "wifi"), still.csi_static("wifi"))
    measured = still.layout("wifi").measured
    np.testing.assert_array_equal(whole_layout(still, "wifi").measured, measured)


def test_it_trains_and_is_evaluated(ring: Path, tmp_path: Path) -> None:
    run = tmp_path / "run"
    train = ["train", str(ring), "--radio", "ring", "--out", str(run), "--frames", "1"]
    few = ["--gaussians", "150", "--iterations", "10", "--posture", "standing", "--no-shader"]
    assert main([*train, *few]) == 0
    assert main(["eval", str(run), "--no-oracle"]) == 0
    (frame,) = read_json(run / "metrics.json")["frames"]
    assert frame["geometry"]["tracked"] and frame["rf"]["subcarrier_snr_db"] > 3.0
