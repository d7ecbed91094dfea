# SPDX-License-Identifier: Apache-2.0
"""Both tracers on the same scene bundle: how far they differ, and how long they take."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dataset_factory.plan.contents import frame_runs
from dataset_factory.scene.blender import Blender
from dataset_factory.scene.bundle import Bundle, read_bundle
from dataset_factory.scene.catalogue import Scene
from dataset_factory.scene.devices import choose_devices
from rfgs_core.frames import parse_frames
from rfgs_core.radio import Layout, layout, preset
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.delay import delay_profile, hann
from rfgs_core.radio.levels import decibels

#: Directions that delay–angle powers are taken in.
_BEAMS = 96


@dataclass(frozen=True)
class TracerRow:
    """The fast tracer beside Sionna RT, in one scene at one radio and depth."""

    scene: str
    """Name of the scene."""
    radio: str
    """Preset."""
    depth: int
    """Interactions of people's paths."""
    frames: int
    """Frames compared."""
    seen: bool
    """Whether anybody shows in Sionna RT's channel; if not, what follows of ΔH is 0."""
    static_db: float
    """Error power of `csi_static` over its power [dB]."""
    static_worst_db: float
    """The same of the worst device pair [dB]."""
    people_db: float
    """Error power of ΔH over its power [dB]."""
    people_worst_db: float
    """The same of the worst device pair [dB]."""
    level_db: float
    """Power of the fast tracer's ΔH over that of Sionna's [dB]."""
    correlation: float
    """Of the delay–angle powers of ΔH."""
    sionna_s: float
    """CPU time of a frame, median [s]."""
    fast_s: float
    """That of the fast tracer [s]."""
    ratio: float
    """Sionna's over the fast tracer's."""


def export_frames(scene: Scene, folder: Path, count: int) -> Bundle:
    """Exports some frames of a scene, evenly spread over its range."""
    every = parse_frames(scene.frames)
    picked = np.unique(np.linspace(0, len(every) - 1, count + 2).round().astype(int)[1:-1])
    runs = frame_runs([every[i] for i in picked])
    Blender(scene.blend).run("export", "--out", str(folder), "--frames", runs[0])
    return read_bundle(folder)


def compare_tracers(
    bundle: Bundle, scene: str, radio_name: str, depth: int, say: Callable[[str], None]
) -> TracerRow:
    """Traces a bundle's frames with both tracers, on one thread.

    Args:
        bundle: The scene.
        scene: Its name.
        radio_name: Preset.
        depth: Interactions of people's paths.
        say: Told what is under way.
    """
    from dataset_factory.trace import FastBundleTracer, Tracer

    radio = preset(radio_name)
    devices = choose_devices(bundle, radio)[0]
    elements = layout(radio, devices)
    traced, still, seconds = [], [], []
    for kind in (Tracer, FastBundleTracer):
        say(f"{scene}, {radio_name}, depth {depth}: {kind.__name__}")
        tracer: Any = kind(bundle, radio, devices, depth=depth)
        static = tracer.static().astype(np.complex128)
        # Compilers work in the first frame; it does not count.
        tracer.frame(bundle.frame(bundle.frames[0]))
        rows, spent = [], []
        for frame in bundle.frames:
            start = time.process_time()
            rows.append(tracer.frame(bundle.frame(frame)) - static)
            spent.append(time.process_time() - start)
        traced.append(np.stack(rows))
        still.append(static[None])
        seconds.append(float(np.median(spent)))
    # Behind concrete nothing of a person is left at 60 GHz.
    seen = _power(traced[0]) > 0.0
    people = _errors(traced[0], traced[1], elements) if seen else (0.0, 0.0)
    static = _errors(still[0], still[1], elements)
    powers = [_delay_angle_powers(change, elements, radio.freq_hz) for change in traced]
    return TracerRow(
        scene=scene,
        radio=radio_name,
        depth=depth,
        frames=len(bundle.frames),
        seen=seen,
        static_db=static[0],
        static_worst_db=static[1],
        people_db=people[0],
        people_worst_db=people[1],
        level_db=decibels(_power(traced[1]) / _power(traced[0])) if seen else 0.0,
        correlation=float(np.corrcoef(powers[0].ravel(), powers[1].ravel())[0, 1]) if seen else 0.0,
        sionna_s=seconds[0],
        fast_s=seconds[1],
        ratio=seconds[0] / seconds[1],
    )


def as_table(rows: list[TracerRow]) -> str:
    """The rows as a Markdown table."""
    lines = [
        "| scene | radio | depth | csi_static [dB] | worst pair | ΔH [dB] | worst pair "
        "| level [dB] | delay–angle correlation | Sionna RT [s] | fast [s] | ratio |",
        "|" + "---|" * 12,
    ]
    for row in rows:
        people = (
            f"{row.people_db:.1f} | {row.people_worst_db:.1f} | {row.level_db:+.2f} "
            f"| {row.correlation:.4f}"
        )
        lines.append(
            f"| {row.scene} | {row.radio} | {row.depth} | {row.static_db:.0f} "
            f"| {row.static_worst_db:.0f} | {people if row.seen else 'nobody | shows | – | –'} "
            f"| {row.sionna_s:.2f} | {row.fast_s:.3f} | {row.ratio:.0f} |"
        )
    return "\n".join(lines) + "\n"


def as_numbers(rows: list[TracerRow]) -> dict[str, Any]:
    """The rows as one flat dictionary."""
    flat: dict[str, Any] = {}
    for row in rows:
        values = asdict(row)
        name = f"{values.pop('scene')}.{values.pop('radio')}.depth{values.pop('depth')}"
        flat.update({f"{name}.{key}": value for key, value in values.items()})
    return flat


def _errors(expected: np.ndarray, found: np.ndarray, elements: Layout) -> tuple[float, float]:
    """Error power over power [dB], of all links and of the worst device pair that has any."""
    ratios = []
    for a, b in elements.device_pairs:
        here = elements.links_between(a, b) & elements.measured
        power = _power(expected[:, here])
        if power > 0.0:
            ratios.append(_power((found - expected)[:, here]) / power)
    every = _power(found - expected) / max(_power(expected), 1e-300)
    return decibels(float(every)), decibels(float(max(ratios, default=0.0)))


def _power(values: np.ndarray) -> float:
    return float(np.sum(np.abs(values) ** 2))


def _delay_angle_powers(change: np.ndarray, elements: Layout, freq_hz: np.ndarray) -> np.ndarray:
    """Powers over delay in beams of both ends, shape (frame, pair, beam, delay)."""
    k = 2.0 * np.pi * float(freq_hz.mean()) / SPEED_OF_LIGHT
    n = np.arange(_BEAMS) + 0.5
    # Directions evenly spread over the sphere: the golden angle around, equal steps in height.
    height, turn = 1.0 - 2.0 * n / _BEAMS, np.pi * (1.0 + np.sqrt(5.0)) * n
    flat = np.sqrt(1.0 - height**2)
    beams = np.stack([flat * np.cos(turn), flat * np.sin(turn), height], axis=1)
    tx, rx = (np.exp(-1j * k * xyz @ beams.T) for xyz in (elements.tx_xyz, elements.rx_xyz))
    rows = []
    for a, b in elements.device_pairs:
        here, there = elements.block_of(a, b)
        steered = np.einsum("ftrn,rb->ftbn", change[:, here, there], rx[there[0]])
        # Every beam of the receiver with that of the transmitter in the same direction.
        steered = np.einsum("ftbn,tb->fbn", steered, tx[here[:, 0]])
        rows.append(np.abs(delay_profile(steered, hann(len(freq_hz)))) ** 2)
    return np.stack(rows, axis=1)
