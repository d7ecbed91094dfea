# SPDX-License-Identifier: Apache-2.0
"""A body shades what passes on its own side of a wall, and nothing beyond the wall."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import trimesh

from dataset_factory.scene.bundle import Bundle
from rfgs_core.radio import DevicePose, Radio

Mesh = tuple[np.ndarray, np.ndarray]
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
    coarse_capsule: Mesh,
    make_sheet: Callable[..., Mesh],
    wall_x_m: float | None,
    shaded: bool,
) -> None:
    walls = [] if wall_x_m is None else [make_sheet((wall_x_m, 0, 0), (0, 4, 0), (0, 0, 2.6))]
    ends = [(LINE_X_M, 0.4, 1.0), (LINE_X_M, 3.6, 1.0)]
    devices = [DevicePose(f"device_{i}", xyz, (1.0, 0.0, 0.0, 0.0)) for i, xyz in enumerate(ends)]
    bundle = make_bundle(static=walls, mover=coarse_capsule, material="metal")
    found = changed_db(bundle, small_radio, devices)
    assert found > -50.0 if shaded else found < -120.0


def test_a_body_half_behind_a_table_is_beside(
    make_bundle: Callable[..., Bundle],
    small_radio: Radio,
    two_devices: list[DevicePose],
    coarse_capsule: Mesh,
    make_sheet: Callable[..., Mesh],
) -> None:
    """Segments on both sides of a wall tell which side a body is on; low walls hide a part."""
    from dataset_factory.trace import Tracer
    from dataset_factory.trace.rays.scene import visible
    from rfgs_core.simulate.shadow.in_view import segments_in_view

    low = make_sheet((1.3, 0, 0), (0, 4, 0), (0, 0, 0.8))
    bundle = make_bundle(static=[low], mover=coarse_capsule, material="metal")
    tracer = Tracer(bundle, small_radio, two_devices, depth=1)
    before, after = [[0.3, 0.4, 0.3], [0.3, 3.6, 0.3]], [[1.5, 0.4, 0.3], [1.5, 3.6, 0.3]]
    vertices, faces = bundle.frame(1).vertices, coarse_capsule[1]
    free = partial(visible, tracer._environment.scene.mi_scene)
    lines = np.array([before, after])
    half_hidden = segments_in_view(free, lines, vertices, faces)
    np.testing.assert_array_equal(half_hidden, [[True], [True]])
    legs = faces[(vertices[faces][:, :, 2] < 0.7).all(axis=1)]
    np.testing.assert_array_equal(segments_in_view(free, lines, vertices, legs), [[False], [True]])
    assert segments_in_view(free, np.zeros((0, 2, 3)), vertices, faces).shape == (0, 1)


def test_a_box_whose_corners_stick_in_floor_and_ceiling_is_in_sight(
    make_bundle: Callable[..., Bundle],
    small_radio: Radio,
    two_devices: list[DevicePose],
    make_sheet: Callable[..., Mesh],
) -> None:
    from dataset_factory.trace import Tracer
    from dataset_factory.trace.rays.scene import visible
    from rfgs_core.simulate.shadow.in_view import segments_in_view

    slabs = [make_sheet((0, 0, z), (4, 0, 0), (0, 4, 0)) for z in (0.0, 2.6)]
    tracer = Tracer(make_bundle(static=slabs), small_radio, two_devices, depth=1)
    box = trimesh.creation.box(bounds=[[1.5, 1.5, -0.01], [2.5, 2.5, 2.61]])
    free = partial(visible, tracer._environment.scene.mi_scene)
    line = np.array([[[0.3, 2.0, 1.0], [3.7, 2.0, 1.0]]])
    assert segments_in_view(free, line, np.array(box.vertices), np.array(box.faces)).all()


@pytest.mark.parametrize("driven_x_m", [1.25, 3.0])
def test_a_vehicle_between_keeps_the_shadow_off_like_a_wall(
    make_bundle: Callable[..., Bundle],
    small_radio: Radio,
    coarse_capsule: Mesh,
    make_sheet: Callable[..., Mesh],
    driven_x_m: float,
) -> None:
    """Frames move what moves by (1.7, 2.1, 0) m; the path table has the same shadows."""
    from dataset_factory.trace import Tracer

    panel = make_sheet((driven_x_m - 1.7, -2.1, 0), (0, 4, 0), (0, 0, 2.6))
    ends = [(LINE_X_M, 0.4, 1.0), (LINE_X_M, 3.6, 1.0)]
    devices = [DevicePose(f"device_{i}", xyz, (1.0, 0.0, 0.0, 0.0)) for i, xyz in enumerate(ends)]
    bundle = make_bundle(static=[], mover=coarse_capsule, vehicle=panel)
    tracer = Tracer(bundle, replace(small_radio, num_subcarriers=4), devices, depth=1)
    frame = bundle.frame(1)
    trace = tracer.trace(frame)
    straight = (trace.paths.kinds == 0).all(axis=1) & (trace.paths.tx != trace.paths.rx)
    assert straight.any()
    (outline,) = trace.outlines
    assert outline.in_view[straight, 0].any() == (driven_x_m > 1.7)
    table, empty = tracer.paths(frame, trace), tracer.static_paths()
    levels = [
        np.abs(rows.amplitude[(rows.kind == 0).all(axis=1) & (rows.tx_site != rows.rx_site)]).max()
        for rows in (table, empty)
    ]
    assert (abs(levels[0] / levels[1] - 1) > 1e-3) == (driven_x_m > 1.7)
