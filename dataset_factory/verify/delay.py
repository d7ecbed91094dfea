# SPDX-License-Identifier: Apache-2.0
"""Where the delay profile of every preset peaks: the straight way, and the echo of a sphere."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from dataset_factory.scene.bundle import Bundle
from dataset_factory.verify.card import Curve, Group, Plot, within
from dataset_factory.verify.closed_forms import sphere_path_m
from dataset_factory.verify.description import Description, Device, Part, stepping
from dataset_factory.verify.tracing import Links, joined, links
from dataset_factory.verify.workshop import Workshop, devices_of
from rfgs_core.radio import PRESETS, Radio, layout
from rfgs_core.radio.delay import delay_profile, hann_between
from rfgs_core.radio.levels import amplitude_decibels

#: Points per delay cell that a profile is interpolated to.
_FINER = 32
RADIUS_M, CENTRE = 0.2, (2.6, 3.4, 1.4)
SOURCE = "delay = path length / c; Fermat's shortest way by the sphere"

#: A ball of metal between two devices, clear of their line of sight.
SCENE = Description(
    (
        stepping(
            Part("ball", "ball", (2 * RADIUS_M, 2 * RADIUS_M, 2 * RADIUS_M), cells=5, kind="AUTO"),
            [CENTRE, (CENTRE[0] + 0.1, CENTRE[1], CENTRE[2])],
        ),
    ),
    tuple(
        Device(f"{radio} {end}", place, yaw_deg, radio=radio)
        for radio in ("any", "uwb", "sar")
        for end, place, yaw_deg in (("a", (0.5, 0.6, 1.2), 30.0), ("b", (4.6, 1.1, 2.0), 150.0))
    ),
)


def verify(workshop: Workshop) -> Group:
    """Reads delays off the profiles of every link of every preset."""
    bundle, rows, plots = workshop.bundle(SCENE), [], []
    for name, radio in PRESETS.items():
        if not workshop.traces(radio):
            continue
        if radio.antennas_move:
            radio = replace(radio, samples_per_frame=2)
        # Half a range bin c/(2B) of range, which is half of the path there and back.
        limit_mm = 1e3 * 0.5 * radio.range_resolution_m
        static, change = _links(workshop, bundle, radio)
        ends, middle = zip(change.tx_xyz, change.rx_xyz, strict=True), np.array(CENTRE)
        echo_m = np.array([sphere_path_m(t, r, middle, RADIUS_M) for t, r in ends])
        for what, found, path_m in (
            ("straight way", static, static.distance_m),
            ("echo of a sphere", change, echo_m),
        ):
            off_mm = 1e3 * 0.5 * np.abs(peaks_m(found.channel, radio) - path_m)
            label = f"{name}, {what}, worst range"
            rows.append(within(label, float(off_mm.max()), limit_mm, "mm", SOURCE))
        if name in ("uwb", "mmwave"):
            plots.append(_plot(name, radio, change, echo_m))
    return Group(
        "delay",
        "Delay peaks of every preset",
        "Two devices and a sphere of metal, 20 cm in radius, in empty space. The peak of each "
        "measured link's delay profile (Hann window) beside the length of the straight way, and, "
        "for csi − csi_static, of the shortest way by the sphere. Tolerance: half a range bin, "
        "c/(4B).",
        rows,
        plots,
    )


def profile(channel: np.ndarray, radio: Radio) -> tuple[np.ndarray, np.ndarray]:
    """Path lengths [m], shape (n,), and amplitudes of delay profiles, shape (link, n)."""
    number = radio.num_subcarriers
    count = _FINER * number
    length_m = np.arange(count) * (radio.unambiguous_path_m / count)
    return length_m, np.abs(delay_profile(channel, hann_between(number), _FINER))


def peaks_m(channel: np.ndarray, radio: Radio) -> np.ndarray:
    """Path length at each profile's peak [m], by a parabola through three samples, (link,)."""
    length_m, amplitude = profile(channel, radio)
    top = amplitude.argmax(axis=1)
    row = np.arange(len(top))
    before, at, after = (amplitude[row, (top + k) % amplitude.shape[1]] for k in (-1, 0, 1))
    share = 0.5 * (before - after) / (before - 2.0 * at + after)
    return (top + share) * (length_m[1] - length_m[0])


def _links(workshop: Workshop, bundle: Bundle, radio: Radio) -> tuple[Links, Links]:
    """Links without the sphere, and what it adds to them in the first frame."""
    devices = devices_of(bundle, radio)
    still, moved = _traced(workshop, bundle, radio)
    pairs = [
        (links(elements, a), links(elements, b.astype(np.complex128) - a))
        for elements, a, b in zip(
            (layout(radio, devices, n) for n in range(len(still))), still, moved, strict=True
        )
    ]
    static, change = (joined(column) for column in zip(*pairs, strict=True))
    return static, change


def _traced(workshop: Workshop, bundle: Bundle, radio: Radio) -> Iterator[np.ndarray]:
    """Channels of all places without and with the sphere, shape (place, tx, rx, subcarrier)."""
    tracer = workshop.traced(bundle, radio, depth=1, shadow="hard")
    still, moved = tracer.static(), tracer.samples(bundle.frame(1))
    yield from (still, moved) if radio.antennas_move else (still[None], moved[:1])


def _plot(name: str, radio: Radio, found: Links, path_m: np.ndarray) -> Plot:
    """The profile of one link with the closed form's place marked."""
    length_m, amplitude = profile(found.channel[:1], radio)
    near = np.abs(length_m - path_m[0]) < 12.0 * radio.range_resolution_m
    level_db = amplitude_decibels(amplitude[0] / amplitude[0].max(), least=0.0)
    curves = [
        Curve("Fermat", np.full(2, path_m[0]), np.array([-60.0, 0.0]), "closed form"),
        Curve("csi − csi_static", length_m[near][::4], level_db[near][::4], "measured"),
    ]
    return Plot(f"Echo of the sphere, {name}", "path length [m]", "level [dB]", curves)
