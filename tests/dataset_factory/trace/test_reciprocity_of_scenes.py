# SPDX-License-Identifier: Apache-2.0
"""The static channel of each of our scenes: the same in both directions, and converged."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from dataset_factory.scene.blender import Blender
from dataset_factory.scene.bundle import Bundle, read_bundle
from dataset_factory.trace.setup import prepare
from rfgs_core.radio import DevicePose, Layout, layout, place_devices, preset
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.simulate.geometry import Faces, faces_of

prepare()

SCENES = sorted((Path(__file__).parents[3] / "blender_scenes").glob("*.blend"))


def exchanged(elements: Layout) -> Layout:
    """The same antennas, transmitters and receivers exchanged."""
    sides = {
        f"{side}_{what}": getattr(elements, f"{other}_{what}")
        for side, other in (("tx", "rx"), ("rx", "tx"))
        for what in ("xyz", "device", "site", "port", "quat_wxyz")
    }
    columns = np.zeros(len(elements.tx_xyz), dtype=np.int64)
    return replace(elements, measured=elements.measured.T, rx_column=columns, **sides)


def channel(
    bundle: Bundle,
    radio: str,
    devices: list[DevicePose],
    turn: Callable[[Layout], Layout],
    faces: Callable[..., Faces] = faces_of,
) -> np.ndarray:
    """Specular channel between centres of sites, shape (tx, rx, subcarrier)."""
    from dataset_factory.trace.environment import Environment

    spec = preset(radio)
    elements = turn(layout(spec, devices))
    paths = Environment(bundle, spec, elements, devices, seed=1, faces=faces).paths()
    shape = elements.tx_site.max() + 1, elements.rx_site.max() + 1, spec.num_subcarriers
    out = np.zeros(shape, dtype=complex)
    turned = np.exp(-2j * np.pi * spec.freq_hz * paths.length_m[:, None] / SPEED_OF_LIGHT)
    middle = paths.amplitude.shape[2] // 2
    np.add.at(out, (paths.tx, paths.rx), paths.amplitude[:, 0, middle, None] * turned)
    return out


def worst_db(found: np.ndarray, expected: np.ndarray) -> float:
    """Largest error of a pair, relative to that pair's power."""
    power = (np.abs(expected) ** 2).sum(axis=2)
    error = (np.abs(found - expected) ** 2).sum(axis=2)
    heard = power > 0
    assert heard.any() and not error[~heard].any()
    return float(10 * np.log10((error[heard] / power[heard]).max() + 1e-30))


@pytest.mark.slow
@pytest.mark.parametrize("radio", ["wifi", "mmwave"])
@pytest.mark.parametrize("blend", SCENES, ids=lambda path: path.stem)
def test_static_channel_of_every_scene_is_reciprocal(
    blend: Path, radio: str, tmp_path: Path
) -> None:
    Blender(blend).run("export", "--out", str(tmp_path / "bundle"), "--frames", "20:20")
    bundle = read_bundle(tmp_path / "bundle")
    devices = place_devices(preset(radio), np.array(bundle.bounds_m))
    there = channel(bundle, radio, devices, lambda elements: elements)
    back = channel(bundle, radio, devices, exchanged)
    assert worst_db(back.transpose(1, 0, 2), there) < -60.0
    denser = partial(faces_of, max_faces=20_000, sample_m=0.1)
    finer = channel(bundle, radio, devices, lambda elements: elements, denser)
    assert worst_db(there, finer) < -50.0
