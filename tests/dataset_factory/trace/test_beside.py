# SPDX-License-Identifier: Apache-2.0
"""A body shades what passes on its own side of a wall, and nothing beyond the wall."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from conftest import sheet

from dataset_factory.bundle import Bundle
from rfgs_core.radio import DevicePose, Radio

#: The body stands at x = 1.7 in the first frame.
LINE_X_M = 1.0


def changed_db(bundle: Bundle, radio: Radio, devices: list[DevicePose]) -> float:
    """Change of the environment's channel by the body, against that channel."""
    from dataset_factory.trace import Tracer

    tracer = Tracer(bundle, replace(radio, num_subcarriers=4), devices, depth=1)
    trace, empty = tracer.trace(bundle.frame(1)), tracer.static()
    change = np.abs(trace.environment - empty)[tracer._layout.measured].max()
    return 20 * np.log10(max(change / np.abs(empty).max(), 1e-30))


@pytest.mark.parametrize(
    ("wall_x_m", "shaded"), [(None, True), (1.25, False), (0.6, True), (2.4, True)]
)
def test_only_a_wall_between_line_and_body_keeps_the_shadow_off(
    make_bundle: Callable[..., Bundle],
    small_radio: Radio,
    coarse_capsule: tuple[np.ndarray, np.ndarray],
    wall_x_m: float | None,
    shaded: bool,
) -> None:
    walls = [] if wall_x_m is None else [sheet((wall_x_m, 0, 0), (0, 4, 0), (0, 0, 2.6))]
    ends = [(LINE_X_M, 0.4, 1.0), (LINE_X_M, 3.6, 1.0)]
    devices = [DevicePose(f"device_{i}", xyz, (1.0, 0.0, 0.0, 0.0)) for i, xyz in enumerate(ends)]
    bundle = make_bundle(static=walls, mover=coarse_capsule, material="metal")
    found = changed_db(bundle, small_radio, devices)
    assert found > -50.0 if shaded else found < -120.0


def test_a_body_half_behind_a_table_is_beside(
    make_bundle: Callable[..., Bundle],
    small_radio: Radio,
    two_devices: list[DevicePose],
    coarse_capsule: tuple[np.ndarray, np.ndarray],
) -> None:
    """Segments on both sides of a wall tell which side a body is on; low walls hide a part."""
    from dataset_factory.trace import Tracer
    from dataset_factory.trace.beside import beside

    low = sheet((1.3, 0, 0), (0, 4, 0), (0, 0, 0.8))
    bundle = make_bundle(static=[low], mover=coarse_capsule, material="metal")
    tracer = Tracer(bundle, small_radio, two_devices, depth=1)
    before, after = [[0.3, 0.4, 0.3], [0.3, 3.6, 0.3]], [[1.5, 0.4, 0.3], [1.5, 3.6, 0.3]]
    places = bundle.frame(1).vertices
    scene = tracer._environment.scene.mi_scene
    half_hidden = beside(scene, np.array([before, after]), places)
    np.testing.assert_array_equal(half_hidden, [[True], [True]])
    legs = places[places[:, 2] < 0.7]
    np.testing.assert_array_equal(beside(scene, np.array([before, after]), legs), [[False], [True]])
    assert beside(scene, np.zeros((0, 2, 3)), places).shape == (0, 1)
