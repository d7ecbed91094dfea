# SPDX-License-Identifier: Apache-2.0
"""Channels between frames: Doppler, exactness of lengths, agreement with tracing again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from bundle_files import describe_bundle

from dataset_factory.scene.bundle import Bundle, read_bundle
from dataset_factory.verify.closed_forms import error_db
from rfgs_core.errors import RfgsError
from rfgs_core.radio import DevicePose, Radio, frame_samples
from rfgs_core.radio.constants import SPEED_OF_LIGHT

MakeBundle = Callable[..., Bundle]
FRAME_S = 0.1


def in_motion(bundle: Bundle, velocity: tuple[float, float, float], span_s: float = 0.0) -> Bundle:
    """The same bundle, everything that moves going straight on after each frame [m/s]."""
    offsets = np.arange(1, 6) / 5 * (span_s or FRAME_S)
    for frame in bundle.frames:
        path = bundle.path / "frames" / f"{frame:06d}.npz"
        with np.load(path) as stored:
            arrays = dict(stored)
        way = offsets[:, None, None] * np.asarray(velocity)
        poses = (arrays["vertices"] + way).astype(np.float32)
        np.savez(path, **{**arrays, "pose_offset_s": offsets, "pose_vertices": poses})
    row = {"span_s": span_s, "offset_s": offsets.tolist()}
    describe_bundle(bundle.path, {**bundle.info, "poses": [row]})
    return read_bundle(bundle.path)


def plate(side: float = 0.12, cells: int = 6) -> tuple[np.ndarray, np.ndarray]:
    """A square plate in the y-z plane around (0, 0, 1.2) that faces −x."""
    y, z = np.meshgrid(*[np.linspace(-side / 2, side / 2, cells + 1)] * 2, indexing="ij")
    vertices = np.stack([np.zeros_like(y), y, z + 1.2], axis=-1).reshape(-1, 3)
    at = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    a, b, c, d = (part.ravel() for part in (at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]))
    faces = np.concatenate([np.stack([a, c, b], 1), np.stack([a, d, c], 1)])
    return vertices.astype(np.float32), faces.astype(np.int32)


def off_axis(paths) -> np.ndarray:
    """How far the turn at each corner is from an axis-parallel one, shape (path, depth)."""
    ways = np.diff(paths.vertices, axis=1)
    k = ways / np.maximum(np.linalg.norm(ways, axis=2, keepdims=True), 1e-12)
    return np.sort(np.abs(k[:, 1:] - k[:, :-1]), axis=2)[:, :, 1]


@pytest.mark.parametrize("speed_m_s", [-1.5, 0.8])
def test_plate_turns_the_phase_by_its_doppler(
    make_bundle: MakeBundle, small_radio: Radio, speed_m_s: float
) -> None:
    from dataset_factory.trace import Tracer

    # Receding along x, so that phase falls by 2π · 2v/λ per second at every subcarrier.
    bundle = in_motion(make_bundle(static=[], mover=plate()), (speed_m_s, 0.0, 0.0))
    radio = replace(
        small_radio,
        rx_rows=1,
        rx_cols=1,
        tx_offset_m=(0.0, 0.02, 0.0),
        own_device_links="only",
        samples_per_frame=20,
    )
    # The plate's first frame is at (1.7, 2.1): straight ahead of the device, 8 m away.
    device = DevicePose("radar", (-6.3, 2.09, 1.2), (1.0, 0.0, 0.0, 0.0))
    tracer = Tracer(bundle, radio, [device], depth=1)
    changes = tracer.samples(bundle.frame(1))[:, 0, 0] - tracer.static()[0, 0]
    phase = np.unwrap(np.angle(changes), axis=0)
    times_s = frame_samples(radio, 1 / FRAME_S).offset_s
    slope = np.polyfit(times_s, phase, 1)[0]
    doppler_hz = 2.0 * speed_m_s * radio.freq_hz / SPEED_OF_LIGHT
    assert np.allclose(slope, -2.0 * np.pi * doppler_hz, rtol=2e-3)


def test_moved_bounces_keep_the_law_of_reflection(
    person_bundle: Bundle, small_radio: Radio, two_devices: list[DevicePose]
) -> None:
    from dataset_factory.trace import Tracer
    from dataset_factory.trace.bounces.follow import follow
    from rfgs_core.radio.images import SCATTERING

    tracer = Tracer(person_bundle, small_radio, two_devices, depth=3)
    trace = tracer.trace_at(person_bundle.frame(1).vertices)
    assert trace.points is not None and trace.bounced is not None
    paths = trace.bounced.select(np.arange(0, len(trace.bounced), 50))
    shift = np.array([0.012, -0.007, 0.004])
    moved = follow(paths, trace.points.positions + shift)
    specular = paths.mirrors()
    assert specular.sum(axis=1).max() == 2 and len(paths) > 200
    # Walls of the room are x, y or z = constant: a corner keeps that coordinate …
    drift = np.abs(moved.vertices - paths.vertices)[:, 1:-1][specular]
    assert drift.min(axis=1).max() < 1e-5
    # … mirrors the way there, as well as the trace does in single precision …
    assert (off_axis(moved)[specular] < off_axis(paths)[specular] + 1e-4).all()
    ways = np.diff(moved.vertices, axis=1)
    # … and the spreading of both legs sets the amplitude.
    at = np.argmax(paths.kinds == SCATTERING, axis=1)
    legs = [
        np.where(np.arange(ways.shape[1]) <= at[:, None], np.linalg.norm(w, axis=2), 0.0).sum(1)
        for w in (np.diff(paths.vertices, axis=1), ways)
    ]
    whole = [paths.length_m, moved.length_m]
    ratio = legs[0] / legs[1] * (whole[0] - legs[0]) / (whole[1] - legs[1])
    assert np.allclose(moved.amplitude[:, 0, 0] / paths.amplitude[:, 0, 0], ratio, rtol=1e-9)
    assert np.array_equal(follow(paths, trace.points.positions).kinds, paths.kinds)
    assert np.allclose(follow(paths, trace.points.positions).vertices, paths.vertices, atol=1e-6)


def test_packets_agree_with_tracing_each_of_them(
    make_bundle: MakeBundle,
    small_radio: Radio,
    two_devices: list[DevicePose],
    coarse_capsule: tuple[np.ndarray, np.ndarray],
) -> None:
    from dataset_factory.scene.motion import read_motion
    from dataset_factory.trace import Tracer

    bundle = in_motion(make_bundle(mover=coarse_capsule), (0.9, -0.6, 0.0))
    radio = replace(
        small_radio, rx_rows=1, rx_cols=1, own_device_links="excluded", samples_per_frame=4
    )
    tracer = Tracer(bundle, radio, two_devices, depth=2)
    frame = bundle.frame(1)
    packets, motion = tracer.samples(frame), read_motion(bundle, 1, 0.0)
    assert np.array_equal(packets[0], tracer.frame(frame))
    dense = []
    for time_s in frame_samples(radio, 1 / FRAME_S).offset_s:
        pose = motion.at(time_s).astype(np.float32)
        dense.append(tracer.frame(replace(frame, vertices=pose)))
    static = tracer.static()
    found = error_db(packets - static, np.stack(dense) - static)
    held = error_db(np.stack([packets[0]] * 4) - static, np.stack(dense) - static)
    assert found < -20.0 and held > found + 15.0


def test_vehicles_are_traced_at_every_packet(
    make_bundle: MakeBundle, small_radio: Radio, two_devices: list[DevicePose]
) -> None:
    from dataset_factory.scene.motion import read_motion
    from dataset_factory.trace import Tracer

    vertices, faces = plate(side=1.5, cells=1)
    steel = (vertices @ np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]], np.float32), faces)
    bundle = in_motion(make_bundle(static=[], vehicle=steel), (0.0, 8.0, 0.0))
    tracer = Tracer(bundle, replace(small_radio, samples_per_frame=3), two_devices, depth=1)
    frame, motion = bundle.frame(1), read_motion(bundle, 1, 0.0)
    packets = tracer.samples(frame)
    for packet, time_s in zip(
        packets, frame_samples(tracer._radio, 1 / FRAME_S).offset_s, strict=True
    ):
        pose = motion.at(float(time_s)).astype(np.float32)
        assert np.array_equal(packet, tracer.frame(replace(frame, vertices=pose)))
    assert not np.array_equal(packets[1], packets[2])


def test_packets_without_poses_are_refused(
    person_bundle: Bundle, small_radio: Radio, two_devices: list[DevicePose]
) -> None:
    from dataset_factory.trace import Tracer

    tracer = Tracer(person_bundle, replace(small_radio, samples_per_frame=2), two_devices, depth=1)
    with pytest.raises(RfgsError, match="no poses over 0 s"):
        tracer.samples(person_bundle.frame(1))
