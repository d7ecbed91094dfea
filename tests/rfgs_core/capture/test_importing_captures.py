# SPDX-License-Identifier: Apache-2.0
"""Captures become datasets that open, hold what was received, and say what was guessed."""

from __future__ import annotations

from pathlib import Path

import capture_files as files
import numpy as np
import pytest

from dataset_factory.check.validate import validate
from rfgs_core.capture import read_capture
from rfgs_core.capture.wifi_grid import occupied
from rfgs_core.cli import main
from rfgs_core.dataset import Sequence, open_dataset
from rfgs_core.dataset.splits import HeldOut

PAIR = """centre_hz: 5.825e9
name: lab
radio: wifi
devices:
  - {name: tx, role: TRANSMITTER, position_m: [0, 0, 1], quat_wxyz: [1, 0, 0, 0]}
  - {name: rx, role: RECEIVER, position_m: [3, 0, 1]}
"""
THIRD = "  - {name: third, role: TRANSMITTER, position_m: [0, 3, 1]}"
RADAR = "name: lab\nradio: radar\ndevices: [{name: radar, position_m: [0, 0, 1]}]\n"
TWO = (
    PAIR + "  - {name: rx2, role: RECEIVER, position_m: [0, 3, 1], file: b.dat, offset_s: 0.002}\n"
)


def imported(
    tmp_path: Path, *captures: Path, layout: str | None = PAIR, extra: tuple = ()
) -> Sequence:
    """The sequence that `rfgs import` makes; the dataset is sound."""
    arguments = ["import", *map(str, captures), "--out", str(tmp_path / "out"), *extra]
    if layout is not None:
        (tmp_path / "radios.yaml").write_text(layout)
        arguments += ["--layout", str(tmp_path / "radios.yaml")]
    assert main(arguments) == 0
    assert validate(tmp_path / "out") == []
    return open_dataset(tmp_path / "out").sequence()


def beside(sequence: Sequence, radio: str) -> dict[str, np.ndarray]:
    """What is kept beside the channels."""
    with np.load(sequence.files.csi(radio).with_name("capture.npz")) as stored:
        return dict(stored)


def refused(arguments: list[str], capsys) -> str:
    """The only line of a command that fails."""
    assert main(arguments) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1, lines
    return lines[0]


def test_a_rotation_of_any_length_is_the_same_rotation(tmp_path: Path) -> None:
    """(1, 0, 0, 1) is a quarter turn; taken as it stands it would stretch the array to twice."""
    files.intel5300_file(tmp_path / "a.dat", packets=300)
    turned = PAIR.replace("position_m: [3, 0, 1]", "position_m: [3, 0, 1], quat_wxyz: [1, 0, 0, 1]")
    sequence = imported(tmp_path, tmp_path / "a.dat", layout=turned)
    receiver = next(row for row in sequence.devices("wifi") if row.name == "rx")
    np.testing.assert_allclose(receiver.quat_wxyz, [0.5**0.5, 0.0, 0.0, 0.5**0.5])
    np.testing.assert_allclose(
        sequence.coordinates("wifi")["rx_quat_wxyz"][0], [0.5**0.5, 0.0, 0.0, 0.5**0.5]
    )


def test_intel_packets_survive_to_the_bit(tmp_path: Path) -> None:
    antennas = files.intel5300_file(tmp_path / "a.dat", packets=300)
    sequence = imported(tmp_path, tmp_path / "a.dat")
    kept = beside(sequence, "wifi")
    assert sequence.frames == [1, 2, 3] and sequence.fps == 10.0
    radio = sequence.radio_spec("wifi")
    assert (radio.num_subcarriers, radio.rx_cols, radio.samples_per_frame) == (57, 3, 100)
    np.testing.assert_allclose(radio.freq_hz, 5.825e9 + 312_500.0 * np.arange(-28, 29))
    for index, frame in enumerate(sequence.frames):
        csi = sequence.csi_samples("wifi", frame) / kept["scale"]
        got = csi[:, 0][..., kept["subcarrier_of_bin"]]
        np.testing.assert_array_equal(got, antennas[100 * index : 100 * index + 100, :, 0])
    static = sequence.csi_static("wifi") / kept["scale"]
    measured = kept["measured_subcarriers"]
    np.testing.assert_allclose(static[0][:, measured], antennas[:, :, 0].mean(axis=0), rtol=1e-5)
    guesses = {row["what"] for row in sequence.info.guesses}
    assert guesses == {"orientation", "level", "csi_static", "bounds"}


def test_filled_subcarriers_are_neither_seen_nor_judged(tmp_path: Path) -> None:
    files.intel5300_file(tmp_path / "a.dat", packets=100)
    sequence = imported(tmp_path, tmp_path / "a.dat")
    layout = sequence.layout("wifi")
    held = HeldOut.of(sequence.splits["rf"]["wifi"], layout, 57)
    measured = beside(sequence, "wifi")["measured_subcarriers"]
    assert measured.sum() == 30
    assert not held.subcarriers[~measured].any()
    assert not held.subcarrier[..., ~measured].any() and held.subcarrier[..., measured].any()


def test_two_receivers_share_a_clock(tmp_path: Path) -> None:
    one = files.intel5300_file(tmp_path / "a.dat", packets=200)
    files.intel5300_file(tmp_path / "b.dat", packets=200)
    sequence = imported(tmp_path, tmp_path / "b.dat", tmp_path / "a.dat", layout=TWO)
    kept = beside(sequence, "wifi")
    # Named files go to their device; its clock begins 2 ms later.
    assert kept["packet"][0, 0, 0] == 2 and kept["packet"][1, 0, 0] == 0
    csi = sequence.csi_samples("wifi", 1) / kept["scale"]
    assert csi.shape == (100, 1, 6, 57)
    np.testing.assert_array_equal(csi[0, 0, :3, 0], one[2, :, 0, 0])
    np.testing.assert_array_equal(csi[0, 0, 3:, 0], one[0, :, 0, 0])


def test_a_capture_of_the_empty_room_is_the_static_channel(tmp_path: Path) -> None:
    files.intel5300_file(tmp_path / "a.dat", packets=100)
    empty = files.intel5300_file(tmp_path / "e.dat", packets=30)
    extra = ("--empty", str(tmp_path / "e.dat"))
    sequence = imported(tmp_path, tmp_path / "a.dat", extra=extra)
    kept = beside(sequence, "wifi")
    static = sequence.csi_static("wifi")[0][:, kept["measured_subcarriers"]] / kept["scale"]
    np.testing.assert_allclose(static, empty[:, :, 0].mean(axis=0), rtol=1e-5)
    assert "csi_static" not in {row["what"] for row in sequence.info.guesses}


def test_impulse_responses_become_subcarriers_and_back(tmp_path: Path) -> None:
    taps = files.dw1000_file(tmp_path / "a.log")
    sequence = imported(tmp_path, tmp_path / "a.log")
    kept = beside(sequence, "wifi")
    csi = sequence.csi("wifi", 1)[0, 0] / kept["scale"]
    back = np.fft.ifft(np.fft.ifftshift(csi))
    np.testing.assert_allclose(back, taps[kept["packet"][0, 0, 0]], atol=1e-2)


def test_a_radar_hears_itself(tmp_path: Path) -> None:
    value = files.ti_file(tmp_path / "a.bin", frames=4)
    sequence = imported(tmp_path, tmp_path / "a.bin", layout=RADAR)
    layout = sequence.layout("radar")
    assert layout.measured.all() and layout.measured.shape == (2, 2)
    kept = beside(sequence, "radar")
    csi = sequence.csi_samples("radar", 1)[0] / kept["scale"]
    np.testing.assert_array_equal(csi, np.conj(value[0, 0]))


def test_ranges_of_a_radar_become_subcarriers(tmp_path: Path) -> None:
    value = files.acconeer_file(tmp_path / "a.h5", frames=40)
    sequence = imported(tmp_path, tmp_path / "a.h5", layout=RADAR)
    kept, radio = beside(sequence, "radar"), sequence.radio_spec("radar")
    # The longer subsweep: 4 points, 25 mm apart from 0.1 m.
    assert radio.num_subcarriers == 4
    csi = sequence.csi("radar", 1)[0, 0] / kept["scale"]
    offset_hz = radio.freq_hz - 60.5e9
    range_m = 0.0025 * np.array([40, 50, 60, 70])
    turn = np.exp(2j * np.pi * offset_hz * (2 * range_m[:, None] / 299_792_458.0))
    np.testing.assert_allclose((turn * csi).sum(axis=1) / 4, value[0, 0, :4], rtol=1e-3)


def test_two_access_points_hear_each_other(tmp_path: Path) -> None:
    value = {name: files.integers((20, 1, 1, 56), 300) for name in "ab"}
    for name, rows in value.items():
        records = [files.feitcsi_record(row, 10_000 * k) for k, row in enumerate(rows)]
        (tmp_path / f"{name}.csi").write_bytes(b"".join(records))
    given = PAIR.replace("TRANSMITTER", "ACCESS_POINT").replace("RECEIVER", "ACCESS_POINT")
    sequence = imported(tmp_path, tmp_path / "a.csi", tmp_path / "b.csi", layout=given)
    layout, kept = sequence.layout("wifi"), beside(sequence, "wifi")
    assert layout.device_pairs == [(0, 1), (1, 0)]
    csi = sequence.csi_samples("wifi", sequence.frames[0]) / kept["scale"]
    # The first file is what the first device heard of the second one.
    for name, pair in (("a", (1, 0)), ("b", (0, 1))):
        links = layout.links_between(*pair)
        got = csi[0, links][..., kept["subcarrier_of_bin"]].ravel()
        assert np.isin(np.round(got), value[name][0].ravel()).mean() > 0.9


@pytest.mark.parametrize("extra", [["--sanitize"], ["--empty", "a.mat"]])
def test_what_says_nothing_of_captures_with_places_is_refused(tmp_path, capsys, extra) -> None:
    files.newrf_file(tmp_path / "a.mat")
    (tmp_path / "radios.yaml").write_text(PAIR)
    command = ["import", str(tmp_path / "a.mat"), "--out", str(tmp_path / "out")]
    assert f"{extra[0]}: expected captures of several packets" in refused(
        [*command, *extra], capsys
    )
    line = refused([*command, "--layout", str(tmp_path / "radios.yaml")], capsys)
    assert "import it without --layout" in line
    assert not (tmp_path / "out").exists()


def test_a_receiver_with_a_single_packet_is_named(tmp_path: Path, capsys) -> None:
    files.intel5300_file(tmp_path / "a.dat", packets=100)
    files.intel5300_file(tmp_path / "b.dat", packets=1)
    (tmp_path / "two.yaml").write_text(TWO)
    command = ["import", str(tmp_path / "a.dat"), str(tmp_path / "b.dat")]
    command += ["--layout", str(tmp_path / "two.yaml"), "--out", str(tmp_path / "out")]
    assert "receiver 2 of the layout has a single packet" in refused(command, capsys)


def test_captures_that_tell_places_need_no_layout(tmp_path: Path) -> None:
    value = files.newrf_file(tmp_path / "a.mat")
    sequence = imported(tmp_path, tmp_path / "a.mat", layout=None)
    layout = sequence.layout("radio")
    assert layout.rx_xyz[:, 0].tolist() == [0, 2, 3, 4, 5]
    csi = sequence.csi("radio", 1)[0, :, 0] / beside(sequence, "radio")["scale"]
    np.testing.assert_array_equal(csi, value[[0, 2, 3, 4, 5]])


def test_nothing_is_trained_on_a_single_subcarrier(tmp_path: Path, capsys) -> None:
    files.newrf_file(tmp_path / "a.mat")
    imported(tmp_path, tmp_path / "a.mat", layout=None)
    said = capsys.readouterr().out
    assert "nothing can be trained on it" in said and "next: rfgs train" not in said
    out = ["--out", str(tmp_path / "run")]
    command = ["train", str(tmp_path / "out"), "--radio", "radio", "--no-shader", *out]
    assert "radio has a single subcarrier" in refused(command, capsys)
    encode = ["encode", str(tmp_path / "out"), "--radio", "radio", "--out", str(tmp_path / "a.npz")]
    assert "radio has a single subcarrier" in refused(encode, capsys)
    assert main(["inspect", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().out
    assert "a single subcarrier resolves no paths" in said and "nan" not in said


def test_an_aperture_keeps_its_phases(tmp_path: Path) -> None:
    value = files.afrl_file(tmp_path / "a.mat")
    sequence = imported(tmp_path, tmp_path / "a.mat", layout=None)
    kept, radio = beside(sequence, "sar_capture"), sequence.radio_spec("sar_capture")
    csi = sequence.csi_samples("sar_capture", 1)[:, 0, 0] / kept["scale"]
    cycles = 2 * kept["centre_distance_m"][:, None] * radio.freq_hz / 299_792_458.0
    np.testing.assert_allclose(csi * np.exp(2j * np.pi * (cycles % 1)), value.T, atol=1e-4)
    antenna = sequence.layout("sar_capture", 3)
    expected = [7000 * np.cos(0.015), 7000 * np.sin(0.015), 7000]
    np.testing.assert_allclose(antenna.rx_xyz[0], expected, atol=1e-6)
    # The boresight faces the centre of the scene.
    assert antenna.tx_xyz[0] @ antenna.rx_xyz[0] == pytest.approx(
        np.linalg.norm(antenna.rx_xyz[0]) ** 2, rel=1e-9
    )


@pytest.mark.slow
def test_what_is_imported_trains_and_is_shown(tmp_path: Path) -> None:
    from rfgs_core.run import open_run
    from rfgs_core.view.server import running_server
    from rfgs_core.view.viewer import Viewer

    # Something changes between frames, nothing within them.
    value = np.repeat(files.integers((6, 2, 1, 56), 300), 5, axis=0)
    records = [files.feitcsi_record(row, 20_000 * k) for k, row in enumerate(value)]
    (tmp_path / "a.csi").write_bytes(b"".join(records))
    sequence = imported(tmp_path, tmp_path / "a.csi")
    frames = f"{sequence.frames[0]}:{sequence.frames[1]}"
    run = ["train", str(tmp_path / "out"), "--radio", "wifi", "--out", str(tmp_path / "run")]
    tiny = ["--gaussians", "40", "--iterations", "1", "--posture", "standing", "--no-shader"]
    assert main([*run, *tiny, "--frames", frames]) == 0
    with running_server("127.0.0.1", 0) as server:
        Viewer(open_run(tmp_path / "run"), server, None, "power")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("position_m: [3, 0, 1]", "position_m: [3, 0]"), "position_m: expected"),
        (("centre_hz: 5.825e9", "centre_hz: fast"), "centre_hz: expected a number"),
        (("centre_hz: 5.825e9", "centre: 1"), "field 'centre' is unknown"),
        (("role: RECEIVER", "role: TRANSMITTER"), "expected a device that transmits and one"),
        (("name: rx", "name: tx"), "two devices are called 'tx'"),
        (("devices:", "devices: 3 #"), "devices: expected a list|no valid YAML"),
        (("centre_hz: 5.825e9\n", ""), "give centre_hz in --layout"),
        (("name: lab", "name: ../lab"), "leads outside the dataset"),
        (("role: TRANSMITTER", "role: ACCESS_POINT"), "'tx' is the only device that transmits"),
        (("devices:", f"devices:\n{THIRD}"), "'rx' may have heard any of 'third', 'tx'"),
    ],
)
def test_layouts_are_checked(tmp_path: Path, capsys, change: tuple[str, str], message: str) -> None:
    import re

    files.intel5300_file(tmp_path / "a.dat", packets=100)
    assert change[0] in PAIR
    (tmp_path / "radios.yaml").write_text(PAIR.replace(*change))
    arguments = ["import", str(tmp_path / "a.dat"), "--out", str(tmp_path / "out")]
    line = refused([*arguments, "--layout", str(tmp_path / "radios.yaml")], capsys)
    assert re.search(message, line), line
    assert not (tmp_path / "out").exists()


def test_files_and_devices_must_fit(tmp_path: Path, capsys) -> None:
    files.intel5300_file(tmp_path / "a.dat", packets=100)
    files.intel5300_file(tmp_path / "b.dat", packets=100, streams=2)
    (tmp_path / "pair.yaml").write_text(PAIR)
    (tmp_path / "two.yaml").write_text(TWO)
    a, b, out = str(tmp_path / "a.dat"), str(tmp_path / "b.dat"), str(tmp_path / "out")
    pair, two = ("--layout", str(tmp_path / "pair.yaml")), ("--layout", str(tmp_path / "two.yaml"))
    assert "b.dat has no device" in refused(["import", a, b, "--out", out, *pair], capsys)
    assert "file 'b.dat' was not given" in refused(["import", a, "--out", out, *two], capsys)
    assert "radios of their own" in refused(["import", a, b, "--out", out, *two], capsys)
    assert "give --layout" in refused(["import", a, "--out", out], capsys)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "thesis.txt").write_text("precious")
    assert "holds something already" in refused(["import", a, "--out", out, *pair], capsys)


def test_receivers_that_share_no_time_are_refused(tmp_path: Path, capsys) -> None:
    files.intel5300_file(tmp_path / "a.dat", packets=100)
    files.intel5300_file(tmp_path / "b.dat", packets=100)
    (tmp_path / "two.yaml").write_text(TWO.replace("0.002", "5.0"))
    arguments = ["import", str(tmp_path / "a.dat"), str(tmp_path / "b.dat")]
    arguments += ["--layout", str(tmp_path / "two.yaml"), "--out", str(tmp_path / "out")]
    assert "share no time" in refused(arguments, capsys)


@pytest.mark.parametrize(
    ("line", "message"),
    [("rate_hz: 1e12", "samples; lower rate_hz"), ("rate_hz: 4e7", "values, at most")],
)
def test_clocks_that_are_too_fast_are_refused(
    tmp_path: Path, capsys, line: str, message: str
) -> None:
    files.intel5300_file(tmp_path / "a.dat", packets=100)
    (tmp_path / "radios.yaml").write_text(f"{line}\n{PAIR}")
    arguments = ["import", str(tmp_path / "a.dat"), "--out", str(tmp_path / "out")]
    assert message in refused([*arguments, "--layout", str(tmp_path / "radios.yaml")], capsys)


def test_sanitised_packets_have_a_mean(tmp_path: Path) -> None:
    index = occupied("HT", 20)
    assert index is not None
    generator = np.random.default_rng(1)
    turn = generator.uniform(-1, 1, (60, 1)) * index + generator.uniform(-3, 3, (60, 1))
    value = np.round(200 * np.exp(1j * turn))[:, None, None]
    records = [files.feitcsi_record(row, 10_000 * k) for k, row in enumerate(value)]
    (tmp_path / "a.csi").write_bytes(b"".join(records))
    coherent = {}
    for extra in ((), ("--sanitize",)):
        folder = tmp_path / f"with{len(extra)}"
        folder.mkdir()
        sequence = imported(folder, tmp_path / "a.csi", extra=extra)
        static, csi = sequence.csi_static("wifi"), sequence.csi("wifi", 1)
        coherent[extra] = np.abs(static).mean() / np.abs(csi).mean()
    assert coherent[()] < 0.3 and coherent["--sanitize",] > 0.99
    assert "packets" in {row["what"] for row in sequence.info.guesses}


@pytest.mark.parametrize("name", files.WRITERS)
def test_inspect_tells_and_draws(name: str, tmp_path: Path, capsys) -> None:
    file, write = files.WRITERS[name]
    write(tmp_path / file)
    arguments = ["inspect", str(tmp_path / file), "--sanitize", "--out", str(tmp_path / "p")]
    assert main(arguments) == 0
    out = capsys.readouterr().out
    assert f"({name})" in out and "packets of" in out
    assert (tmp_path / "p" / "a.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "p" / "a_sanitised.png").is_file()


def test_sanitisation_of_a_capture_brings_packets_together(tmp_path: Path) -> None:
    from rfgs_core.capture.cleaned import coherence, steps

    index = occupied("HT", 20)
    assert index is not None
    smooth = np.exp(-0.05j * index)
    generator = np.random.default_rng(1)
    turn = generator.uniform(-1, 1, (40, 1)) * index + generator.uniform(-3, 3, (40, 1))
    value = np.round(200 * smooth * np.exp(1j * turn))[:, None, None]
    records = [files.feitcsi_record(row, 10_000 * k) for k, row in enumerate(value)]
    (tmp_path / "a.csi").write_bytes(b"".join(records))
    capture = read_capture(tmp_path / "a.csi").largest
    taken = list(steps(capture))
    names = [step.name for step in taken]
    assert names[0] == "scaled to RSSI" and "one slope per packet" in names[-2]
    assert coherence(capture) < 0.3 and coherence(taken[-1].capture) > 0.99
    assert taken[-1].name == "resampled at 100 Hz"
