# SPDX-License-Identifier: Apache-2.0
"""Files and a layout become channels of one radio on one clock."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from jaxtyping import Complex64

from rfgs_core.capture.alignment import Schedule, schedule
from rfgs_core.capture.channels import Channels, channels_of
from rfgs_core.capture.cleaned import cleaned
from rfgs_core.capture.layout_file import CaptureLayout, assign
from rfgs_core.capture.model import MOST_VALUES, Capture
from rfgs_core.capture.prepare_placed import tells_places
from rfgs_core.capture.prepared import Prepared, bounds_around, guess, scale_to_free_space
from rfgs_core.capture.readers import read_capture
from rfgs_core.errors import RfgsError
from rfgs_core.radio import Radio, layout
from rfgs_core.radio.constants import SPEED_OF_LIGHT


@dataclass(frozen=True)
class _Receiver:
    """One receiving device's capture."""

    path: Path
    capture: Capture
    channels: Channels


def prepare(
    files: list[Path],
    given: CaptureLayout,
    empty: list[Path] | None = None,
    form: str | None = None,
    *,
    sanitise: bool = False,
) -> tuple[Prepared, list[str]]:
    """Reads the files of one radio and puts them on one clock.

    Args:
        files: A file for each receiving device.
        given: Where the devices stood.
        empty: The same without anything that moves; None takes the mean over the capture.
        form: Name of the reader; None tells it by the files.
        sanitise: Clean each packet first: gain, outliers, timing and phase, so that packets agree
            and their mean says something. Absolute delays and levels are gone then.

    Returns:
        What to write into a dataset, and warnings of the readers.

    Raises:
        RfgsError: Files and devices do not go together, or a file cannot be read.
    """
    warnings: list[str] = []
    read = partial(_receivers, given=given, form=form, sanitise=sanitise, warnings=warnings)
    receivers = read(assign(given, files))
    _need_alike(receivers)
    times_s = [r.capture.time_s + given.offsets_s[d] for d, r in receivers.items()]
    plan = schedule(times_s, given.fps, given.rate_hz)
    used = used_antennas([receiver.channels.values for receiver in receivers.values()])
    first = next(iter(receivers.values())).channels
    radio = radio_of(given, first, used, plan.packet.shape[2], plan.interval_s)
    csi = _links(given, radio, list(receivers.values()), used, plan.packet)
    if empty is None:
        static = csi.mean(axis=(0, 1))
    else:
        rooms = read(assign(given, empty))
        _need_alike({**receivers, **{-1 - d: room for d, room in rooms.items()}})
        means = [room.channels.values.mean(axis=0, keepdims=True) for room in rooms.values()]
        only = np.zeros((len(rooms), 1, 1), np.int64)
        static = _arranged(given, radio, means, used, only)[0, 0]
    done = _prepared(given, radio, csi, static, receivers, plan, empty is None)
    if sanitise:
        reason = "asked for; absolute delays and levels are gone"
        done.guesses.append(guess(radio.name, "packets", "sanitised", reason))
    return done, warnings


def _receivers(
    assigned: dict[int, Path],
    given: CaptureLayout,
    form: str | None,
    sanitise: bool,
    warnings: list[str],
) -> dict[int, _Receiver]:
    found = {}
    for device, path in assigned.items():
        reading = read_capture(path, form)
        warnings += [f"{path.name}: {warning}" for warning in reading.warnings]
        if len(reading.captures) > 1:
            left = sum(len(capture) for capture in reading.captures[1:])
            warnings.append(
                f"{path.name}: {left} packets of {len(reading.captures) - 1} other formats are "
                "left out"
            )
        if tells_places(reading.largest):
            raise RfgsError(
                f"{path}: the file tells where its antennas were; import it without --layout"
            )
        capture = cleaned(reading.largest)[0] if sanitise else reading.largest
        found[device] = _Receiver(path, capture, channels_of(capture, 0, given.centre_hz))
    return found


def _need_alike(receivers: dict[int, _Receiver]) -> None:
    """Refuses receivers of different bands or antennas: one radio is alike in all devices."""
    rows = list(receivers.values())
    first = rows[0].channels
    for other in rows[1:]:
        one, two = first.values.shape[1:], other.channels.values.shape[1:]
        same = np.isclose(first.first_hz, other.channels.first_hz, atol=1.0)
        if one != two or not same:
            raise RfgsError(
                f"{other.path}: expected {' x '.join(map(str, one))} (rx, tx, subcarrier) from "
                f"{first.first_hz / 1e6:.3f} MHz like {rows[0].path.name}, found "
                f"{' x '.join(map(str, two))} from {other.channels.first_hz / 1e6:.3f} MHz; import "
                "them as radios of their own"
            )


def used_antennas(values: list[Complex64[np.ndarray, "time rx tx subcarrier"]]) -> np.ndarray:
    """RX antennas that any device heard anything with."""
    heard = np.any([value.any(axis=(0, 2, 3)) for value in values], axis=0)
    return np.flatnonzero(heard) if heard.any() else np.arange(len(heard))


def radio_of(
    given: CaptureLayout,
    channels: Channels,
    used: np.ndarray,
    samples: int = 1,
    interval_s: float = 0.0,
) -> Radio:
    """The radio that a device's channels come from.

    Args:
        given: Where the devices stood.
        channels: What one of them heard.
        used: RX antennas that any device heard anything with.
        samples: Packets of a frame.
        interval_s: Time between them [s].
    """
    freq_hz, half = channels.freq_hz, 0.5 * channels.spacing_hz
    own = any(device.role == "ACCESS_POINT" for device in given.devices)
    centre_hz = float(freq_hz.mean())
    step = int(np.diff(used).min()) if len(used) > 1 else 1
    spacing_m = given.rx_spacing_m or (0.5 * SPEED_OF_LIGHT / centre_hz if step > 1 else 0.0)
    return Radio(
        name=given.radio,
        freq_min_hz=float(freq_hz[0] - half),
        freq_max_hz=float(freq_hz[-1] + half),
        num_subcarriers=len(freq_hz),
        tx_rows=1,
        tx_cols=channels.values.shape[2],
        rx_rows=1,
        rx_cols=len(used),
        # A radar's own transmitter must not stand in its receiver.
        tx_offset_m=(0.0, 0.0, -0.01) if own else (0.0, 0.0, 0.0),
        rx_spacing_m=step * spacing_m,
        tx_spacing_m=given.tx_spacing_m,
        own_device_links="only" if len(given.devices) == 1 else "excluded",
        num_devices=len(given.devices),
        samples_per_frame=samples,
        sample_interval_s=interval_s,
    )


def _links(
    given: CaptureLayout,
    radio: Radio,
    receivers: list[_Receiver],
    used: np.ndarray,
    packet: np.ndarray,
) -> Complex64[np.ndarray, "frame sample tx rx subcarrier"]:
    return _arranged(given, radio, [r.channels.values for r in receivers], used, packet)


def _arranged(
    given: CaptureLayout,
    radio: Radio,
    values: list[np.ndarray],
    used: np.ndarray,
    packet: np.ndarray,
) -> Complex64[np.ndarray, "frame sample tx rx subcarrier"]:
    """Channels in the order of the layout's elements; zero where no link is."""
    elements = layout(radio, list(given.devices))
    shape = (*packet.shape[1:], *elements.measured.shape, radio.num_subcarriers)
    if math.prod(shape) > 2 * MOST_VALUES:
        raise RfgsError(
            f"{math.prod(shape)} values, at most {2 * MOST_VALUES} make a sequence; lower rate_hz "
            "in --layout, or cut the captures into pieces"
        )
    csi = np.zeros(shape, np.complex64)
    for number, (device, value) in enumerate(zip(given.receivers, values, strict=True)):
        # `read_layout` takes layouts alone in which who was heard is sure.
        (sender,) = given.senders(device)
        tx, rx = elements.block_of(sender, device)
        chosen = value[packet[number]][:, :, used]
        csi[:, :, tx, rx] = np.swapaxes(chosen, 2, 3)
    return csi


def _prepared(
    given: CaptureLayout,
    radio: Radio,
    csi: np.ndarray,
    static: np.ndarray,
    receivers: dict[int, _Receiver],
    plan: Schedule,
    mean: bool,
) -> Prepared:
    elements = layout(radio, list(given.devices))
    links = elements.measured
    distance_m = np.linalg.norm(elements.tx_xyz[:, None] - elements.rx_xyz, axis=-1)[links]
    level = csi[0][:, links]
    scale = scale_to_free_space(level, radio.centre_hz, float(np.median(distance_m)))
    first = next(iter(receivers.values()))
    guesses = [*given.guesses, guess(radio.name, "level", scale, "cards report their own units")]
    if mean:
        reason = "no capture of the empty room was given"
        guesses.append(guess(radio.name, "csi_static", "mean over the capture", reason))
    gaps = int((~plan.trusted).sum())
    if gaps:
        reason = "no packet was received near these times"
        guesses.append(guess(radio.name, "samples", f"{gaps} hold an older packet", reason))
    bounds = given.bounds_m
    if bounds is None:
        bounds = bounds_around([device.position_m for device in given.devices])
        guesses.append(guess(given.name, "bounds", bounds.round(2).tolist(), "not in the layout"))
    return Prepared(
        scene=given.name,
        radio=radio,
        devices=list(given.devices),
        csi=csi * np.float32(scale),
        static=(static * scale).astype(np.complex64)[None],
        measured=first.channels.measured,
        bounds_m=np.array(bounds, np.float64),
        fps=plan.fps,
        guesses=guesses,
        packet_arrays={
            "scale": np.array(scale),
            "packet": plan.packet,
            "packet_time_s": plan.packet_time_s,
            "trusted": plan.trusted,
            "subcarrier_of_bin": first.channels.place,
            "measured_subcarriers": first.channels.measured,
        },
    )
