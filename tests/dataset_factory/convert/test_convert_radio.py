# SPDX-License-Identifier: Apache-2.0
"""Formats of radio alone: what was converted is read back by their own rules."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import yaml
from PIL import Image
from scipy.io import loadmat
from scipy.spatial.transform import Rotation

from dataset_factory.convert import convert
from dataset_factory.make.impair import impair_dataset
from rfgs_core.dataset import open_dataset
from rfgs_core.dataset.csi_store import write_csi
from rfgs_core.radio.impairments import IMPAIRMENT_PRESETS


def _pixels(file: Path) -> np.ndarray:
    with Image.open(file) as image:
        return np.asarray(image)


def test_nerf2_spectra_point_at_the_transmitter(tiny_copy: Path, tmp_path: Path) -> None:
    sequence = open_dataset(tiny_copy).sequence()
    # Line of sight alone: the strongest direction is then known exactly.
    write_csi(
        sequence.files.csi("wifi"),
        1,
        sequence.csi_static("wifi"),
        sequence.files.csi_done("wifi", 2),
    )
    out = tmp_path / "nerf2"
    convert(tiny_copy, "nerf2", out)
    gateways = sorted((out / "wifi").iterdir())
    assert len(gateways) == 4
    for gateway in gateways:
        info = yaml.safe_load((gateway / "gateway_info.yml").read_text())["gateway1"]
        turn = Rotation.from_quat(info["orientation"]).as_matrix()
        tx = np.genfromtxt(gateway / "tx_pos.csv", delimiter=",", skip_header=1)
        train = np.loadtxt(gateway / "train_index.txt", dtype=str, ndmin=1)
        test = np.loadtxt(gateway / "test_index.txt", dtype=str, ndmin=1)
        assert sorted([*train, *test]) == [f"{k:05d}" for k in range(1, len(tx) + 1)]
        with (gateway / "samples.csv").open() as stream:
            rows = list(csv.DictReader(stream))
        for row, place in zip(rows, tx, strict=True):
            spectrum = _pixels(gateway / "spectrum" / f"{row['name']}.png")
            assert spectrum.shape == (90, 360) and spectrum.max() == 255
            away = turn.T @ (place - info["position"])
            distance_m = np.linalg.norm(away)
            own = distance_m < 0.5
            if int(row["frame"]) != 2 or own or away[2] <= 0:
                continue
            elevation, azimuth = np.unravel_index(spectrum.argmax(), spectrum.shape)
            up, around = np.deg2rad(elevation + 1), np.deg2rad(azimuth + 1)
            peak = [np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)]
            # 2 × 4 elements resolve some 25° and 50°; the peak itself is far better.
            assert np.degrees(np.arccos(np.dot(peak, away / distance_m))) < 8.0, (gateway, row)
            friis_db = 20 * np.log10(299_792_458.0 / 5.8e9 / (4 * np.pi * distance_m))
            assert abs(float(row["strongest_db"]) - friis_db) < 0.3


def test_matlab_files_hold_the_same_numbers(tiny_copy: Path, tmp_path: Path) -> None:
    impair_dataset(tiny_copy, IMPAIRMENT_PRESETS["lab"])
    convert(tiny_copy, "mat", tmp_path / "mat")
    sequence = open_dataset(tiny_copy).sequence()
    value = loadmat(tmp_path / "mat" / "wifi.mat")
    for index, frame in enumerate(sequence.frames):
        assert np.array_equal(value["csi"][index], sequence.csi("wifi", frame))
        impaired = sequence.csi("wifi", frame, impaired=True)
        assert np.array_equal(value["csi_impaired"][index], impaired, equal_nan=True)
        assert np.array_equal(value["joints_m"][index], sequence.joints(frame))
    assert np.array_equal(value["csi_static"][0], sequence.csi_static("wifi"))
    assert np.array_equal(value["freq_hz"].ravel(), sequence.radio_spec("wifi").freq_hz)
    assert np.array_equal(value["rx_xyz"], sequence.layout("wifi").rx_xyz)
    assert value["measured"].astype(bool).all() and "gain_db" in value
    assert value["action"][1, 0].item() == "stand"
    assert value["csi"].dtype == np.complex64
