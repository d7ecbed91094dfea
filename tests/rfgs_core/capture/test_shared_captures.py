# SPDX-License-Identifier: Apache-2.0
"""Captures that others made: every file reads, and its values are those of another reader."""

from __future__ import annotations

import struct
from pathlib import Path

import capture_files as files
import numpy as np
import pytest

from dataset_factory.check.validate import validate
from rfgs_core import sanitize
from rfgs_core.capture import read_capture
from rfgs_core.capture.wifi_grid import pilots
from rfgs_core.cli import main
from rfgs_core.dataset import open_dataset

#: File → reader, shapes of its captures.
HELD = {
    "intel5300/sample_0x5_64_3000.dat": ("intel5300", [(2998, 1, 3, 1, 30)]),
    "intel5300/walk_post_1597163546.dat": ("intel5300", [(793, 1, 3, 2, 30)]),
    "feitcsi/HESU160_5500.csi": ("feitcsi", [(26, 1, 2, 1, 1992)]),
    "feitcsi/VHT80_5500.csi": ("feitcsi", [(40, 1, 2, 1, 242)]),
    "picoscenes/ax200_rx_8_211119_171706.csi": (
        "picoscenes",
        [(256, 1, 2, 1, 52), (177, 1, 2, 1, 56)],
    ),
    "esp32/example_csi.csv": ("esp32", [(12, 1, 1, 1, 64), (1, 1, 1, 1, 64)]),
    "acconeer/acconeer_a121_corner-reflector.h5": ("acconeer", [(113, 1, 1, 1, 74)]),
    "acconeer/acconeer_a121_presence-medium_range_no_timeout.h5": (
        "acconeer",
        [(3008, 1, 1, 1, 11)],
    ),
    "uwb/6.log": ("dw1000", [(108, 1, 1, 1, 1016)]),
    "newrf/dataset_bedroom.mat": ("matlab", [(872, 1, 1, 1, 1)]),
    "sar/data_3dsar_pass1_az001_HH.mat": ("matlab", [(117, 1, 1, 1, 424)]),
}
INTEL = [name for name in HELD if name.startswith("intel5300")]
FEITCSI = [name for name in HELD if name.startswith("feitcsi")]


@pytest.mark.parametrize("name", HELD)
def test_every_capture_reads(name: str) -> None:
    reading = read_capture(files.shared(name))
    source, shapes = HELD[name]
    assert reading.source == source
    assert [capture.values.shape for capture in reading.captures] == shapes


@pytest.mark.parametrize("name", INTEL)
def test_intel_values_are_those_of_csiread(name: str) -> None:
    csiread = pytest.importorskip("csiread")
    path = files.shared(name)
    capture = read_capture(path).largest
    theirs = csiread.Intel(str(path), nrxnum=3, ntxnum=capture.values.shape[3], if_report=False)
    theirs.read()
    np.testing.assert_array_equal(capture.values[:, 0], theirs.csi.transpose(0, 2, 3, 1))
    np.testing.assert_array_equal(capture.packets["timestamp_us"], theirs.timestamp_low)
    np.testing.assert_array_equal(capture.packets["agc_db"], theirs.agc)
    np.testing.assert_array_equal(capture.packets["rssi_db"][:, 2], theirs.rssi_c)


@pytest.mark.parametrize("name", FEITCSI)
def test_feitcsi_records_decoded_by_hand(name: str) -> None:
    path = files.shared(name)
    data, at = path.read_bytes(), 0
    capture = read_capture(path).largest
    valid = capture.valid[0, 0, 0, 0]
    for row in range(5):
        size = struct.unpack_from("<I", data, at)[0]
        count = struct.unpack_from("<I", data, at + 52)[0]
        numbers = struct.unpack_from(f"<{size // 2}h", data, at + 272)
        value = np.array(numbers[::2]) + 1j * np.array(numbers[1::2])
        value = value.reshape(2, 1, count)
        np.testing.assert_array_equal(capture.values[row, 0][..., valid], value[..., valid])
        clock = struct.unpack_from("<I", data, at + 88)[0]
        assert capture.packets["clock_us"][row] == clock
        at += 272 + size
    form, width = capture.info["format"], capture.info["bandwidth_mhz"]
    assert capture.index[~valid].tolist() == pilots(form, width).tolist()
    # Pilots come out near zero; filled, they are as strong as their neighbours.
    assert np.abs(capture.values[:, 0, :, 0][..., ~valid]).min() > 5


def test_picoscenes_values_are_those_of_csiread() -> None:
    """csiread leaves four values of each link out, not always the pilots; the others agree."""
    csiread = pytest.importorskip("csiread")
    path = files.shared("picoscenes/ax200_rx_8_211119_171706.csi")
    none = {name: [0, 0, 0] for name in ("PilotCSI", "LegacyCSI", "BasebandSignals")}
    sizes = {"CSI": [56, 2, 1], **none, "PreEQSymbols": [0, 0, 0], "MPDU": 0}
    theirs = csiread.Picoscenes(str(path), sizes, if_report=False)
    theirs.read()
    csi, counts = theirs.raw["CSI"]["CSI"], theirs.raw["CSI"]["Info"]["NumTones"]
    for capture in read_capture(path).captures:
        rows = csi[counts == capture.values.shape[-1]]
        assert len(rows) == len(capture)
        valid = capture.valid[0, 0, 0, 0]
        for packet in range(0, len(rows), 20):
            for rx in range(2):
                known = set(rows[packet, :, rx, 0].tolist())
                ours = capture.values[packet, 0, rx, 0][valid].astype(np.complex128)
                assert np.mean([value in known for value in ours.tolist()]) > 0.9


def test_esp32_lines_read_by_hand() -> None:
    path = files.shared("esp32/example_csi.csv")
    capture = read_capture(path).largest
    line = path.read_text().splitlines()[0]
    numbers = np.array(line[line.index("[") + 1 : line.index("]")].split(), float)
    value = numbers[1::2] + 1j * numbers[::2]
    valid = capture.valid[0, 0, 0, 0]
    np.testing.assert_array_equal(capture.values[0, 0, 0, 0][valid], value[valid])
    # A second channel above: the packet's own one lies 10 MHz below the middle of both.
    assert capture.index[valid].tolist() == [*range(-58, -32), *range(-31, -5)]
    assert np.abs(value[~valid][2:]).max() < 15


def test_dw1000_first_paths_peaks_and_taps() -> None:
    reading = read_capture(files.shared("uwb/6.log"))
    capture = reading.largest
    assert reading.warnings == ["25 receptions that the chip rejected"]
    assert capture.values[0, 0, 0, 0, :3].tolist() == [-44 + 23j, 121 - 28j, 190 + 38j]
    assert capture.packets["first_path_tap"].mean() == pytest.approx(747.8, abs=0.1)
    assert np.nanmean(capture.packets["distance_m"]) == pytest.approx(2.676, abs=1e-3)
    assert capture.time_s[-1] == pytest.approx(54.7, abs=0.1)


def test_acconeer_frames_are_those_of_h5py() -> None:
    h5py = pytest.importorskip("h5py")
    path = files.shared("acconeer/acconeer_a121_presence-medium_range_no_timeout.h5")
    with h5py.File(path) as file:
        stored = file["sessions/session_0/group_0/entry_0/result/frame"][()]
    capture = read_capture(path).largest
    value = stored["real"] + 1j * stored["imag"]
    np.testing.assert_array_equal(capture.values[:, 0, 0, 0], value.reshape(-1, 11))
    assert capture.time_s[-1] == pytest.approx(15.59, abs=0.01)


def test_matlab_tables_are_those_of_scipy() -> None:
    from scipy.io import loadmat

    bedroom = files.shared("newrf/dataset_bedroom.mat")
    capture = read_capture(bedroom).largest
    row = loadmat(bedroom)["subdataset"][0, 0]
    assert capture.values[0, 0, 0, 0, 0] == np.complex64(row["CSI"][0, 0])
    assert capture.rx_xyz is not None
    np.testing.assert_array_equal(capture.rx_xyz[0], row["RxPos"].ravel())
    history = files.shared("sar/data_3dsar_pass1_az001_HH.mat")
    pulses = loadmat(history)["data"]["fp"][0, 0]
    np.testing.assert_array_equal(read_capture(history).largest.values[:, 0, 0, 0], pulses.T)


def test_antennas_of_an_intel_5300_hold_their_phases_once_cleaned() -> None:
    """Raw phases are useless; quarter turns and one slope per packet bring them together."""
    from rfgs_core.capture.cleaned import coherence, steps

    capture = read_capture(files.shared("intel5300/walk_post_1597163546.dat")).largest
    assert coherence(capture) < 0.05
    *_, last = steps(capture)
    assert coherence(last.capture) > 0.99
    used = capture.values[:, 0][:, [0, 2]]
    turned = sanitize.undo_quarter_turns(used)[0]
    for values, low, high in ((used, 0.0, 0.1), (turned, 0.99, 1.0)):
        phase = np.exp(1j * np.angle(values[:, 1] * np.conj(values[:, 0])))
        assert low <= np.abs((phase[1:] * np.conj(phase[:-1])).mean()) <= high


LAYOUT = """centre_hz: 5.5e9
devices:
  - {name: tx, role: TRANSMITTER, position_m: [0, 0, 1]}
  - {name: rx, role: RECEIVER, position_m: [3, 0, 1]}
"""


@pytest.mark.parametrize("name", HELD)
def test_every_capture_becomes_a_sound_dataset(name: str, tmp_path: Path) -> None:
    path = files.shared(name)
    arguments = ["import", str(path), "--out", str(tmp_path / "out")]
    if not name.endswith(".mat"):
        radar = "devices: [{name: radar, position_m: [0, 0, 1]}]\n"
        text = radar if name.startswith("acconeer") else LAYOUT
        (tmp_path / "radios.yaml").write_text(text)
        arguments += ["--layout", str(tmp_path / "radios.yaml")]
    assert main(arguments) == 0
    assert validate(tmp_path / "out") == []
    sequence = open_dataset(tmp_path / "out").sequence()
    (radio,) = sequence.radios
    with np.load(sequence.files.csi(radio).with_name("capture.npz")) as kept:
        scale, packet = float(kept["scale"]), kept.get("packet")
        place = kept.get("subcarrier_of_bin", np.zeros(0, int))
    capture = read_capture(path).largest
    if packet is None or not len(place):
        return  # Tables, apertures and transforms are compared elsewhere.
    csi = sequence.csi_samples(radio, sequence.frames[-1]) / scale
    heard = np.flatnonzero(capture.valid[:, 0].any(axis=(0, 2, 3)))
    expected = capture.values[packet[0, -1], 0][:, heard].swapaxes(1, 2)
    valid = capture.valid[packet[0, -1], 0][:, heard].swapaxes(1, 2)
    np.testing.assert_array_equal(csi[..., place][valid], expected[valid])
