# SPDX-License-Identifier: Apache-2.0
"""Datagrams over a real socket: limits hold, and everything is counted."""

from __future__ import annotations

import pytest
from sending import busy_port, feitcsi_stream, send, wait_for

from rfgs_core.capture.feitcsi import is_record
from rfgs_core.errors import RfgsError
from rfgs_core.live import ears
from rfgs_core.live.ears import LARGEST_BYTES, Ears


def listen(count: int = 1, most_per_s: float = 1e6) -> Ears:
    return Ears("127.0.0.1", [0] * count, is_record, most_per_s)


def test_datagrams_are_kept_apart_and_in_order() -> None:
    one, two = feitcsi_stream(5)[0], feitcsi_stream(3, first=50)[0]
    own = listen(2)
    try:
        send(own.ports[0], one)
        send(own.ports[1], two)
        wait_for(lambda: [each.received for each in own.counts] == [5, 3])
        assert [data for _, data in own.fetch(0)] == one
        assert [data for _, data in own.fetch(1)] == two
        assert own.fetch(0) == []
        assert own.counts[0].malformed == 0
    finally:
        own.close()


def test_what_is_no_record_is_counted_and_left_out() -> None:
    good = feitcsi_stream(2)[0]
    bad = [b"", b"x", good[0][:-1], good[0] + b"y", bytes(300), b"\xff" * 2000]
    own = listen()
    try:
        send(own.ports[0], [good[0], *bad, good[1], bytes(LARGEST_BYTES + 1)])
        wait_for(lambda: own.counts[0].received == len(bad) + 3)
        assert [data for _, data in own.fetch(0)] == good
        assert (own.counts[0].malformed, own.counts[0].too_large) == (len(bad), 1)
    finally:
        own.close()


def test_a_radio_may_not_send_faster_than_allowed() -> None:
    own = listen(most_per_s=40.0)
    try:
        send(own.ports[0], feitcsi_stream(200)[0])
        wait_for(lambda: own.counts[0].received == 200)
        # A quarter of a second's packets at once, and few more while they are read.
        assert 10 <= len(own.fetch(0)) < 60
        assert own.counts[0].too_many > 140
    finally:
        own.close()


def test_newer_packets_push_out_older_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ears, "MOST_WAITING", 10)
    sent = feitcsi_stream(50)[0]
    own = listen()
    try:
        send(own.ports[0], sent)
        wait_for(lambda: own.counts[0].received == 50)
        assert [data for _, data in own.fetch(0)] == sent[40:]
        assert own.counts[0].pushed_out == 40
    finally:
        own.close()


def test_waiting_bytes_are_bounded_too(monkeypatch: pytest.MonkeyPatch) -> None:
    sent = feitcsi_stream(20)[0]
    monkeypatch.setattr(ears, "MOST_WAITING_BYTES", 3 * len(sent[0]))
    own = listen()
    try:
        send(own.ports[0], sent)
        wait_for(lambda: own.counts[0].received == 20)
        assert len(own.fetch(0)) == 3 and own.counts[0].pushed_out == 17
    finally:
        own.close()


def test_a_taken_port_and_a_foreign_address_are_told() -> None:
    with busy_port() as port, pytest.raises(RfgsError, match=f"UDP port {port}"):
        Ears("127.0.0.1", [port], is_record, 1.0)
    with pytest.raises(RfgsError, match="cannot listen"):
        Ears("203.0.113.7", [0], is_record, 1.0)
    with pytest.raises(RfgsError, match="expected 0 to 65535"):
        Ears("127.0.0.1", [65536], is_record, 1.0)


def test_closing_frees_the_port() -> None:
    own = listen()
    (port,) = own.ports
    own.close()
    again = Ears("127.0.0.1", [port], is_record, 1.0)
    again.close()
