# SPDX-License-Identifier: Apache-2.0
"""A synthetic aperture, traced: a point's history, the twin of standing radios, focusing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from dataset_factory.scene.bundle import Bundle
from rfgs_core.encode.matched_filter import aperture_filter
from rfgs_core.errors import RfgsError
from rfgs_core.radio import Radio, devices_at, frame_samples, place_devices, preset
from rfgs_core.radio.constants import SPEED_OF_LIGHT

MakeBundle = Callable[..., Bundle]


@pytest.fixture
def aperture() -> Radio:
    """Twelve places, and a band that is traced at few frequencies."""
    return replace(
        preset("sar"),
        name="small",
        freq_min_hz=8.0e9,
        freq_max_hz=8.24e9,
        num_subcarriers=8,
        heights_m=(1.2,),
        samples_per_frame=12,
    )


def ball(radius_m: float) -> tuple[np.ndarray, np.ndarray]:
    """A ball around (0, 0, 1.2)."""
    made = trimesh.creation.icosphere(subdivisions=4, radius=radius_m)
    vertices = made.vertices + np.array([0.0, 0.0, 1.2])
    return vertices.astype(np.float32), made.faces.astype(np.int32)


def test_a_ball_turns_the_phase_and_fades_as_its_range_tells(
    make_bundle: MakeBundle, aperture: Radio
) -> None:
    from dataset_factory.trace import ApertureTracer

    radius_m = 0.1
    bundle = make_bundle(static=[], mover=ball(radius_m))
    devices = place_devices(aperture, bundle.bounds_m)
    tracer = ApertureTracer(bundle, aperture, devices, depth=1)
    change = (tracer.samples(bundle.frame(1)) - tracer.static())[:, 0, 0]
    assert change.shape == (12, 8)
    samples = frame_samples(aperture, 10.0, devices)
    assert samples.tx_xyz is not None and samples.rx_xyz is not None
    at = np.array([1.7, 2.1, 1.2])
    out = np.linalg.norm(samples.tx_xyz[:, 0] - at, axis=1)
    back = np.linalg.norm(samples.rx_xyz[:, 0] - at, axis=1)
    assert np.ptp(out + back) > 1.0
    # From every place the nearest skin answers, a radius before the centre.
    path_m = out + back - 2.0 * radius_m
    wavenumber = 2 * np.pi * aperture.freq_hz / SPEED_OF_LIGHT
    turned = change * np.exp(1j * wavenumber * path_m[:, None])
    # What is left is the ball's own echo, the same from all sides but for its few facets.
    level = np.abs(turned) * (out * back)[:, None]
    assert level.std(axis=0).max() < 0.15 * level.mean()
    assert np.abs(np.angle(turned / turned.mean(axis=0))).max() < 0.3
    # The slope over the subcarriers is the delay.
    steps = np.angle(turned[:, 1:] / turned[:, :-1]).mean(axis=1)
    assert np.abs(steps / np.diff(wavenumber)[0]).max() < 0.03


@pytest.mark.slow
def test_every_place_is_a_radio_that_stands_there(person_bundle: Bundle, aperture: Radio) -> None:
    from dataset_factory.trace import ApertureTracer, Tracer

    radio = replace(aperture, samples_per_frame=10)
    devices = place_devices(radio, person_bundle.bounds_m)
    tracer = ApertureTracer(person_bundle, radio, devices, depth=1)
    frame, static = person_bundle.frame(1), tracer.static()
    pulses = tracer.samples(frame)
    # More places than are traced at once, so the last stands in another group than the first.
    place = 9
    alone = replace(radio, antennas_move=False, samples_per_frame=1)
    twin = Tracer(person_bundle, alone, devices_at(radio, devices, place), depth=1)
    # Which of the weakest ways through walls are found is up to the rays of each group.
    empty, echo = twin.static(), twin.frame(frame) - twin.static()
    assert np.abs(static[place] - empty).max() < 1e-3 * np.abs(empty).max()
    difference = pulses[place] - static[place] - echo
    assert np.abs(difference).max() < 1e-2 * np.abs(echo).max()
    assert np.array_equal(pulses, tracer.samples(frame))


@pytest.mark.slow
def test_a_traced_ball_is_focused_where_it_is(make_bundle: MakeBundle, aperture: Radio) -> None:
    from dataset_factory.trace import ApertureTracer

    radio = replace(aperture, samples_per_frame=48)
    bundle = make_bundle(static=[], mover=ball(0.03))
    devices = place_devices(radio, bundle.bounds_m)
    tracer = ApertureTracer(bundle, radio, devices, depth=1)
    change = (tracer.samples(bundle.frame(2)) - tracer.static())[:, 0, 0]
    samples = frame_samples(radio, 10.0, devices)
    assert samples.tx_xyz is not None and samples.rx_xyz is not None
    # Once around it, an aperture resolves a quarter of a wavelength whatever the bandwidth.
    across = [np.arange(1.9, 2.5, 0.005), np.arange(1.5, 2.1, 0.005), np.array([1.2])]
    grid = np.stack(np.meshgrid(*across, indexing="ij"), axis=-1).reshape(-1, 3)
    level = np.abs(
        aperture_filter(change, samples.tx_xyz[:, 0], samples.rx_xyz[:, 0], radio.freq_hz, grid)
    )
    strongest = grid[np.argmax(level)]
    assert np.linalg.norm(strongest - [2.2, 1.8, 1.2]) < 0.04


def test_walls_seen_by_way_of_people_are_refused(person_bundle: Bundle, aperture: Radio) -> None:
    from dataset_factory.trace import ApertureTracer

    devices = place_devices(aperture, person_bundle.bounds_m)
    with pytest.raises(RfgsError, match="not traced for antennas that move; use --depth 1"):
        ApertureTracer(person_bundle, aperture, devices, depth=2)
