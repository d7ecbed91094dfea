# SPDX-License-Identifier: Apache-2.0
"""Doppler shifts of a sphere that comes, goes, passes across, and between two devices."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dataset_factory.verify.card import Curve, Group, Plot, Row, near
from dataset_factory.verify.closed_forms import C, sphere_path_m
from dataset_factory.verify.description import Description, Device, Part, Place, stepping
from dataset_factory.verify.tracing import monostatic, single
from dataset_factory.verify.workshop import Workshop, devices_of
from rfgs_core.radio import Radio, frame_samples, layout, pose_span_s, preset
from rfgs_core.radio.path_table import PathTable

#: Largest error of a Doppler shift, as a share of the largest that this speed can have.
SHARE = 0.02
RADIUS_M, FPS = 0.3, 10
SOURCE = "f = −(d/dt path length)/λ, Fermat's shortest way by the sphere"
#: Where the sphere is at the first frame [m], and its velocity [m/s].
WAYS: dict[str, tuple[Place, Place]] = {
    "approaching": ((3.2, 0.0, 1.2), (-1.2, 0.0, 0.0)),
    "receding": ((2.4, 0.0, 1.2), (1.2, 0.0, 0.0)),
    "across": ((3.0, -0.06, 1.2), (0.0, 1.2, 0.0)),
    "bistatic": ((2.2, 2.4, 1.3), (0.7, -1.0, 0.0)),
}


def scene(way: str) -> Description:
    """The sphere on its way over three frames; two devices where it is bistatic."""
    start, velocity = (np.array(values) for values in WAYS[way])
    part = Part("ball", "ball", (2 * RADIUS_M, 2 * RADIUS_M, 2 * RADIUS_M), cells=5, kind="AUTO")
    places = [_place(start + velocity * n / FPS) for n in range(3)]
    if way == "bistatic":
        devices = (
            Device("a", (0.0, 0.0, 1.2), role="TRANSMITTER"),
            Device("b", (4.0, 0.4, 1.9), role="RECEIVER"),
        )
    else:
        devices = (Device("a", (0.0, 0.0, 1.2)),)
    return Description((stepping(part, places),), devices, frames=3, fps=FPS)


def _place(xyz: np.ndarray) -> Place:
    x, y, z = (float(value) for value in xyz)
    return x, y, z


def verify(workshop: Workshop) -> Group:
    """Traces the packets of a frame of each way, and reads the path table's column."""
    wifi = monostatic(preset("wifi"), 4, samples_per_frame=25)
    chirps = monostatic(preset("mmwave"), 4, samples_per_frame=64)
    rows, plots = [], []
    for way in WAYS:
        radio = wifi
        if way == "bistatic":
            radio = single(preset("wifi"), num_subcarriers=4, samples_per_frame=25)
        found, plot = _packets(workshop, way, radio)
        rows.append(near(f"{way}, 5.8 GHz", *found, "Hz", SOURCE))
        plots.append(plot)
        if way in ("approaching", "receding"):
            found, _ = _packets(workshop, way, chirps)
            rows.append(near(f"{way}, 62 GHz", *found, "Hz", SOURCE))
        if workshop.tracer == "sionna":
            rows.append(_table_row(workshop, way, replace(radio, samples_per_frame=1)))
    return Group(
        "doppler",
        "Doppler shifts",
        "A sphere of metal, 30 cm in radius, at 1.2 m/s: packets within a frame (25 in 0.1 s at "
        "5.8 GHz, 64 chirps of 0.25 ms at 62 GHz), phase of csi − csi_static fitted over time; and "
        "`doppler_hz` of the path table, at its shortest path by the sphere. Positive where the "
        "path becomes shorter. Tolerance: 2 % of 2v/λ.",
        rows,
        plots,
    )


def _packets(workshop: Workshop, way: str, radio: Radio) -> tuple[tuple[float, float, float], Plot]:
    """Expected and found shift and its tolerance [Hz], and the phases over time."""
    span_s = pose_span_s(radio)
    bundle = workshop.bundle(scene(way), "--span", repr(span_s))
    devices = devices_of(bundle, radio)
    tracer = workshop.traced(bundle, radio, devices, depth=1, shadow="hard")
    echo = tracer.samples(bundle.frame(1)) - tracer.static()
    time_s = frame_samples(radio, bundle.fps).offset_s
    elements = layout(radio, devices)
    start, velocity = (np.array(values) for values in WAYS[way])
    path_m = np.array(
        [
            sphere_path_m(elements.tx_xyz[0], elements.rx_xyz[0], start + velocity * t, RADIUS_M)
            for t in time_s
        ]
    )
    middle = radio.num_subcarriers // 2
    wavelength = C / radio.freq_hz[middle]
    turns = np.unwrap(np.angle(echo[:, 0, 0, middle])) / (2.0 * np.pi)
    exact_hz, found_hz = (
        float(np.polyfit(time_s, values, 1)[0]) for values in (-path_m / wavelength, turns)
    )
    limit_hz = SHARE * 2.0 * float(np.linalg.norm(velocity)) / wavelength
    moved_mm = 1e3 * (path_m - path_m[0])
    curves = [
        Curve("Fermat", 1e3 * time_s, moved_mm, "closed form"),
        Curve("phase", 1e3 * time_s, -1e3 * wavelength * (turns - turns[0]), "measured"),
    ]
    title = f"Sphere {way}, {radio.centre_hz / 1e9:.1f} GHz"
    plot = Plot(title, "time [ms]", "change of path [mm]", curves)
    return (exact_hz, found_hz, limit_hz), plot


def _table_row(workshop: Workshop, way: str, radio: Radio) -> Row:
    """The path table's shift of the shortest path by the sphere."""
    from dataset_factory.trace import Tracer

    bundle = workshop.bundle(scene(way), "--velocities")
    devices = devices_of(bundle, radio)
    tracer = Tracer(bundle, radio, devices, depth=1, shadow="hard")
    # The middle frame: at the ends of the range velocities are one-sided differences.
    table = tracer.paths(bundle.frame(2))
    elements = layout(radio, devices)
    start, velocity = (np.array(values) for values in WAYS[way])
    step_s = 1e-4
    ends = elements.tx_xyz[0], elements.rx_xyz[0]
    before, after = (
        sphere_path_m(*ends, start + velocity * (1.0 / FPS + t), RADIUS_M)
        for t in (-step_s, step_s)
    )
    wavelength = C / radio.centre_hz
    exact_hz = -(after - before) / (2.0 * step_s) / wavelength
    limit_hz = SHARE * 2.0 * float(np.linalg.norm(velocity)) / wavelength
    found_hz = _shortest_hz(table)
    return near(f"{way}, 5.8 GHz, path table", exact_hz, found_hz, limit_hz, "Hz", SOURCE)


def _shortest_hz(table: PathTable) -> float:
    """Shift of the first arrival that met something, the straight way aside."""
    by_sphere = table.select(table.kind[:, 0] > 0)
    return float(by_sphere.doppler_hz[np.argmin(by_sphere.delay_s)])
