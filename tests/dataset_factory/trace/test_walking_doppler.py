# SPDX-License-Identifier: Apache-2.0
"""The walking person of living_room_walk between video frames."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dataset_factory.scene.blender import Blender
from dataset_factory.scene.bundle import Bundle, read_bundle
from dataset_factory.scene.catalogue import find_scene
from dataset_factory.scene.devices import choose_devices
from dataset_factory.scene.motion import read_motion
from dataset_factory.verify.closed_forms import error_db
from rfgs_core.encode.micro_doppler import micro_doppler
from rfgs_core.radio import Layout, frame_samples, layout, preset
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.skeleton import JOINTS

WINDOW_S = 0.1
TORSO = [JOINTS.index(name) for name in ("pelvis", "spine", "thorax")]
LIMBS = [
    JOINTS.index(f"{side}_{name}") for side in ("left", "right") for name in ("ankle", "wrist")
]


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Bundle:
    """Eight frames of the walk with the poses between them."""
    out = tmp_path_factory.mktemp("walk") / "bundle"
    blender = Blender(find_scene("living_room_walk").blend)
    blender.run("export", "--out", str(out), "--frames", "14:21", "--span", "0.0")
    return read_bundle(out)


def closing_speeds(bundle: Bundle, elements: Layout, time_s: float) -> np.ndarray:
    """Half the rate at which the path by way of each vertex gets shorter [m/s], shape (V,)."""
    index = min(int(time_s * bundle.fps), len(bundle.frames) - 1)
    motion = read_motion(bundle, bundle.frames[index], 0.0)
    at_s, step_s = min(time_s - index / bundle.fps, 0.0999), 1e-4
    ends = np.stack([elements.tx_xyz[0], elements.rx_xyz[0]])
    before, after = (
        np.linalg.norm(motion.at(t)[:, None] - ends, axis=2).sum(axis=1)
        for t in (at_s, at_s + step_s)
    )
    return 0.5 * (before - after) / step_s


@pytest.mark.slow
def test_walk_shows_torso_and_limbs_at_the_speeds_of_the_animation(walk: Bundle) -> None:
    from dataset_factory.trace import Tracer

    radio = replace(
        preset("wifi"),
        rx_rows=1,
        rx_cols=1,
        num_subcarriers=8,
        own_device_links="only",
        samples_per_frame=50,
    )
    devices = choose_devices(walk, radio)[0][1:2]
    tracer = Tracer(walk, radio, devices, depth=1)
    change = np.concatenate([tracer.samples(walk.frame(f)) for f in walk.frames]) - tracer.static()
    starts_s = (np.array(walk.frames) - walk.frames[0]) / walk.fps
    times_s = (starts_s[:, None] + frame_samples(radio, walk.fps).offset_s).ravel()
    found = micro_doppler(change, times_s, radio.freq_hz, window_s=WINDOW_S)
    elements = layout(radio, devices)
    speeds = np.stack([closing_speeds(walk, elements, t) for t in found.time_s])
    first_corner, segment = walk.topology.faces[:, 0], walk.topology.segment
    joints = {j: speeds[:, first_corner[segment == j]].mean(axis=1) for j in TORSO + LIMBS}
    resolution = SPEED_OF_LIGHT / radio.centre_hz / (2.0 * WINDOW_S)

    # The strongest line over the whole walk is the torso's.
    torso = np.mean([joints[j] for j in TORSO])
    strongest = found.velocity_m_s[found.power.mean(axis=1).argmax()]
    assert strongest == pytest.approx(torso, abs=0.5 * resolution)
    lines, beyond = [], []
    for column, moving in enumerate(speeds):
        power, v = found.power[:, column], found.velocity_m_s
        # Nothing is faster than the animation, but for the main lobe of the Hann window …
        lobe = 2.0 * resolution
        outside = (v < moving.min() - lobe) | (v > moving.max() + lobe)
        assert power[outside].sum() < 10 ** (-20 / 10) * power.sum()
        limb = max(joints[j][column] for j in LIMBS)
        if limb < torso + 2.0 * resolution:
            continue
        # … and a swinging limb is a line at its own speed, apart from the torso's.
        lines.append(power[np.abs(v - limb) < 0.5 * resolution].max())
        beyond.append(power[outside].max())
        assert lines[-1] > 10 ** (-30 / 10) * power.max()
    # Single windows may catch a limb in a fade; over a swing it stands out clearly.
    assert len(lines) >= 10 and np.mean(lines) > 10.0 * np.mean(beyond)


@pytest.mark.slow
def test_packets_of_a_walk_agree_with_tracing_each_of_them(walk: Bundle) -> None:
    from dataset_factory.trace import Tracer

    radio = replace(preset("wifi"), rx_rows=1, rx_cols=2, num_subcarriers=16, samples_per_frame=10)
    devices = choose_devices(walk, radio)[0][:2]
    tracer = Tracer(walk, radio, devices, depth=2)
    frame, motion, static = walk.frame(20), read_motion(walk, 20, 0.0), tracer.static()
    packets = tracer.samples(frame)[1::2]
    times_s = frame_samples(radio, walk.fps).offset_s[1::2]
    dense = np.stack(
        [tracer.frame(replace(frame, vertices=motion.at(t).astype(np.float32))) for t in times_s]
    )
    # On what the person changes, not on the room that dwarfs it.
    assert error_db(packets - static, dense - static) < -20.0
    held = np.broadcast_to(tracer.frame(frame), dense.shape)
    assert error_db(held - static, dense - static) > -3.0
