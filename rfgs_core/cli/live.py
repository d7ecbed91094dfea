# SPDX-License-Identifier: Apache-2.0
"""`rfgs live`: packets of radios become moving Gaussians as they arrive."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from rfgs_core.live.limbs import LiveLimbs
    from rfgs_core.live.replay import Replay
    from rfgs_core.live.session import Session, Sink, Tally
    from rfgs_core.live.setting import Reported, Setting
    from rfgs_core.live.stream import Stream


@dataclass(frozen=True)
class LiveArgs:
    """Follows people while radios send: from UDP packets, or from a recording at its own pace.

    Each radio that receives sends its packets to a UDP port of its own, one record of FeitCSI,
    PicoScenes or ESP32 per datagram. Packets are put on one clock and cut into windows; each moves
    the Gaussians a step. A page of the viewer shows them, and Blender through a socket of this
    machine. Ctrl-C ends it and says what became of every packet. docs/live.md tells more.

    Example: rfgs live --layout radios.yaml --format feitcsi
    Example: rfgs live --replay data --radio wifi
    """

    replay: tuple[Path, ...] = ()
    """Play a dataset, or a capture for each device that receives, instead of listening."""
    layout: Path | None = None
    """Where the radios stand (YAML, docs/captures.md); a dataset tells it itself."""
    format: Literal["feitcsi", "picoscenes", "esp32"] = "feitcsi"
    """What datagrams hold."""
    host: str = "127.0.0.1"
    """Address that packets are heard at, and that the page is shown at: this machine only; any
    other one lets its network send packets and look."""
    port: int = 5500
    """UDP port of the first radio that receives; the others follow in the layout's order."""
    most_per_s: float = 5000.0
    """Packets of one radio in a second, at most; what is more is counted and left out."""
    wait_s: float = 60.0
    """How long to wait for the first packets of every radio [s]."""
    sequence: str | None = None
    """Which sequence of a dataset to play; may be left out when there is only one."""
    radio: str | None = None
    """Which radio of a dataset to play; may be left out when there is only one."""
    rate: float = 1.0
    """Seconds of a recording that are played in a second."""
    observe: Literal["complex", "power"] = "complex"
    """What of packets is trusted: complex, the channel, packets of cards turned onto the empty
    room; power, |CSI|^2 alone."""
    people: int = 1
    """How many people move."""
    gaussians: int = 400
    """Moving Gaussians."""
    limbs: Literal["auto", "off"] = "auto"
    """auto: where a network for the radio comes with the package (mmwave), it tells in every window
    how people hold themselves; off: Gaussians are moved as they were drawn."""
    updates_per_s: float = 25.0
    """Windows, and updates of the Gaussians, in a second."""
    learn_s: float = 3.0
    """How long the empty room is learned first, where no dataset holds it [s]."""
    whole_fit_s: float = 5.0
    """A whole fit of a window begins so often, in a process of its own [s]; 0: never."""
    seconds: float | None = None
    """End after so long [s]; left out: with the recording, or with Ctrl-C."""
    view_port: int = 8080
    """Port of the viewer's page; 0 takes any free one."""
    view: bool = True
    """Show a page."""
    feed_port: int | None = None
    """Send every update to whoever connects to this TCP port of 127.0.0.1, for example Blender;
    0 takes any free one."""


def run(args: LiveArgs) -> int:
    """Follows until the end or Ctrl-C and prints what happened; exit code 0."""
    from rfgs_core.live.cloud import live_config, warm_up
    from rfgs_core.live.session import LiveOptions, Session
    from rfgs_core.threads import one_torch_thread

    _check(args)
    config = live_config(args.people, args.gaussians, args.observe)
    options = LiveOptions(
        updates_per_s=args.updates_per_s, learn_s=args.learn_s, whole_fit_s=args.whole_fit_s
    )
    with one_torch_thread(), contextlib.ExitStack() as open_things:
        warm_up(config)
        source = _source(args)
        open_things.callback(source.close)
        limbs = _limbs(args, source.setting)
        # Whoever reads that updates are sent may stop the command from then on.
        sinks = open_things.enter_context(_sinks(args, source.setting))
        counts = dict(zip(source.setting.receivers, source.counts, strict=True))
        session = Session(source, counts, config, options, sinks, limbs)
        open_things.callback(session.close)
        try:
            _follow(args, session)
        except KeyboardInterrupt:
            sys.stderr.write("\n")
        for line in summary(source.setting, session.tally):
            sys.stdout.write(f"{line}\n")
    return 0


def _limbs(args: LiveArgs, setting: Setting) -> LiveLimbs | None:
    """What tells limbs; None where nothing does, or nobody asks."""
    from rfgs_core.limbs.weights import own_network
    from rfgs_core.live.limbs import LiveLimbs

    trained = own_network(setting.freq_hz) if len(setting.freq_hz) > 1 else None
    if trained is None or args.limbs == "off" or args.observe != "complex":
        return None
    return LiveLimbs(trained.network, args.gaussians)


def summary(setting: Setting, tally: Tally) -> list[str]:
    """What happened, in lines: a device each, then updates and latency."""
    lines = [f"{setting.devices[device].name}: {n}" for device, n in tally.counts.items()]
    if not tally.updates:
        return [*lines, "no update: nobody moved, or the empty room was not learned yet"]
    latency = [1e3 * tally.latency.percentile_s(share) for share in (50.0, 99.0)]
    return [
        *lines,
        f"{tally.updates} updates, {tally.updates_per_s:.1f} per second; from packet to cloud "
        f"{latency[0]:.0f} ms (99 %: {latency[1]:.0f} ms); {tally.whole_fits} whole fits",
    ]


def _check(args: LiveArgs) -> None:
    """Refuses numbers that nothing comes of.

    Raises:
        RfgsError: One is out of range.
    """
    from rfgs_core.errors import RfgsError

    limits = {
        "people": (1, 20),
        "gaussians": (1, 20_000),
        "updates_per_s": (0.1, 200),
        "port": (1, 65_535),
        "most_per_s": (1, 1e5),
        "learn_s": (0.0, 3600),
        "wait_s": (0.1, 3600),
        "whole_fit_s": (0.0, 3600),
    }
    for name, (least, most) in limits.items():
        if not least <= getattr(args, name) <= most:
            option = name.replace("_", "-")
            raise RfgsError(f"--{option} {getattr(args, name)}: expected {least:g} to {most:g}")
    if args.seconds is not None and not args.seconds > 0.0:
        raise RfgsError(f"--seconds {args.seconds:g}: expected more than 0")
    _refuse_without_effect(args)


def _refuse_without_effect(args: LiveArgs) -> None:
    """Refuses options of another source than the one that is followed.

    Raises:
        RfgsError: Naming them.
    """
    from rfgs_core.errors import RfgsError

    listening, played = ("format", "port", "most_per_s", "wait_s"), ("rate", "sequence", "radio")
    if not args.replay:
        others, source = played, "packets that arrive"
    elif args.layout is not None:
        others, source = (*listening, "sequence", "radio"), "captures"
    else:
        others, source = listening, "a dataset"
    idle = [name for name in others if getattr(args, name) != getattr(LiveArgs, name)]
    if idle:
        options = ", ".join(f"--{name.replace('_', '-')}" for name in idle)
        raise RfgsError(f"live: {options} says nothing about {source}; leave it out")


def _follow(args: LiveArgs, session: Session) -> None:
    try:
        session.run(args.seconds)
    finally:
        session.finish(1.0)


def _source(args: LiveArgs) -> Stream | Replay:
    """Where packets come from.

    Raises:
        RfgsError: It is not said where the radios stand, or a recording cannot be read.
    """
    from rfgs_core.capture.layout_file import EXAMPLE, read_layout
    from rfgs_core.errors import RfgsError
    from rfgs_core.live.replay import Replay, recorded_captures, recorded_dataset
    from rfgs_core.live.stream import Stream, StreamOptions

    reported: Reported = args.observe
    if len(args.replay) == 1 and args.replay[0].is_dir() and args.layout is None:
        recording = recorded_dataset(args.replay[0], args.sequence, args.radio, reported)
        return Replay(recording, args.rate)
    if args.layout is None:
        raise RfgsError(f"live: expected --layout with where the radios stand, like {EXAMPLE}")
    given = read_layout(args.layout)
    if args.replay:
        recording = recorded_captures(
            args.replay,
            given,
            reported,
            lambda warning: sys.stderr.write(f"warning: {warning}\n"),
        )
        return Replay(recording, args.rate)
    names = [given.devices[device].name for device in given.receivers]
    sys.stderr.write(
        f"listening at {args.host} for {args.format} packets of "
        + ", ".join(f"{name} (UDP {args.port + row})" for row, name in enumerate(names))
        + "\n"
    )
    options = StreamOptions(args.host, args.port, args.format, args.most_per_s, args.wait_s)
    return Stream(given, options, reported)


@contextmanager
def _sinks(args: LiveArgs, setting: Setting) -> Iterator[list[Sink]]:
    """Who is shown the updates, for as long as the block runs."""
    from rfgs_core.live.feed import Feed
    from rfgs_core.live.page import Page
    from rfgs_core.view.server import address, running_server

    with contextlib.ExitStack() as stack:
        sinks: list[Sink] = []
        if args.feed_port is not None:
            feed = Feed(args.feed_port)
            stack.callback(feed.close)
            sinks.append(feed)
            sys.stdout.write(f"updates are sent at 127.0.0.1, TCP port {feed.port}\n")
        if args.view:
            server = stack.enter_context(running_server(args.host, args.view_port))
            sinks.append(Page(server, setting))
            sys.stdout.write(f"{address(server)} shows them; Ctrl-C ends\n")
        sys.stdout.flush()
        yield sinks
