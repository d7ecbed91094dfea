# SPDX-License-Identifier: Apache-2.0
"""Judges on made-up data whose answer is known, and on captures of others where these are."""

from __future__ import annotations

from pathlib import Path

import capture_files as files
import numpy as np
import pytest
from scipy.io import savemat

from rfgs_core.cli import main
from rfgs_core.files import read_json
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.real import PARTS, aperture, bedroom, radar, ranging, reading, spectra, walking


def write_room(path: Path, receivers: int = 260) -> None:
    """A table of a room whose walls reflect half the field, in MATLAB's structures."""
    generator = np.random.default_rng(1)
    rx = generator.uniform([-2.2, -2.2, 0.1], [2.2, 2.2, 2.9], (receivers, 3))
    tx = np.array([-1.5, 0.2, 2.6])
    wavenumber = 2 * np.pi * 2.412e9 / SPEED_OF_LIGHT
    csi = np.zeros(receivers, complex)
    for wall in (None, *bedroom.WALLS):
        image = tx.copy()
        if wall is not None:
            image[wall[0]] = 2 * wall[1] - image[wall[0]]
        distance = np.linalg.norm(rx - image, axis=1)
        gain = 1.0 if wall is None else -0.6
        csi += gain * np.exp(-1j * wavenumber * distance) / (2 * wavenumber * distance)
    table = np.zeros((receivers, 1), [(n, object) for n in ("TxPos", "RxPos", "Frequency", "CSI")])
    for row in range(receivers):
        table[row, 0] = (tx[:, None], rx[row][:, None], 2.412, csi[row])
    savemat(path, {"subdataset": table})


def test_a_room_is_found_from_channels_and_places_alone(tmp_path: Path) -> None:
    write_room(tmp_path / "room.mat")
    result = bedroom.judge_bedroom(tmp_path / "room.mat")
    # The baseline knows these walls; ours must find them.
    assert float(result["walls_snr_db"]) > 60
    assert float(result["line_of_sight_snr_db"]) < 6
    assert float(result["ours_snr_db"]) > 10


def test_folds_are_blocks_that_cover_everything_once() -> None:
    rx = np.random.default_rng(0).uniform(-1, 1, (500, 3))
    fold = bedroom.folds(rx)
    assert set(fold) == set(range(5))
    assert 60 < np.bincount(fold).min() and np.bincount(fold).max() < 140
    # Receivers above each other are held out together.
    above = rx + np.array([0.0, 0.0, 5.0])
    assert bedroom.folds(np.concatenate([rx, above])).tolist() == [*fold, *fold]


def write_history(path: Path) -> None:
    """Phase history of 30 scatterers, a degree of a circle at 10 km."""
    generator = np.random.default_rng(2)
    angle = np.linspace(-0.006, 0.006, 60)
    places = 10_000 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    points = generator.uniform(-40, 40, (30, 3)) * [1, 1, 0]
    freq = np.linspace(9.3e9, 9.9e9, 128)
    apart = np.linalg.norm(places[:, None] - points, axis=2) - 10_000
    phase = np.exp(-4j * np.pi / SPEED_OF_LIGHT * freq[:, None, None] * apart)
    noise = generator.normal(size=(128, 60, 2)) @ [1, 1j]
    data = {
        "fp": phase.sum(axis=2) + 0.5 * noise,
        "freq": freq[:, None],
        **{axis: places[:, k][None] for k, axis in enumerate("xyz")},
        "r0": np.full((1, 60), 10_000.0),
    }
    savemat(path, {"data": data})


def test_pulses_that_were_not_seen_are_predicted(tmp_path: Path) -> None:
    write_history(tmp_path / "a.mat")
    result = aperture.judge_aperture(tmp_path / "a.mat")
    for held in ("last", "middle", "every_fourth"):
        assert float(result[f"{held}_ours_snr_db"]) > 1.0
    assert float(result["ours_entropy"]) < float(result["backprojection_entropy"])
    assert float(result["ours_contrast"]) > float(result["backprojection_contrast"])


def test_the_adjoint_is_the_adjoint(tmp_path: Path) -> None:
    from rfgs_core.capture import read_capture

    write_history(tmp_path / "a.mat")
    capture = read_capture(tmp_path / "a.mat").largest
    seen = aperture._Aperture.of(capture)
    generator = np.random.default_rng(3)
    picture = (generator.normal(size=(512, 168, 2)) @ [1, 1j]).astype(np.complex64)
    pulses = np.arange(0, 60, 2)
    data = (generator.normal(size=(30, 128, 2)) @ [1, 1j]).astype(np.complex64)
    there = np.vdot(data, seen.see(picture, pulses))
    back = np.vdot(seen.project(data, pulses), picture)
    assert abs(there - back) < 1e-3 * abs(there)


def write_log(path: Path, distance_m: float) -> None:
    """Receptions whose first pulse begins at tap 748, and the module's distances 0.3 m too long."""
    taps = np.arange(1016)
    rows = ["DecaRanging", "Mode: 2, Chan 2, Code 9, PRF 64, Plength 1024"]
    generator = np.random.default_rng(4)
    for time in range(6):
        pulse = 8000 * np.exp(-(((taps - 750) / 1.2) ** 2))
        response = pulse * np.exp(1j * time) + generator.normal(size=(1016, 2)) @ [30, 30j]
        rows += [f"Rx time = {0.2 * time:.6e} 00", ""]
        rows.append("RX OK WInd(0735), HLP(0749.0000), PSC(0429), RSL(-81.0), FSL(-86.0)")
        rows.append("Accum Len 1016")
        rows += [f"{int(tap.real)}, {int(tap.imag)}" for tap in response]
        if time % 2:
            rows.append(f"Anchor ToF: 8.8 ns Dist: {distance_m + 0.3:.6f} m DistRaw: 2.5 m")
    path.write_text("\n".join(rows))
    for name, line in (("pairs", "6,1,2"), ("anchors", "1,0,0"), ("tags", f"2,0,{distance_m}")):
        path.with_name(f"{name}.csv").write_text(f"head\n{line}\n")


def test_first_paths_shift_the_distance(tmp_path: Path) -> None:
    write_log(tmp_path / "6.log", 4.0)
    result = ranging.judge_ranging(tmp_path / "6.log")
    assert result["surveyed_m"] == 4.0 and result["exchanges"] == 3
    assert result["module_error_m"] == pytest.approx(0.3, abs=1e-4)
    # Half height lies at 750 − 1.2 √ln 2 = 749.0, where the module has it.
    assert result["half_height_error_m"] == pytest.approx(0.3, abs=0.02)
    assert float(result["ours_error_m"]) < 0.2


def test_places_beside_a_log_are_needed(tmp_path: Path, capsys) -> None:
    write_log(tmp_path / "6.log", 4.0)
    (tmp_path / "tags.csv").unlink()
    (tmp_path / "uwb").mkdir()
    for file in tmp_path.glob("*.*"):
        file.rename(tmp_path / "uwb" / file.name)
    assert main(["bench", "real", "--data", str(tmp_path)]) == 2
    assert "tells surveyed places" in capsys.readouterr().err


def test_breathing_and_reflectors_of_a_radar(tmp_path: Path) -> None:
    import json

    h5py = pytest.importorskip("h5py")
    time_s = np.arange(240) / 12.0
    points = np.arange(8)
    still = 900 * np.exp(1j * points)
    chest = 700 * np.exp(1j * 1.2 * np.sin(2 * np.pi * 0.25 * time_s))[:, None]
    value = still + chest * np.exp(-(((points - 4.3) / 1.2) ** 2))
    value = np.repeat(value[:, None], 2, axis=1)
    stored = np.zeros(value.shape, [("real", "<i2"), ("imag", "<i2")])
    stored["real"], stored["imag"] = value.real, value.imag
    row = {"start_point": 100, "num_points": 8, "step_length": 4, "profile": "PROFILE_1"}
    sensor = {"frame_rate": 12.0, "sweep_rate": 1000.0, "subsweeps": [row]}
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["sessions/session_0/session_config"] = json.dumps({"groups": [{"1": sensor}]})
        entry = file.create_group("sessions/session_0/group_0/entry_0")
        entry["metadata"] = json.dumps({"base_step_length_m": 0.0025})
        entry["result/frame"] = stored
    result = radar.judge_breathing(tmp_path / "a.h5")
    assert result["ours_breaths_per_min"] == pytest.approx(15.0, abs=0.7)
    assert float(result["ours_halves_differ_per_min"]) < 1.5
    found = radar.judge_reflector(tmp_path / "a.h5")
    assert found["step_m"] == pytest.approx(0.01)


def test_walking_stands_out_of_shuffled_packets(tmp_path: Path) -> None:
    time_s = np.arange(800) / 100.0
    index = np.arange(30)
    echo = 20 * np.exp(2j * np.pi * 1.5 / 0.123 * time_s)[:, None, None]
    antenna = np.exp(1j * np.array([0.2, 1.5, -1.0]))[:, None]
    generator = np.random.default_rng(6)
    turns = 1j ** generator.integers(0, 4, (800, 3, 1))
    noise = generator.normal(size=(800, 3, 30, 2)) @ [1, 1j]
    value = (60 * antenna + echo * antenna**2 * np.exp(0.1j * index) + noise) * turns
    value *= np.exp(1j * generator.uniform(-3, 3, (800, 1, 1)))
    records = [
        files.intel5300_record(np.round(row)[:, None], 0b100100, 10_000 * k)
        for k, row in enumerate(value)
    ]
    (tmp_path / "a.dat").write_bytes(b"".join(records))
    result = walking.judge_walking(tmp_path / "a.dat")
    assert float(result["ours_share"]) > 0.9 > float(result["shuffled_share"]) + 0.2
    assert result["ours_median_m_s"] == pytest.approx(1.5, abs=0.2)


def write_spectra(folder: Path, count: int = 60) -> None:
    """Pictures of one lobe that follows the transmitter across the room."""
    from PIL import Image

    generator = np.random.default_rng(7)
    places = generator.uniform([-2, -2, 1], [2, 2, 1.2], (count, 3))
    row, column = np.mgrid[0:90, 0:360]
    (folder / "spectrum").mkdir(parents=True)
    for number, (x, y, _) in enumerate(places):
        lobe = np.exp(-(((row - 45 - 8 * y) / 15) ** 2) - ((column - 180 - 40 * x) / 40) ** 2)
        picture = Image.fromarray(np.round(255 * lobe).astype(np.uint8))
        picture.save(folder / "spectrum" / f"{number + 1:05d}.png")
    lines = "".join(f"{x:.6f},{y:.6f},{z:.6f}\n" for x, y, z in places)
    (folder / "tx_pos.csv").write_text(f"x,y,z\n{lines}")
    (folder / "test_index.txt").write_text("".join(f"{k:05d}\n" for k in range(1, count, 5)))
    gateway = "gateway1:\n  position: [0, 0, 0]\n  orientation: [0, 0, 0, 1]\n"
    (folder / "gateway_info.yml").write_text(gateway)


def test_spectra_are_judged_on_blocks_and_beside_the_random_split(tmp_path: Path) -> None:
    write_spectra(tmp_path)
    result = {name: float(value) for name, value in spectra.judge_spectra(tmp_path).items()}
    assert result["ours_ssim"] > result["nearest_ssim"] > result["mean_picture_ssim"]
    # Neighbours of a random split are nearer than any block allows.
    assert result["nearest_random_ssim"] > result["nearest_ssim"]


def test_the_readers_are_timed(monkeypatch) -> None:
    monkeypatch.setattr(reading, "INTEL_PACKETS", 200)
    monkeypatch.setattr(reading, "FEITCSI_PACKETS", 40)
    result = reading.bench_readers()
    assert float(result["intel5300_mb_s"]) > 1 and float(result["feitcsi_mb_s"]) > 1
    assert ("intel5300_over_csiread" in result) != ("csiread" in result)


def test_bench_real_needs_a_folder_with_something_in_it(tmp_path: Path, capsys) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(["bench", "real"])
    assert "--data" in capsys.readouterr().err
    assert main(["bench", "real", "--data", str(tmp_path)]) == 2
    err = capsys.readouterr().err
    assert err.count("skipped") == len(PARTS) and "expected some of newrf" in err
    asked = err.rpartition("expected some of ")[2].split(", ")
    assert len(asked) == len(set(asked)) == len(set(PARTS.values()))


@pytest.mark.slow
def test_captures_of_others_are_explained_better_than_by_the_baselines(tmp_path: Path) -> None:
    """Targets: bedroom 6.75 dB, held-out pulses 0.6 dB, first path nearer than the module's."""
    files.shared(PARTS["bedroom"])
    out = tmp_path / "real.json"
    assert main(["bench", "real", "--data", str(files.SHARED), "--json", str(out)]) == 0
    result = read_json(out)
    assert result["bedroom_ours_snr_db"] > max(6.75, result["bedroom_walls_snr_db"])
    for held in ("last", "middle", "every_fourth"):
        ours = result[f"aperture_{held}_ours_snr_db"]
        assert ours > max(0.6, result[f"aperture_{held}_omp_snr_db"])
    assert result["aperture_ours_entropy"] < result["aperture_backprojection_entropy"]
    assert result["aperture_ours_contrast"] > result["aperture_backprojection_contrast"]
    assert result["ranging_ours_error_m"] < result["ranging_module_error_m"]
    assert result["walking_ours_share"] > result["walking_shuffled_share"]
