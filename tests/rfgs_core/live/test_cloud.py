# SPDX-License-Identifier: Apache-2.0
"""Gaussians that follow somebody window by window, whole fits beside them, and who sees them."""

from __future__ import annotations

import json
import socket
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import torch
from sending import wait_for

from rfgs_core.errors import RfgsError
from rfgs_core.fit.frame import FrameState
from rfgs_core.live.cloud import LOST_M, Cloud, live_config
from rfgs_core.live.feed import COLUMNS, MOST_READERS, Feed, message
from rfgs_core.live.whole_fit import WholeFit
from rfgs_core.measure.observations import Observations
from rfgs_core.model.channel import Channel

CONFIG = live_config(bodies=1, gaussians=60)
Walk = Callable[[float], Observations]


def at_xy(time_s: float) -> tuple[float, float]:
    """Where somebody is who walks."""
    return 1.0 + time_s, 1.7


@pytest.fixture
def walk(make_observations, make_gaussians, head) -> Walk:
    """What somebody does to the channel who walks along x at 1 m/s, from (1, 1.7)."""
    empty = make_observations()
    channel = Channel.of(empty, empty.links, empty.subcarriers)

    def at(time_s: float) -> Observations:
        body = make_gaussians(40, around=(*at_xy(time_s), 1.0))
        # All of them around the place, as the strongest are what a radio sees.
        body.means[:, :2] = 0.3 * (body.means[:, :2] - body.means.new_tensor(at_xy(time_s)))
        body.means[:, :2] += body.means.new_tensor(at_xy(time_s))
        delta = np.zeros_like(empty.delta)
        delta[channel.tx, channel.rx] = channel.change(head, body).numpy()
        return replace(empty.with_delta(delta), time_s=time_s)

    return at


def followed(walk: Walk, until_s: float) -> tuple[Cloud, list[float]]:
    """A cloud after some time, and how far it was from the true place in each window."""
    cloud, error_m = Cloud(CONFIG), []
    for time_s in np.arange(0.0, until_s, 0.08):
        state = cloud.update(walk(float(time_s)))
        assert state is not None
        true = np.array(at_xy(time_s))
        error_m.append(float(np.linalg.norm(state.tracks.axes_xy[0] - true)))
    return cloud, error_m


def test_the_cloud_follows_who_walks(walk: Walk) -> None:
    cloud, error_m = followed(walk, 1.6)
    # Who guesses the middle of the way is off by 0.4 m.
    assert np.median(error_m[5:]) < 0.25
    state = cloud.state
    assert state is not None and len(state.gaussians.means) == 60
    assert float(state.gamma.abs().max()) > 0.0
    middle = state.gaussians.means[:, :2].mean(dim=0).numpy()
    assert np.linalg.norm(middle - state.tracks.axes_xy[0]) < 0.3


def test_a_silent_window_changes_nothing(walk: Walk) -> None:
    cloud = Cloud(CONFIG)
    silent = walk(0.0).with_delta(np.zeros_like(walk(0.0).delta))
    assert cloud.update(silent) is None
    before = cloud.update(walk(0.1))
    assert cloud.update(silent) is before


def test_a_whole_fit_gives_its_gaussians_and_the_stream_their_place(walk: Walk) -> None:
    cloud, _ = followed(walk, 0.5)
    early = cloud.state
    assert early is not None
    cloud.update(walk(0.6))
    now = cloud.state
    assert now is not None
    means = early.gaussians.means.clone()
    means[:, 2] = 0.77
    cloud.take(replace(early, gaussians=replace(early.gaussians, means=means)))
    after = cloud.state
    assert after is not None and (after.gaussians.means[:, 2] == 0.77).all()
    assert (after.tracks.axes_xy == now.tracks.axes_xy).all()
    shift = (after.gaussians.means - means)[0, :2].numpy()
    np.testing.assert_allclose(shift, (now.tracks.axes_xy - early.tracks.axes_xy)[0], atol=1e-6)


def test_who_was_lost_is_found_again(walk: Walk) -> None:
    cloud, _ = followed(walk, 0.5)
    right = cloud.state
    assert right is not None
    away = replace(right.tracks, axes_xy=right.tracks.axes_xy + 2.0 * LOST_M)
    cloud.state = replace(right, tracks=away)
    cloud._places[-1] = away
    cloud.take(right)
    state = cloud.update(walk(0.56))
    assert state is not None
    assert np.linalg.norm(state.tracks.axes_xy[0] - [1.56, 1.7]) < 0.4


def test_a_process_of_its_own_fits_whole_windows(walk: Walk) -> None:
    config = replace(CONFIG, posture="standing", num_gaussians=30, iterations=2, batch_entries=256)
    whole = WholeFit(config)
    try:
        assert whole.result() is None
        whole.offer(walk(0.3))
        whole.offer(walk(0.4))  # It is busy; this one is not taken.
        found: list[FrameState] = []

        def came() -> bool:
            found.extend([state for state in [whole.result()] if state is not None])
            return bool(found)

        wait_for(came, limit_s=120.0)
        assert whole.done == 1 and found[0].tracks.time_s == 0.3
        assert len(found[0].gaussians.means) == 30
    finally:
        whole.close()
    whole.offer(walk(0.5))
    assert whole.result() is None


def read_message(stream: socket.socket) -> tuple[dict, np.ndarray]:
    with stream.makefile("rb", buffering=0) as file:
        head = json.loads(file.readline())
        data = b""
        while len(data) < head["bytes"]:
            data += file.read(head["bytes"] - len(data)) or b""
    return head, np.frombuffer(data, "<f4").reshape(head["count"], -1)


def test_whoever_connects_is_sent_whole_updates(state: FrameState) -> None:
    feed = Feed(0)
    try:
        feed.show(state)  # Nobody listens yet.
        with socket.create_connection(("127.0.0.1", feed.port), timeout=10) as reader:
            wait_for(lambda: len(feed._readers) == 1)
            feed.show(state)
            head, rows = read_message(reader)
        assert head["rfgs"] == 1 and head["columns"] == list(COLUMNS) and len(rows) == 12
        named = dict(zip(COLUMNS, rows.T, strict=True))
        means = state.gaussians.means.numpy()
        assert (np.stack([named[key] for key in "xyz"], axis=1) == means).all()
        power = 20.0 * torch.log10(state.gamma.abs().clamp(min=1e-10)).numpy()
        np.testing.assert_allclose(named["rf_power_db"], power, atol=1e-3)
    finally:
        feed.close()


def test_a_reader_that_takes_nothing_holds_nobody_up(state: FrameState, make_gaussians) -> None:
    feed = Feed(0)
    state = replace(state, gaussians=make_gaussians(2000))
    try:
        with socket.create_connection(("127.0.0.1", feed.port), timeout=20) as lazy:
            wait_for(lambda: len(feed._readers) == 1)
            # Far more than the system holds for a connection.
            for number in range(300):
                tracks = replace(state.tracks, time_s=float(number))
                feed.show(replace(state, tracks=tracks))
            assert 300 * len(message(state)) > 2e7
            # What it finds in the end are whole updates, oldest first, with others left out.
            times = [read_message(lazy)[0]["time_s"] for _ in range(3)]
            assert times == sorted(times) and times[-1] < 299
    finally:
        feed.close()


def test_the_feed_ends_and_its_port_is_free_again(state: FrameState) -> None:
    feed = Feed(0)
    port = feed.port
    with pytest.raises(RfgsError, match=f"TCP port {port}"):
        Feed(port)
    readers = [socket.create_connection(("127.0.0.1", port)) for _ in range(MOST_READERS + 1)]
    # One more than there is room for is let go at once.
    readers[-1].settimeout(10)
    assert readers[-1].recv(1) == b""
    feed.close()
    readers[0].settimeout(10)
    assert readers[0].recv(1) == b""
    for reader in readers:
        reader.close()
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", port), timeout=2)
