# SPDX-License-Identifier: Apache-2.0
"""Moving targets of sheet metal: plate, cube and sphere against physical optics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dataset_factory.verify.card import Curve, Group, Plot, Row, near, within
from dataset_factory.verify.description import Description, Device, Part, stepping
from dataset_factory.verify.physical_optics import (
    cross_section,
    cuboid,
    scattered,
    sphere_spread_m2,
)
from dataset_factory.verify.tracing import echoes, monostatic
from dataset_factory.verify.workshop import Workshop, devices_of
from rfgs_core.radio import Layout, Radio, layout, preset
from rfgs_core.radio.levels import decibels

#: Largest error of levels [dB], and of a plate's phase [deg] at 5.8 and at 62 GHz.
LEVEL_DB, SPHERE_DB, PHASE_DEG, PHASE_MM_DEG = 0.3, 0.5, 1.0, 5.0
#: A good conductor reflects with −1.
METAL = -1.0
PO = "physical optics, Balanis (1989), section 7.4, by quadrature"
PLATE_M, PLATE_AT = (0.32, 0.02, 0.32), (1.7, 2.1, 1.2)
CUBE_M, CUBE_AT = 0.4, (0.0, 0.0, 1.2)
RADIUS_M, SPHERE_AT = 0.3, (0.0, 0.0, 1.2)
BEFORE_M = 6.0
#: Orientations of the sphere, each seen from three sides: single views scatter by a decibel.
TURNS = 21
#: Angles of the cube [deg]: near broadside, then aslant.
YAWS_DEG = (0.0, 1.0, 2.0, 10.0, 14.0, 18.0, 22.0, 26.0, 30.0)


def _mover(part: Part) -> Part:
    """The part in two places 5 cm apart, since something must move."""
    x, y, z = part.at
    return stepping(replace(part, kind="AUTO"), [(x, y, z), (x + 0.05, y, z)])


def _device(name: str, azimuth_deg: float, elevation_deg: float) -> Device:
    """A device around the cube."""
    a, e = np.radians([azimuth_deg, elevation_deg])
    way = BEFORE_M * np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])
    x, y, z = (float(value) for value in np.array(CUBE_AT) + way)
    return Device(name, (x, y, z))


def plate(distance_m: float) -> Description:
    """A plate that faces a device along y."""
    x, y, z = PLATE_AT
    part = _mover(Part("plate", "box", PLATE_M, PLATE_AT, cells=4))
    return Description((part,), (Device("a", (x, y + distance_m, z)),))


def cube(cells: int) -> Description:
    """A cube of metal that turns from frame to frame, with devices around it."""
    part = Part("cube", "box", (CUBE_M, CUBE_M, CUBE_M), cells=cells, kind="AUTO")
    turning = stepping(part, [CUBE_AT] * len(YAWS_DEG), YAWS_DEG)
    places = ((0.0, 0.0), (0.0, 1.0), (0.0, 3.0), (0.0, 7.0), (30.0, 12.0), (45.0, 12.0))
    devices = tuple(_device(f"{n}", *place) for n, place in enumerate(places))
    return Description((turning,), devices, frames=len(YAWS_DEG))


def ball(cells: int) -> Description:
    """A ball of metal that turns from frame to frame, with devices in front, above and below."""
    size = 2 * RADIUS_M
    part = Part("ball", "ball", (size, size, size), cells=cells, kind="AUTO")
    devices = []
    for n, elevation in enumerate(np.radians([0.0, 40.0, -40.0])):
        out = RADIUS_M + BEFORE_M
        place = (out * float(np.cos(elevation)), 0.0, 1.2 + out * float(np.sin(elevation)))
        devices.append(Device(f"{n}", place))
    yaws = [17.0 * n for n in range(TURNS)]
    turning = stepping(part, [SPHERE_AT] * TURNS, yaws)
    return Description((turning,), tuple(devices), frames=TURNS)


def ball_sections(workshop: Workshop, radio: Radio, cells: int) -> np.ndarray:
    """Cross-sections of a ball over its geometric one, mean over the band, (frame, device).

    Args:
        workshop: Where scenes are built.
        radio: A monostatic radio, whose first eight subcarriers are taken.
        cells: Subdivisions of the ball's icosahedron.
    """
    found = echoes(workshop, workshop.bundle(ball(cells)), radio)[..., :8]
    spread = sphere_spread_m2(RADIUS_M, BEFORE_M)
    sigma = np.mean(cross_section(found, radio.freq_hz[:8], spread), axis=3)
    own = np.arange(sigma.shape[1])
    return sigma[:, own, own] / (np.pi * RADIUS_M**2)


def verify(workshop: Workshop) -> Group:
    """Traces plates at 5.8 and 62 GHz, a cube of two tessellations, and a sphere."""
    wifi = monostatic(preset("wifi"), 8)
    millimetres = monostatic(preset("mmwave"), 8, freq_min_hz=61.9e9, freq_max_hz=62.1e9)
    rows = _plate_far(workshop, wifi)
    rows += _plate(workshop, "5.8 GHz", wifi, PHASE_DEG)
    rows += _plate(workshop, "62 GHz", millimetres, PHASE_MM_DEG)
    cubes, plot = _cube(workshop, wifi)
    sphere, views = _sphere(workshop, replace(wifi, own_device_links="only"))
    return Group(
        "targets",
        "Plate, cube and sphere of metal",
        "Targets that move, as people do, so that they scatter from facets: a plate of 32 cm, a "
        "cube of 40 cm that turns (one quad per face, and 8 × 8), a sphere of 30 cm radius. Powers "
        "are means over the band and, of the cube, over the directions of a set, since physical "
        f"optics falls into nulls between them; of the sphere, over {3 * TURNS} views.",
        [*rows, *cubes, sphere],
        [plot, views],
    )


def _own(elements: Layout, channel: np.ndarray) -> np.ndarray:
    """Echoes to the first device from itself, shape (..., subcarrier)."""
    assert len(elements.tx_xyz) == len(elements.rx_xyz) == 1
    return channel[..., 0, 0, :]


def _plate_far(workshop: Workshop, radio: Radio) -> list[Row]:
    bundle = workshop.bundle(plate(12.0))
    found = echoes(workshop, bundle, radio)[0]
    elements = layout(radio, devices_of(bundle, radio))
    face = np.array([PLATE_AT[0], PLATE_AT[1] + PLATE_M[1] / 2, PLATE_AT[2]])
    ways = (np.linalg.norm(xyz[0] - face) for xyz in (elements.tx_xyz, elements.rx_xyz))
    sigma = cross_section(_own(elements, found), radio.freq_hz, float(np.prod(list(ways))))
    area, wavelength = PLATE_M[0] * PLATE_M[2], 299_792_458.0 / radio.freq_hz
    exact = decibels(float(np.mean(4 * np.pi * area**2 / wavelength**2)))
    got = decibels(float(np.mean(sigma)))
    source = "σ = 4πA²/λ², Knott et al., Radar Cross Section (2004)"
    return [near("plate, 12 m away, cross-section", exact, got, LEVEL_DB, "dBsm", source)]


def _plate(workshop: Workshop, name: str, radio: Radio, phase_deg: float) -> list[Row]:
    """Level and phase of a plate 2.5 m away."""
    bundle = workshop.bundle(plate(2.5))
    found = echoes(workshop, bundle, radio)[0]
    elements = layout(radio, devices_of(bundle, radio))
    ends = elements.tx_xyz[0], elements.rx_xyz[0]
    exact = METAL * scattered([cuboid(PLATE_M, PLATE_AT)], *ends, radio.freq_hz)
    got = _own(elements, found)
    level, measured = (decibels(float(np.mean(np.abs(h) ** 2))) for h in (exact, got))
    turned = abs(float(np.degrees(np.angle(np.sum(got * exact.conj())))))
    return [
        near(f"plate, {name}, level", level, measured, LEVEL_DB, "dB", PO),
        within(f"plate, {name}, phase error", turned, phase_deg, "°", PO),
    ]


def _cube(workshop: Workshop, radio: Radio) -> tuple[list[Row], Plot]:
    """Both tessellations against physical optics of the six faces, and against each other."""
    coarse, fine = cube(1), cube(8)
    bundle = workshop.bundle(coarse)
    elements = layout(radio, devices_of(bundle, radio))
    exact = np.stack([_cube_exact(elements, radio, yaw) for yaw in YAWS_DEG])
    # Powers, mean over the band: shape (frame, tx, rx).
    powers = [
        np.mean(np.abs(h) ** 2, axis=3)
        for h in (
            exact,
            echoes(workshop, bundle, radio),
            echoes(workshop, workshop.bundle(fine), radio),
        )
    ]
    rows = []
    for name, frames, pairs in (
        ("near broadside", slice(0, 3), ((0, 0), (1, 1))),
        ("10 to 30° aslant", slice(3, None), ((0, 0), (2, 2), (3, 3))),
        ("bistatic", slice(3, None), ((2, 4), (2, 5), (3, 4), (3, 5))),
    ):
        tx, rx = (list(column) for column in zip(*pairs, strict=True))
        po, one, many = (decibels(float(p[frames, tx, rx].mean())) for p in powers)
        rows.append(near(f"cube, {name}", po, one, LEVEL_DB, "dB", PO))
        rows.append(near(f"cube of 8 × 8 quads, {name}", po, many, LEVEL_DB, "dB", PO))
        label = f"cube, {name}, from 1 to 8 × 8 quads"
        rows.append(within(label, abs(many - one), LEVEL_DB, "dB", "its own tessellation"))
    yaws = np.array(YAWS_DEG)
    own = [decibels(p[:, 0, 0]) for p in powers]
    curves = [
        Curve("physical optics", yaws, own[0], "closed form"),
        Curve("one quad per face", yaws, own[1], "measured"),
        Curve("8 × 8 quads", yaws, own[2], "measured"),
    ]
    title = "Echo of a turning cube, mean over the band"
    return rows, Plot(title, "angle [°]", "|H|² [dB]", curves, LEVEL_DB)


def _cube_exact(elements: Layout, radio: Radio, yaw_deg: float) -> np.ndarray:
    """Physical optics of a turned cube: the antennas turned the other way around it."""
    a = np.radians(yaw_deg)
    back = np.array([[np.cos(a), np.sin(a), 0.0], [-np.sin(a), np.cos(a), 0.0], [0.0, 0.0, 1.0]])
    middle, box = np.array(CUBE_AT), [cuboid((CUBE_M,) * 3)]
    tx, rx = ((xyz - middle) @ back.T for xyz in (elements.tx_xyz, elements.rx_xyz))
    rows = [[METAL * scattered(box, t, r, radio.freq_hz) for r in rx] for t in tx]
    return np.array(rows)


def _sphere(workshop: Workshop, radio: Radio) -> tuple[Row, Plot]:
    """Mean over orientations of the mesh and over the band, and each of them."""
    sections = ball_sections(workshop, radio, 5)
    exact = decibels(np.pi * RADIUS_M**2)
    got = exact + decibels(float(sections.mean()))
    source = "geometrical optics, σ = πr²"
    row = near("sphere, mean cross-section", float(exact), float(got), SPHERE_DB, "dBsm", source)
    views = np.arange(sections.size, dtype=np.float64)
    curves = [
        Curve("πr²", views, np.full(sections.size, exact), "closed form"),
        Curve("each view", views, exact + decibels(sections.T.ravel()), "measured"),
    ]
    title = "Sphere: points on curved skin scatter about the mean of all views"
    return row, Plot(title, "view", "σ [dBsm]", curves)
