# SPDX-License-Identifier: Apache-2.0
"""Every reader gives back the numbers that its format's description says were written."""

from __future__ import annotations

from pathlib import Path

import capture_files as files
import numpy as np
import pytest

from rfgs_core.capture import READERS, detect, read_capture
from rfgs_core.capture.nexmon import unpack_words
from rfgs_core.capture.wifi_grid import INTEL_5300, channel_hz, occupied, pilots
from rfgs_core.errors import RfgsError, RfgsFormatError


@pytest.mark.parametrize("name", files.WRITERS)
def test_a_file_is_told_by_what_it_holds(name: str, tmp_path: Path) -> None:
    file, write = files.WRITERS[name]
    write(tmp_path / file)
    assert detect(tmp_path / file).NAME == name
    reading = read_capture(tmp_path / file)
    assert reading.source == name and all(len(capture) for capture in reading.captures)
    suffixless = tmp_path / "capture"
    if name not in ("matlab", "ti_adc"):
        suffixless.write_bytes((tmp_path / file).read_bytes())
        assert detect(suffixless).NAME == name


def test_all_readers_are_tried() -> None:
    assert set(files.WRITERS) | {"nerf2"} == set(READERS)


def test_intel_antennas_are_those_of_the_card(tmp_path: Path) -> None:
    antennas = files.intel5300_file(tmp_path / "a.dat")
    reading = read_capture(tmp_path / "a.dat")
    capture = reading.largest
    np.testing.assert_array_equal(capture.values[:, 0], antennas)
    assert not reading.warnings and capture.valid.all()
    assert capture.index.tolist() == list(INTEL_5300[20])
    # The clock wraps within the file.
    np.testing.assert_allclose(capture.time_s, 1e-3 * np.arange(6), atol=1e-12)
    assert capture.packets["noise_dbm"].tolist() == [-92.0] * 6
    with pytest.raises(RfgsFormatError, match="centre_hz"):
        _ = capture.freq_hz


def test_two_intel_antennas_stay_at_their_ports(tmp_path: Path) -> None:
    """Ports A and C land in columns 0 and 2, as csiread does; the MATLAB tool leaves the order."""
    chains = files.integers((2, 1, 30), 100)
    record = files.intel5300_record(chains, 0 | 2 << 2, 5)
    (tmp_path / "a.dat").write_bytes(record * 2)
    capture = read_capture(tmp_path / "a.dat").largest
    np.testing.assert_array_equal(capture.values[0, 0, [0, 2]], chains)
    assert not capture.valid[:, 0, 1].any() and not capture.values[:, 0, 1].any()


def test_intel_captures_of_two_widths_are_separated(tmp_path: Path) -> None:
    chains = files.integers((3, 1, 30), 100)
    narrow = files.intel5300_record(chains, 0b100100, 5)
    wide = files.intel5300_record(chains, 0b100100, 9, rate=0x901)
    unclear = files.intel5300_record(chains, 0b000000, 9)
    (tmp_path / "a.dat").write_bytes(narrow * 2 + wide + unclear)
    reading = read_capture(tmp_path / "a.dat")
    assert [len(capture) for capture in reading.captures] == [3, 1]
    assert reading.captures[1].index.tolist() == list(INTEL_5300[40])
    assert reading.warnings == [
        "1 packets with an unclear antenna selection, left in the order of chains"
    ]
    np.testing.assert_array_equal(reading.captures[0].values[2, 0], chains)


def test_feitcsi_pilots_are_interpolated_and_marked(tmp_path: Path) -> None:
    value = files.feitcsi_file(tmp_path / "a.csi")
    capture = read_capture(tmp_path / "a.csi").largest
    index = occupied("HT", 20)
    assert index is not None and capture.index.tolist() == index.tolist()
    measured = ~np.isin(index, pilots("HT", 20))
    assert (capture.valid == measured).all() and measured.sum() == 52
    np.testing.assert_array_equal(capture.values[:, 0][..., measured], value[..., measured])
    assert not np.allclose(capture.values[:, 0][..., ~measured], value[..., ~measured])
    np.testing.assert_allclose(capture.time_s, 0.02 * np.arange(5))
    assert capture.packets["rssi_dbm"].tolist() == [[-47.0, -52.0]] * 5


@pytest.mark.parametrize(("count", "form", "width"), [(498, 3, 3), (2020, 4, 3)])
def test_surplus_samples_of_160_mhz_are_dropped(
    tmp_path: Path, count: int, form: int, width: int
) -> None:
    value = np.arange(1, count + 1)[None, None] + 0j
    (tmp_path / "a.csi").write_bytes(files.feitcsi_record(value, 5, form, width))
    capture = read_capture(tmp_path / "a.csi").largest
    numbers = capture.values[0, 0, 0, 0][capture.valid[0, 0, 0, 0]].real
    assert capture.values.shape[-1] == {498: 484, 2020: 1992}[count]
    gap = {498: range(243, 257), 2020: range(997, 1025)}[count]
    assert not set(numbers.astype(int)) & set(gap) and numbers.max() == count


@pytest.mark.parametrize("basic", [1, 2, 3, 4, 5])
@pytest.mark.parametrize("csi", [1, 2, 3, 4])
def test_picoscenes_versions(tmp_path: Path, basic: int, csi: int) -> None:
    value = files.picoscenes_file(tmp_path / "a.csi", basic, csi)
    reading = read_capture(tmp_path / "a.csi")
    assert [capture.info["format"] for capture in reading.captures] == ["HT", "non-HT"]
    capture = reading.largest
    valid = capture.valid[0, 0, 0, 0]
    np.testing.assert_array_equal(capture.values[:, 0][..., valid], value[..., valid])
    assert capture.centre_hz == 5.5e9
    assert capture.packets["rssi_dbm"].tolist() == [-60.0] * 4
    np.testing.assert_allclose(capture.time_s, 5e-4 * np.arange(4))


def test_newer_picoscenes_versions_are_counted(tmp_path: Path) -> None:
    value = files.integers((2, 1, 56), 300)
    frame = files.picoscenes_frame(files.parts(value, "<i2"), value.shape)
    newer = frame.replace(b"CSI\0\x04\0", b"CSI\0\x09\0")
    assert newer != frame
    (tmp_path / "a.csi").write_bytes(frame + newer)
    reading = read_capture(tmp_path / "a.csi")
    assert len(reading.largest) == 1
    assert "1 packets with a segment CSI of version 9" in reading.warnings
    (tmp_path / "a.csi").write_bytes(newer)
    with pytest.raises(RfgsFormatError, match="segment CSI of version 9"):
        read_capture(tmp_path / "a.csi")


def test_picoscenes_of_qca9300_has_ten_bit_numbers(tmp_path: Path) -> None:
    value = files.integers((2, 1, 56), 500)
    numbers = np.stack([value.imag, value.real], -1).transpose(2, 1, 0, 3).astype(int).ravel()
    bits = [(number & 0x3FF) >> bit & 1 for number in numbers for bit in range(10)]
    payload = np.packbits(np.array(bits, np.uint8), bitorder="little").tobytes()
    frame = files.picoscenes_frame(payload, value.shape, device=0x9300)
    (tmp_path / "a.csi").write_bytes(frame)
    np.testing.assert_array_equal(read_capture(tmp_path / "a.csi").largest.values[0, 0], value)


def test_picoscenes_of_intel_5300_is_unpermuted(tmp_path: Path) -> None:
    value = files.integers((3, 1, 30), 100)
    frame = files.picoscenes_frame(
        files.intel_bits(value[[2, 0, 1]]), value.shape, device=0x5300, selection=0b010010
    )
    (tmp_path / "a.csi").write_bytes(frame)
    capture = read_capture(tmp_path / "a.csi").largest
    np.testing.assert_array_equal(capture.values[0, 0], value)
    assert capture.index.tolist() == list(INTEL_5300[20])


def test_nexmon_cores_share_a_time_and_nulls_are_masked(tmp_path: Path) -> None:
    value = files.nexmon_file(tmp_path / "a.pcap")
    capture = read_capture(tmp_path / "a.pcap").largest
    assert capture.values.shape == (4, 1, 2, 1, 256)
    valid = capture.valid[0, 0, 0, 0]
    np.testing.assert_array_equal(
        capture.values[:, 0, :, 0][..., valid], np.fft.fftshift(value, axes=-1)[..., valid]
    )
    assert capture.index[~valid].tolist() == [*range(-128, -122), *range(-1, 2), *range(123, 128)]
    assert capture.centre_hz == 5e9 + 5e6 * 0x6A and capture.packets["rssi_dbm"][0] == -55
    np.testing.assert_allclose(capture.time_s, 1e-3 * np.arange(4), atol=1e-9)


@pytest.mark.parametrize("chip", ["4358", "4366c0"])
def test_nexmon_floats_agree_with_csiread(tmp_path: Path, chip: str) -> None:
    """csiread keeps ten bits of each frame; the numbers behind them are the same."""
    csiread = pytest.importorskip("csiread")
    mantissa, exponent = {"4358": (9, 5), "4366c0": (12, 6)}[chip]
    generator = np.random.default_rng(3)
    real, imaginary = generator.integers(0, 1 << (mantissa - 1), (2, 256))
    signs, power = generator.integers(0, 2, (2, 256)), generator.integers(-3, 3, 256)
    words = signs[0] << (exponent + 2 * mantissa - 1) | signs[1] << (exponent + mantissa - 1)
    words |= real << (exponent + mantissa) | imaginary << exponent | power & ((1 << exponent) - 1)
    packet = files.nexmon_packet(words, chip=1, where=0, sequence=0, time=0)
    header = bytes.fromhex("d4c3b2a1020004000000000000000000ffff000001000000")
    (tmp_path / "a.pcap").write_bytes(header + 4 * packet)
    theirs = csiread.Nexmon(str(tmp_path / "a.pcap"), chip=chip, bw=80, if_report=False)
    theirs.read()
    ours = unpack_words(words.astype(np.uint32)[None], chip)[0]
    np.testing.assert_array_equal(
        ours,
        (1 - 2 * signs[0]) * real * 2.0**power + 1j * (1 - 2 * signs[1]) * imaginary * 2.0**power,
    )
    scale = np.abs(theirs.csi[0]).max() / np.abs(ours).max()
    assert np.abs(theirs.csi[0] - scale * ours).max() < 3.0


def test_nexmon_integers_agree_with_csiread(tmp_path: Path) -> None:
    csiread = pytest.importorskip("csiread")
    files.nexmon_file(tmp_path / "a.pcap")
    theirs = csiread.Nexmon(str(tmp_path / "a.pcap"), chip="43455c0", bw=80, if_report=False)
    theirs.read()
    capture = read_capture(tmp_path / "a.pcap").largest
    valid = capture.valid[0, 0, 0, 0]
    shifted = np.fft.fftshift(theirs.csi.reshape(4, 2, 256), axes=-1)
    np.testing.assert_array_equal(capture.values[:, 0, :, 0][..., valid], shifted[..., valid])


def test_esp_csi_lines_and_their_training_field(tmp_path: Path) -> None:
    value = files.esp32_file(tmp_path / "a.csv")
    capture = read_capture(tmp_path / "a.csv").largest
    used = occupied("HT", 20)
    assert used is not None
    field = value[:, 64:]
    for number in used:
        column = int(np.flatnonzero(capture.index == number)[0])
        # Subcarriers 0…31, then −32…−1.
        np.testing.assert_array_equal(capture.values[:, 0, 0, 0, column], field[:, number % 64])
    assert capture.index[capture.valid[0, 0, 0, 0]].tolist() == used.tolist()
    assert capture.centre_hz == 2.462e9
    np.testing.assert_allclose(capture.time_s, [0.0, 1e-3, 2e-3])


def test_dw1000_taps_times_and_distances(tmp_path: Path) -> None:
    value = files.dw1000_file(tmp_path / "a.log")
    capture = read_capture(tmp_path / "a.log").largest
    np.testing.assert_array_equal(capture.values[:, 0, 0, 0], value)
    assert capture.axis == "delay" and capture.bins[1] == pytest.approx(1.0016e-9, rel=1e-4)
    assert capture.packets["first_path_tap"].tolist() == [740.5, 741.5, 742.5, 743.5]
    assert np.isnan(capture.packets["distance_m"]).tolist() == [True, False, True, False]
    # The chip's clock wraps after 17.2 s.
    wrap_s = 2**40 / (128 * 499.2e6)
    expected = [0.0, 0.15, wrap_s - 17.0 + 2.1, wrap_s - 17.0 + 3.1]
    np.testing.assert_allclose(capture.time_s, expected, atol=1e-6)


def test_acconeer_points_stand_in_the_order_of_range(tmp_path: Path) -> None:
    value = files.acconeer_file(tmp_path / "a.h5")
    capture = read_capture(tmp_path / "a.h5").largest
    np.testing.assert_allclose(capture.bins, 0.0025 * np.array([10, 20, 30, 40, 50, 60, 70]))
    stored = value.reshape(10, 7)[:, [4, 5, 6, 0, 1, 2, 3]]
    np.testing.assert_array_equal(capture.values[:, 0, 0, 0], stored)
    np.testing.assert_allclose(capture.time_s[:3], [0.0, 0.001, 0.05])
    assert capture.info["profile"] == ["1"] * 3 + ["3"] * 4


def test_newrf_tables_have_places(tmp_path: Path) -> None:
    value = files.newrf_file(tmp_path / "a.mat")
    reading = read_capture(tmp_path / "a.mat")
    capture = reading.largest
    np.testing.assert_array_equal(capture.values.ravel(), value[[0, 2, 3, 4, 5]])
    assert capture.rx_xyz is not None and capture.tx_xyz is not None
    assert capture.rx_xyz[:, 0].tolist() == [0, 2, 3, 4, 5]
    assert capture.tx_xyz[0].tolist() == [1, 2, 3] and capture.centre_hz == 2.412e9
    assert reading.warnings == ["1 receivers that are empty or not finite"]


def test_phase_history_has_a_place_for_each_pulse(tmp_path: Path) -> None:
    value = files.afrl_file(tmp_path / "a.mat")
    capture = read_capture(tmp_path / "a.mat").largest
    np.testing.assert_allclose(capture.values[:, 0, 0, 0], value.T.astype(np.complex64))
    np.testing.assert_allclose(capture.freq_hz, np.linspace(9.2e9, 9.9e9, 8))
    assert capture.tx_xyz is not None and capture.tx_xyz.shape == (5, 3)


def test_ti_samples_are_subcarriers_of_the_chirp(tmp_path: Path) -> None:
    value = files.ti_file(tmp_path / "a.bin")
    capture = read_capture(tmp_path / "a.bin").largest
    expected = np.conj(value).transpose(0, 1, 3, 2, 4).reshape(6, 2, 2, 8)
    np.testing.assert_array_equal(capture.values[:, 0], expected)
    np.testing.assert_allclose(capture.freq_hz, 77e9 + 1.2e7 * np.arange(8))
    np.testing.assert_allclose(capture.time_s[:4], [0, 1.2e-4, 2.4e-4, 0.05])


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("rx: 0\n", "rx: expected receivers, got 0"),
        ("order: qiqi\n", "order: expected iiqq"),
        ("frame_s: 1e-5\n", "frame_s: shorter than"),
        ("samples: 7\n", "samples: expected an even number"),
    ],
)
def test_ti_settings_are_checked(tmp_path: Path, line: str, message: str) -> None:
    files.ti_file(tmp_path / "a.bin")
    settings = tmp_path / "a.yaml"
    name = line.partition(":")[0]
    kept = [row for row in settings.read_text().splitlines() if not row.startswith(f"{name}:")]
    settings.write_text("\n".join([*kept, line]))
    with pytest.raises(RfgsFormatError, match=message):
        read_capture(tmp_path / "a.bin")


def test_a_converted_spectrum_folder_reads_back(tiny_dataset: Path, tmp_path: Path) -> None:
    from dataset_factory.convert import nerf2
    from rfgs_core.dataset import open_dataset
    from rfgs_core.dataset.pictures import read_png_rgba

    sequence = open_dataset(tiny_dataset).sequence()
    nerf2.write(sequence, tmp_path)
    folder = next(iter(sorted((tmp_path / "wifi").iterdir())))
    capture = read_capture(folder).largest
    layout = sequence.layout("wifi")
    count = len(sequence.frames) * len(layout.tx_xyz)
    assert capture.axis == "direction" and len(capture) == count
    assert capture.tx_xyz is not None
    np.testing.assert_allclose(capture.tx_xyz[: len(layout.tx_xyz)], layout.tx_xyz, atol=1e-5)
    picture = read_png_rgba(folder / "spectrum" / "00001.png")[..., 0]
    level = np.round(np.abs(capture.values[0]) ** 2 * 255)
    np.testing.assert_array_equal(level.reshape(90, 360), picture)
    assert capture.packets["test"].sum() == count // 2
    (folder / "spectrum" / "00002.png").write_bytes(b"no picture")
    reading = read_capture(folder)
    assert len(reading.largest) == count - 1 and "1 pictures missing" in reading.warnings[0]


def test_unknown_formats_and_files_are_one_line(tmp_path: Path) -> None:
    with pytest.raises(RfgsError, match="no such file"):
        read_capture(tmp_path / "no.dat")
    with pytest.raises(RfgsError, match="unknown format 'x'"):
        read_capture(tmp_path / "no.dat", "x")
    (tmp_path / "a.xyz").write_bytes(b"hello")
    with pytest.raises(RfgsFormatError, match="no reader knows"):
        read_capture(tmp_path / "a.xyz")
    (tmp_path / "a.txt").write_text("a letter,\nno capture\n")
    told = "2 lines that .*; only the ending of its name told esp32, there are acconeer: .*nerf2: "
    with pytest.raises(RfgsFormatError, match=told):
        read_capture(tmp_path / "a.txt")


@pytest.mark.parametrize(
    ("number", "band", "mhz"),
    [(1, 0, 2412), (14, 0, 2484), (165, 0, 5825), (100, 5, 5500), (1, 6, 5955), (15, 0, 5075)],
)
def test_channels_have_their_frequencies(number: int, band: int, mhz: int) -> None:
    assert channel_hz(number, band) == mhz * 1e6
