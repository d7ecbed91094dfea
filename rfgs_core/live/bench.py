# SPDX-License-Identifier: Apache-2.0
"""How fast a stream is followed: six receivers of another process, over UDP, for a while."""

from __future__ import annotations

import multiprocessing
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from rfgs_core.errors import RfgsError
from rfgs_core.fit.frame import FrameState
from rfgs_core.live.cloud import live_config, warm_up
from rfgs_core.live.session import LiveOptions, Session, Tally
from rfgs_core.live.stream import Stream, StreamOptions
from rfgs_core.live.synthetic import TURN_S, place_m, send, stand
from rfgs_core.settings import TrainConfig
from rfgs_core.threads import one_torch_thread

#: What is asked for: median latency at most [ms], updates per second at least.
LATENCY_MS, UPDATES_PER_S = 100.0, 20.0
_GRACE_S = 10.0


class _Truth:
    """How far the followed place is from the true one."""

    def __init__(self) -> None:
        self.error_m: list[float] = []

    def show(self, state: FrameState) -> None:
        """Compares an update."""
        true = place_m(state.tracks.time_s)
        self.error_m.append(float(np.linalg.norm(state.tracks.axes_xy[0] - true)))


def bench_live(
    seconds: float = 60.0,
    per_s: float = 1000.0,
    config: TrainConfig | None = None,
    options: LiveOptions | None = None,
    note: Callable[[str], None] = lambda _: None,
) -> dict[str, Any]:
    """Follows synthetic receivers and counts.

    Args:
        seconds: How long to follow once the background is learned [s].
        per_s: Packets of each of the six receivers in a second.
        config: Gaussians and solver of the short step; None: as `rfgs live`.
        options: How the stream is followed; None: as `rfgs live`.
        note: Is told what is going on.

    Returns:
        A flat dictionary: packets sent, used and lost, latency, updates per second, error of the
        place.

    Raises:
        RfgsError: The sender does not start, or nothing was followed.
    """
    options, config = options or LiveOptions(), config or live_config(bodies=1)
    given, truth = stand(), _Truth()
    ports = free_ports(len(given.receivers))
    warm_up(config)
    note("computing the channels of six receivers")
    with one_torch_thread(), _sender(ports, per_s) as pipe:
        listening = replace(StreamOptions(), port=ports[0], most_per_s=1e5, wait_s=120.0)
        stream = Stream(given, listening)
        counts = dict(zip(given.receivers, stream.counts, strict=True))
        session = Session(stream, counts, config, options, [truth])
        note(f"following for {seconds:g} s")
        before = time.monotonic(), time.process_time()
        try:
            session.run(seconds + options.learn_s)
            pipe.send("stop")
            if not pipe.poll(_GRACE_S):
                raise RfgsError("bench live: the sender does not answer")
            sent = int(pipe.recv()) * len(ports)
            session.finish()
            elapsed_s, used_s = time.monotonic() - before[0], time.process_time() - before[1]
        finally:
            session.close()
    if not truth.error_m:
        raise RfgsError(
            f"bench live: no update in {seconds:g} s, of {session.tally.total.received} packets; "
            "give --seconds more"
        )
    return {
        "packets sent": sent,
        **_outcome(session.tally),
        "place error median m": float(np.median(truth.error_m)),
        "place error of the room's middle m": _guess_m(),
        "gaussians": config.num_gaussians,
        "cpu s per s": used_s / max(elapsed_s, 1e-9),
    }


def _outcome(tally: Tally) -> dict[str, Any]:
    """What became of the packets, and how soon, beside what is wanted."""
    total = tally.total
    return {
        "packets received": total.received,
        "packets used": total.used,
        "what became of them": str(total),
        "dropped before the program": total.before_us,
        "lost inside the program": total.received - total.used - total.malformed,
        "latency median ms": 1e3 * tally.latency.percentile_s(50.0),
        "latency 99 % ms": 1e3 * tally.latency.percentile_s(99.0),
        "latency target ms": LATENCY_MS,
        "updates per s": tally.updates_per_s,
        "updates per s target": UPDATES_PER_S,
        "whole fits": tally.whole_fits,
    }


def _guess_m() -> float:
    """Mean distance of the true places from the middle of the room [m]: knowing nothing."""
    middle = np.mean(stand().bounds_m or [[0.0] * 3], axis=0)[:2]
    return float(np.linalg.norm(place_m(np.linspace(0.0, TURN_S, 100)) - middle, axis=1).mean())


def free_ports(count: int) -> list[int]:
    """Consecutive free UDP ports of loopback.

    Raises:
        RfgsError: None were found.
    """
    for _ in range(50):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.bind(("127.0.0.1", 0))
            first = probe.getsockname()[1]
        if first + count < 65536 and all(_is_free(first + row) for row in range(count)):
            return list(range(first, first + count))
    raise RfgsError(f"bench live: no {count} free UDP ports in a row")


def _is_free(port: int) -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("127.0.0.1", port))
        except OSError:
            return False
    return True


@contextmanager
def _sender(ports: list[int], per_s: float) -> Iterator[Connection]:
    """A process that sends, for as long as the block runs; packets have begun when it begins."""
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=send, args=(theirs, ports, per_s), daemon=True)
    process.start()
    theirs.close()
    try:
        yield ours
    finally:
        process.terminate()
        process.join()
