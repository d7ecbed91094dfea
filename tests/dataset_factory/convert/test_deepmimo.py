# SPDX-License-Identifier: Apache-2.0
"""What the DeepMIMO package itself reads from a converted dataset."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dataset_factory.convert import convert
from rfgs_core.dataset import open_dataset
from rfgs_core.dataset.path_store import write_paths
from rfgs_core.dataset.schema import read_dataset_info
from rfgs_core.dataset.writer import finish_dataset
from rfgs_core.errors import RfgsError
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.path_table import PathTable, ends_rad


@pytest.fixture
def with_paths(tiny_dataset: Path, tmp_path: Path) -> Path:
    """The tiny dataset with its line of sight, and a mirror in its floor, as paths."""
    path = Path(shutil.copytree(tiny_dataset, tmp_path / "dataset"))
    sequence = open_dataset(path).sequence()
    layout, spec = sequence.layout("wifi"), sequence.radio_spec("wifi")
    centres = [
        np.stack([xyz[site == i].mean(axis=0) for i in range(site.max() + 1)])
        for xyz, site in ((layout.tx_xyz, layout.tx_site), (layout.rx_xyz, layout.rx_site))
    ]
    rows = []
    for a, b in layout.device_pairs:
        start, end = centres[0][a], centres[1][b]
        share = start[2] / (start[2] + end[2])
        floor = (start + share * (end - start)) * [1, 1, 0]
        rows += [(a, b, 0, [start, end, end]), (a, b, 1, [start, floor, end])]
    vertices = np.array([row[3] for row in rows])
    kind = np.array([[row[2]] for row in rows], np.uint8)
    length_m = np.linalg.norm(np.diff(vertices, axis=1), axis=2).sum(axis=1)
    node_hz = np.linspace(spec.freq_min_hz, spec.freq_max_hz, 3)
    friis = SPEED_OF_LIGHT / node_hz / (4 * np.pi * length_m[:, None])
    sites = [np.array([row[i] for row in rows], np.int32) for i in (0, 1)]
    table = PathTable(
        *(sites[0], sites[1], sites[0], sites[1]),
        amplitude=(friis * np.where(kind, -0.5, 1.0))[:, None].astype(np.complex64),
        node_hz=node_hz,
        delay_s=length_m / SPEED_OF_LIGHT,
        doppler_hz=np.zeros(len(rows), np.float32),
        **ends_rad(vertices, kind),
        kind=kind,
        object=kind.astype(np.int32),
        vertices=vertices.astype(np.float32),
    )
    for frame in (None, *sequence.frames):
        write_paths(sequence.files.paths("wifi", frame), table)
    info = read_dataset_info(path / "dataset.json")
    finish_dataset(path, replace(info, has=[*info.has, "paths"]))
    return path


def test_deepmimo_reads_what_was_stored(
    with_paths: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    deepmimo = pytest.importorskip(
        "deepmimo", reason="DeepMIMO is not installed: pip install 'rfgs[dev]'"
    )
    monkeypatch.chdir(tmp_path)
    convert(with_paths, "deepmimo", tmp_path / "deepmimo_scenarios")
    scenes = deepmimo.load("wifi", max_paths=100)
    sequence = open_dataset(with_paths).sequence()
    table, spec = sequence.paths("wifi", 1), sequence.radio_spec("wifi")
    assert len(scenes) == len(sequence.frames)
    stations = scenes[0]
    for tx in range(4):
        station = stations[tx]
        assert station.power.shape == station.delay.shape == (4, 2)
        for rx in range(4):
            rows = table.select((table.tx_site == tx) & (table.rx_site == rx))
            assert np.allclose(station.delay[rx], rows.delay_s, rtol=1e-6)
            level_db = 20 * np.log10(np.abs(rows.amplitude[:, 0, 1]))
            assert np.allclose(station.power[rx], level_db, atol=1e-4)
            assert station.inter[rx].tolist() == [0.0, 1.0]
            assert np.allclose(station.inter_pos[rx, 1, 0], rows.vertices[1, 1], atol=1e-6)
            assert np.allclose(station.tx_pos, rows.vertices[0, 0], atol=1e-6)
            assert np.allclose(station.rx_pos[rx], rows.vertices[0, -1], atol=1e-6)
            angles = {"aoa_el": rows.arrival_zenith_rad, "aod_az": rows.departure_azimuth_rad}
            for name, own in angles.items():
                assert np.allclose(station[name][rx], np.rad2deg(own), atol=1e-3)
            # What the subcarriers add up to, by DeepMIMO's own numbers.
            gain = 10 ** (station.power[rx] / 20) * np.exp(1j * np.deg2rad(station.phase[rx]))
            offset_hz = spec.freq_hz - spec.centre_hz
            late = np.exp(-2j * np.pi * offset_hz * np.float64(station.delay[rx])[:, None])
            exact = rows.amplitude_at(spec.freq_hz)[:, 0] * np.exp(
                -2j * np.pi * spec.freq_hz * rows.delay_s[:, None]
            )
            error = np.abs(gain @ late - exact.sum(axis=0)).max()
            assert error < 0.02 * np.abs(exact).max()


def test_matrices_are_sorted_and_padded(with_paths: Path) -> None:
    from dataset_factory.convert.deepmimo import interactions, matrices

    table = open_dataset(with_paths).sequence().paths("wifi", 1)
    rows = table.select(table.tx_site == 0).select(np.array([1, 0, 3, 2, 5]))
    found = matrices(rows, 5, 5.8e9)
    assert found["power"].shape == (5, 2) and found["inter_pos"].shape == (5, 2, 1, 3)
    assert (np.diff(found["power"][:2], axis=1) < 0).all()
    assert np.isnan(found["power"][2, 1]) and np.isnan(found["delay"][3:]).all()
    kinds = np.array([[0, 0, 0], [1, 4, 0], [1, 16, 1], [2, 8, 0]])
    assert interactions(kinds).tolist() == [0, 14, 131, 32]


def test_the_same_paths_give_the_same_bytes(
    with_paths: Path, tmp_path: Path, data_of: Callable[[Path], dict[str, bytes]]
) -> None:
    for name in ("a", "b"):
        convert(with_paths, "deepmimo", tmp_path / name)
    written = data_of(tmp_path / "a")
    assert written == data_of(tmp_path / "b")
    assert "wifi/params.json" in written


def test_datasets_without_paths_are_refused(tiny_dataset: Path, tmp_path: Path) -> None:
    with pytest.raises(RfgsError, match=r"holds no paths; .* `rfgs-factory generate --paths`"):
        convert(tiny_dataset, "deepmimo", tmp_path / "out")
