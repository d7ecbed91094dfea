# SPDX-License-Identifier: Apache-2.0
"""Packets of every kind from a socket to channels of a setting."""

from __future__ import annotations

import threading
from pathlib import Path

import numpy as np
import pytest
from capture_files import feitcsi_record, integers
from sending import (
    esp32_stream,
    feitcsi_stream,
    free_port,
    picoscenes_stream,
    room,
    send,
    wait_for,
)

from rfgs_core.capture import esp32, feitcsi, picoscenes
from rfgs_core.errors import RfgsError
from rfgs_core.live.counts import Counts
from rfgs_core.live.records import READERS, decode
from rfgs_core.live.stream import Stream, StreamOptions


def stamped(records: list[bytes]) -> list[tuple[float, bytes]]:
    return [(0.001 * number, record) for number, record in enumerate(records)]


def open_stream(records: list[list[bytes]], form: str = "feitcsi") -> Stream:
    """A stream whose radios have sent these records."""
    port = free_port(len(records))

    def post() -> None:
        for row, own in enumerate(records):
            send(port + row, own)

    # It listens before it waits, so what is sent a little later is heard.
    timer = threading.Timer(0.3, post)
    timer.start()
    options = StreamOptions(port=port, format=form, wait_s=10.0)  # type: ignore[arg-type]
    return Stream(room(len(records)), options, "power")


def test_a_whole_record_is_told_from_everything_else(tmp_path: Path) -> None:
    kinds = {
        feitcsi: feitcsi_stream(1)[0],
        picoscenes: picoscenes_stream(1)[0],
        esp32: esp32_stream(1, tmp_path),
    }
    for reader, (record,) in kinds.items():
        assert reader.is_record(record)
        assert not reader.is_record(record[:-9]) and not reader.is_record(b"")
        for other, (foreign,) in kinds.items():
            assert reader is other or not reader.is_record(foreign)
    (line,) = kinds[esp32]
    assert esp32.is_record(line + b"\r\n") and not esp32.is_record(line + b"\n" + line)


def test_many_datagrams_decode_like_a_file(tmp_path: Path) -> None:
    for name, records in (
        ("feitcsi", feitcsi_stream(6)[0]),
        ("picoscenes", picoscenes_stream(6)[0]),
        ("esp32", esp32_stream(6, tmp_path)),
    ):
        joined = (b"\n" if name == "esp32" else b"").join(records)
        whole = READERS[name].decode(Path("x"), joined).largest  # type: ignore[index]
        counts = Counts()
        (found,) = decode(READERS[name], stamped(records), counts)  # type: ignore[index]
        assert (found.capture.values == whole.values).all() and counts == Counts()
        assert found.arrived_s.tolist() == [0.001 * number for number in range(6)]


def test_one_bad_record_costs_no_other() -> None:
    records, value = feitcsi_stream(6)
    # As long as a record, and says so, but of a format that nobody knows.
    unknown = feitcsi_record(integers((2, 1, 56), 9), 5, form=7)
    counts = Counts()
    found = decode(READERS["feitcsi"], stamped([*records[:3], unknown, *records[3:]]), counts)
    assert counts.malformed == 1
    values = np.concatenate([each.capture.values[:, 0] for each in found])
    measured = found[0].capture.valid[0, 0]
    assert (values[:, measured] == value[:, measured]).all()


def test_channels_are_those_that_were_sent() -> None:
    one, value = feitcsi_stream(12)
    stream = open_stream([one, one])
    try:
        heard = stream.take(0.0)
        assert [each.device for each in heard] == [1, 2]
        setting = stream.setting
        kept = setting.subcarriers
        # 56 subcarriers with a hole at the centre are 57 on an even grid: all are followed.
        assert len(kept) == 57 and kept.sum() == 52
        level = setting.free_space(1)
        power = np.mean(np.abs(heard[0].values[..., kept]) ** 2, axis=(1, 2, 3))
        np.testing.assert_allclose(power, level**2, rtol=0.2)
        even = np.insert(value, 28, 0, axis=-1)[..., kept]
        ratio = heard[0].values[..., kept] / even
        # One gain per packet and nothing else.
        np.testing.assert_allclose(ratio, ratio[:, :1, :, :1] * np.ones_like(ratio), rtol=1e-5)
        np.testing.assert_allclose(np.diff(heard[0].time_s), 1e-3, atol=1e-6)
        assert (heard[0].time_s <= heard[0].arrived_s).all()
    finally:
        stream.close()


def test_duplicates_and_other_formats_are_counted() -> None:
    one, _ = feitcsi_stream(10)
    other = [feitcsi_record(integers((1, 1, 56), 9), 77_000 + number) for number in range(3)]
    stream = open_stream([[*one, *one[:4], *other], one])
    try:
        wait_for(lambda: stream.counts[0].received == 17 and stream.counts[1].received == 10)
        heard: dict[int, int] = {1: 0, 2: 0}
        for each in stream.take(0.0):
            heard[each.device] += len(each.time_s)
        assert heard == {1: 10, 2: 10}
        assert (stream.counts[0].duplicate, stream.counts[0].other_format) == (4, 3)
    finally:
        stream.close()


def test_a_radio_that_stays_silent_is_named() -> None:
    port = free_port(2)
    timer = threading.Timer(0.2, send, (port, feitcsi_stream(10)[0]))
    timer.start()
    with pytest.raises(RfgsError, match=rf"device 'r2'.*UDP port {port + 1}.*nothing received"):
        Stream(room(2), StreamOptions(port=port, wait_s=1.0))


def test_radios_of_different_formats_do_not_mix() -> None:
    other = [feitcsi_record(integers((1, 1, 56), 9), 1000 * number) for number in range(10)]
    with pytest.raises(RfgsError, match=r"device 'r2' sends .*expected packets of one kind"):
        open_stream([feitcsi_stream(10)[0], other])


@pytest.mark.parametrize("form", ["picoscenes", "esp32"])
def test_other_tools_are_heard_too(form: str, tmp_path: Path) -> None:
    records = picoscenes_stream(9)[0] if form == "picoscenes" else esp32_stream(9, tmp_path)
    stream = open_stream([records, records], form)
    try:
        counted = [len(each.time_s) for each in stream.take(0.0)]
        assert counted == [9, 9]
    finally:
        stream.close()
