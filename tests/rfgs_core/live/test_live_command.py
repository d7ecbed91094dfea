# SPDX-License-Identifier: Apache-2.0
"""`rfgs live` on a recording and on packets, its end by Ctrl-C, and `rfgs bench live`."""

from __future__ import annotations

import os
import re
import signal
import struct
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from capture_files import feitcsi_file, feitcsi_record, integers
from sending import free_port, send
from two_receivers import LAYOUT

from rfgs_core.cli import main
from rfgs_core.errors import RfgsError
from rfgs_core.live.bench import bench_live
from rfgs_core.live.cloud import live_config
from rfgs_core.live.replay import Replay, recorded_captures, recorded_dataset
from rfgs_core.live.session import LiveOptions, Session

ROOT = Path(__file__).resolve().parents[3]
QUICK = ("--no-view", "--whole-fit-s", "0", "--gaussians", "40")


@pytest.fixture
def layout_file(tmp_path: Path) -> Path:
    path = tmp_path / "radios.yaml"
    path.write_text(LAYOUT)
    return path


def test_a_dataset_is_played_at_its_own_pace(tiny_dataset: Path) -> None:
    replay = Replay(recorded_dataset(tiny_dataset, None, None, "complex"), rate=2.0)
    begin_s = 100.0
    # Two frames a tenth of a second apart, twice as fast, from the first look on.
    first = replay.take(begin_s)
    assert replay.take(begin_s + 0.049) == []
    second = replay.take(begin_s + 0.051)
    assert [len(each.time_s) for each in (*first, *second)] == [1] * 8 and replay.ended
    assert second[0].time_s[0] - first[0].time_s[0] == pytest.approx(0.05)
    assert replay.take(begin_s + 9.0) == []


def test_played_channels_are_those_of_the_dataset(tiny_dataset: Path) -> None:
    from rfgs_core.dataset import open_dataset

    replay = Replay(recorded_dataset(tiny_dataset, None, "wifi", "complex"))
    heard = replay.take(100.0)
    csi = open_dataset(tiny_dataset).sequence().csi("wifi", 1)
    for each in heard:
        tx, rx = replay.setting.block(each.device)
        assert (each.values[0].swapaxes(0, 1) == csi[tx[:, None], rx]).all()


def test_the_command_follows_a_dataset(
    tiny_dataset: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["live", "--replay", str(tiny_dataset), "--rate", "0.5", *QUICK]) == 0
    out = capsys.readouterr().out
    assert out.count("2 received, 2 used") == 4
    assert re.search(r"1 updates, .* from packet to cloud \d+ ms", out)


def test_captures_are_played(tmp_path: Path, layout_file: Path) -> None:
    from rfgs_core.capture.layout_file import read_layout

    for name in ("a.csi", "b.csi"):
        feitcsi_file(tmp_path / name, packets=20)
    files = [tmp_path / "a.csi", tmp_path / "b.csi"]
    recording = recorded_captures(files, read_layout(layout_file), "complex")
    replay = Replay(recording)
    counts = dict(zip(replay.setting.receivers, replay.counts, strict=True))
    options = LiveOptions(updates_per_s=20.0, learn_s=0.0, whole_fit_s=0.0)
    session = Session(replay, counts, live_config(1, 40), options)
    session.run(10.0)
    session.close()
    assert session.tally.total.received == session.tally.total.used > 20
    assert session.tally.updates > 0


def test_a_rate_of_nothing_is_refused(tiny_dataset: Path) -> None:
    with pytest.raises(RfgsError, match="--rate 0"):
        Replay(recorded_dataset(tiny_dataset, None, None, "complex"), rate=0.0)


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["--no-view"], "expected --layout"),
        (["--people", "0"], "--people 0: expected 1 to 20"),
        (["--updates-per-s", "1e9"], "--updates-per-s 1000000000"),
        (["--seconds", "0"], "--seconds 0"),
        (["--replay", "nowhere", "--no-view"], "expected --layout"),
        (["--port", "0"], "--port 0: expected 1 to 65535"),
        (
            ["--replay", "data", "--port", "6000", "--format", "esp32"],
            "--format, --port says nothing",
        ),
        (["--replay", "a.csi", "--layout", "l.yaml", "--radio", "wifi"], "nothing about captures"),
        (["--layout", "l.yaml", "--rate", "2"], "--rate says nothing about packets that arrive"),
    ],
)
def test_mistakes_are_told_in_one_line(
    arguments: list[str], complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["live", *arguments]) == 2
    error = capsys.readouterr().err.strip()
    assert complaint in error and len(error.splitlines()) == 1


def test_ctrl_c_ends_a_stream_with_a_summary(layout_file: Path) -> None:
    port = free_port(2)
    command = [sys.executable, "-m", "rfgs_core.cli", "live", "--layout", str(layout_file)]
    command += ["--port", str(port), "--learn-s", "0.2", *QUICK, "--feed-port", "0"]
    stop = threading.Event()

    def keep_sending() -> None:
        record = bytearray(feitcsi_record(integers((2, 1, 56), 300), 1))
        while not stop.wait(0.02):
            struct.pack_into("<I", record, 88, int(time.monotonic() * 1e6) & 0xFFFF_FFFF)
            for row in range(2):
                send(port + row, [bytes(record), b"rubbish"])

    sender = threading.Thread(target=keep_sending)
    sender.start()
    try:
        program = subprocess.Popen(
            command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        )  # fmt: skip
        assert program.stdout is not None
        # It says so once every radio was heard.
        said = program.stdout.readline()
        assert "updates are sent at 127.0.0.1" in said, program.communicate(timeout=60)[1]
        threading.Event().wait(2.0)
        program.send_signal(signal.SIGINT)
        out, err = program.communicate(timeout=60)
    finally:
        stop.set()
        sender.join()
    assert program.returncode == 0, err
    assert re.search(r"r1: \d+ received, \d+ used, \d+ malformed\n", out)
    assert re.search(r"\d+ updates, .* per second; from packet to cloud", out)
    assert "Traceback" not in err


def test_a_page_shows_the_stream(tiny_dataset: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["--whole-fit-s", "0", "--gaussians", "40", "--rate", "0.5", "--view-port", "0"]
    assert main(["live", "--replay", str(tiny_dataset), *arguments]) == 0
    assert re.search(r"http://127.0.0.1:\d+/\S+ shows them", capsys.readouterr().out)


@pytest.mark.slow
def test_six_receivers_lose_nothing_inside() -> None:
    """The bench, short and slow; its figures are those of this machine as it is."""
    options = LiveOptions(learn_s=0.3, whole_fit_s=0.0, updates_per_s=10.0)
    result = bench_live(2.0, 100.0, live_config(1, 60), options)
    assert result["packets sent"] > 600
    assert (
        result["packets received"] + result["dropped before the program"]
        >= (result["packets sent"])
    )
    assert result["lost inside the program"] == 0
    assert result["updates per s"] > 0 and 0 < result["latency median ms"]
