# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numba
import numpy as np
import pytest

from dataset_factory.scene.bundle import Bundle
from dataset_factory.verify.closed_forms import error_db
from rfgs_core.radio import DevicePose, Radio, layout

MakeBundle = Callable[..., Bundle]
UPRIGHT = (1.0, 0.0, 0.0, 0.0)
TILTED = (0.8660254, 0.35, -0.25, 0.2549510)


def posed_body(bundle: Bundle, radio: Radio, devices: list[DevicePose]) -> tuple:
    """Scene with the body at frame 1 and its points, through the tracer's own steps."""
    from dataset_factory.trace import Tracer

    tracer = Tracer(bundle, radio, devices, depth=2)
    frame = bundle.frame(1)
    tracer._bodies.move(frame.vertices)
    return tracer, tracer._bodies.points(frame.vertices)


def bounced(tracer, points) -> np.ndarray:
    """Channel of the points by way of walls."""
    from dataset_factory.trace.base import Trace

    found = tracer._bounces.paths(points, tracer._environment.around)
    return tracer._bounced(points, Trace(np.zeros(0), None, [], points, None, found))


def straight_paths(tracer, points, elements, devices):
    """Sionna's own paths to points outside the skin and on, no wall involved."""
    from dataset_factory.trace.bounces.solver import Bounces
    from dataset_factory.trace.rays.paths import path_set
    from rfgs_core.radio.sites import centres

    scene, meshes = tracer._bodies.scene, tracer._environment.meshes
    bounces = Bounces(scene, meshes, elements, devices, depth=2, seed=1)
    bounces._hang(points.lifted)
    traced = bounces._solver(scene, max_depth=1, samples_per_sp=1, buffer_size_per_sp=16, seed=0)
    return path_set(traced, *centres(elements))


@pytest.mark.parametrize("quat", [UPRIGHT, TILTED], ids=["upright", "tilted"])
def test_direct_term_matches_the_solver(
    make_bundle: MakeBundle,
    small_radio: Radio,
    two_devices: list[DevicePose],
    coarse_capsule: tuple[np.ndarray, np.ndarray],
    quat: tuple[float, float, float, float],
) -> None:
    from dataset_factory.trace.bounces.solver import with_facets
    from dataset_factory.trace.people.sight import in_sight
    from rfgs_core.simulate.paths.steering import steer
    from rfgs_core.simulate.surface.direct import direct_channel

    radio = replace(small_radio, rx_rows=1, rx_cols=1, num_subcarriers=4)
    devices = [replace(device, quat_wxyz=quat) for device in two_devices]
    tracer, points = posed_body(make_bundle(static=[], mover=coarse_capsule), radio, devices)
    elements = layout(radio, devices)
    nodes = radio.freq_hz
    paths = straight_paths(tracer, points, elements, devices)
    paths = with_facets(paths, points, tracer._bodies.gamma(nodes), nodes, radio.centre_hz)
    solver = steer(paths, elements, radio.freq_hz, nodes)
    seen = in_sight(tracer._bodies.scene.mi_scene, points, elements)
    # Sionna casts its rays from outside the skin, so that is where both put the points.
    outside = replace(points, positions=points.lifted)
    ours = direct_channel(outside, seen, elements, devices, tracer._bodies.gamma(nodes), radio)
    assert error_db(ours, solver) < -80.0


def test_chunked_bounces_match_one_call(
    person_bundle: Bundle,
    small_radio: Radio,
    two_devices: list[DevicePose],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from dataset_factory.trace.bounces import solver as bounces

    tracer, points = posed_body(person_bundle, small_radio, two_devices)
    whole = bounced(tracer, points)
    monkeypatch.setattr(bounces, "CHUNK", 400)
    assert error_db(bounced(tracer, points), whole) < -100.0


def test_bounces_match_those_of_many_rays(
    person_bundle: Bundle, small_radio: Radio, two_devices: list[DevicePose]
) -> None:
    """Sionna's own solver with rays, tables and buffers that lose nothing in an empty room."""
    from sionna.rt.rcs import RCSSolver

    from dataset_factory.trace.bounces.follow import follow
    from dataset_factory.trace.bounces.solver import with_facets
    from dataset_factory.trace.rays.paths import path_set
    from rfgs_core.radio.sites import centres
    from rfgs_core.simulate.paths.steering import steer

    tracer, points = posed_body(person_bundle, small_radio, two_devices)
    fields = ("positions", "normals", "areas", "material")
    points = replace(points, **{name: getattr(points, name)[::16] for name in fields})
    ours, elements = bounced(tracer, points), layout(small_radio, two_devices)
    bounces, nodes = tracer._bounces, tracer._nodes
    bounces._hang(points.lifted)
    solver = RCSSolver(deterministic=True)
    traced = solver(
        tracer._bodies.scene, max_depth=2, samples_per_sp=20_000, buffer_size_per_sp=1000
    )
    paths = path_set(traced, *centres(elements))
    paths = paths.select((paths.kinds != 0).sum(axis=1) > 1)
    paths = follow(paths, points.positions)
    gamma = tracer._bodies.gamma(nodes)
    paths = with_facets(paths, points, gamma, nodes, small_radio.centre_hz)
    paths = tracer._walls.over_band(paths, nodes)
    theirs = steer(paths, elements, small_radio.freq_hz, nodes)
    assert len(paths) > 500
    assert error_db(ours, theirs) < -80.0


def test_two_walls_lose_no_path_to_a_small_table(
    person_bundle: Bundle,
    small_radio: Radio,
    two_devices: list[DevicePose],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Sionna looks the size up on its class, where it is small for this solver's time alone."""
    from sionna.rt.path_solvers.sb_candidate_generator import SBCandidateGenerator

    from dataset_factory.trace import Tracer
    from dataset_factory.trace.bounces import solver as bounces

    tracer = Tracer(person_bundle, small_radio, two_devices, depth=3)
    vertices = person_bundle.frame(1).vertices
    whole = tracer._bodies.points(vertices)
    assert whole is not None
    fields = ("positions", "normals", "areas", "material")
    points = replace(whole, **{name: getattr(whole, name)[::16] for name in fields})
    tracer._bodies.move(vertices)
    asked = []
    solve = bounces.JoiningSolver.__call__

    def watched(*args, **options):
        asked.append(SBCandidateGenerator.MIN_SPEC_COUNT_SIZE)
        return solve(*args, **options)

    monkeypatch.setattr(bounces.JoiningSolver, "__call__", watched)
    usual = bounced(tracer, points)
    monkeypatch.setattr(bounces, "TABLE", 1 << 20)
    assert error_db(usual, bounced(tracer, points)) < -80.0
    assert asked == [1 << 17, 1 << 20]
    assert SBCandidateGenerator.MIN_SPEC_COUNT_SIZE == 1_000_000


def test_settings_of_one_solver_do_not_reach_another(
    person_bundle: Bundle, small_radio: Radio, two_devices: list[DevicePose]
) -> None:
    from sionna.rt.path_solvers.sb_candidate_generator import SBCandidateGenerator

    for depth in (2, 3):
        from dataset_factory.trace import Tracer

        Tracer(person_bundle, small_radio, two_devices, depth=depth)
        assert SBCandidateGenerator.MIN_SPEC_COUNT_SIZE == 1_000_000


def test_nothing_is_traced_by_way_of_walls_where_there_are_none(
    make_bundle: MakeBundle,
    small_radio: Radio,
    two_devices: list[DevicePose],
    coarse_capsule: tuple[np.ndarray, np.ndarray],
) -> None:
    from dataset_factory.trace import Tracer

    bundle = make_bundle(static=[], mover=coarse_capsule)
    deep, direct = (Tracer(bundle, small_radio, two_devices, depth=depth) for depth in (2, 1))
    assert np.array_equal(deep.frame(bundle.frame(1)), direct.frame(bundle.frame(1)))
    assert deep._bounces is None


def test_bounced_elements_match_tracing_each_of_them(
    make_bundle: MakeBundle,
    small_radio: Radio,
    two_devices: list[DevicePose],
    coarse_capsule: tuple[np.ndarray, np.ndarray],
    three_sheets: list[tuple[np.ndarray, np.ndarray]],
) -> None:
    radio = replace(small_radio, rx_rows=2, rx_cols=2, own_device_links="excluded")
    single = replace(radio, rx_rows=1, rx_cols=1)
    bundle = make_bundle(static=three_sheets, mover=coarse_capsule)
    tracer, points = posed_body(bundle, radio, two_devices)
    ours = bounced(tracer, points)[0, 4::3]
    elements = layout(radio, two_devices).rx_xyz[4::3]
    alone = []
    for place in elements:
        devices = [two_devices[0], replace(two_devices[1], position_m=tuple(place.tolist()))]
        lone, _ = posed_body(bundle, single, devices)
        alone.append(bounced(lone, points)[0, 1])
    assert error_db(ours, np.stack(alone)) < -25.0


def test_frames_are_reciprocal(
    person_bundle: Bundle, small_radio: Radio, two_devices: list[DevicePose]
) -> None:
    from dataset_factory.trace import Tracer

    radio = replace(
        small_radio, rx_rows=1, rx_cols=1, tx_offset_m=(0.0, 0.0, 0.0), own_device_links="excluded"
    )
    csi = Tracer(person_bundle, radio, two_devices, depth=2).frame(person_bundle.frame(1))
    assert error_db(csi[0, 1], csi[1, 0]) < -60.0


def test_same_seed_gives_the_same_bytes_for_any_threads_and_order(
    person_bundle: Bundle, small_radio: Radio, two_devices: list[DevicePose]
) -> None:
    import drjit as dr

    from dataset_factory.trace import Tracer

    frames = [person_bundle.frame(1), person_bundle.frame(2)]
    before = dr.thread_count(), numba.get_num_threads()
    try:
        dr.set_thread_count(2)
        numba.set_num_threads(numba.config.NUMBA_NUM_THREADS)
        tracer = Tracer(person_bundle, small_radio, two_devices, depth=2, seed=0)
        first = [tracer.static(), *(tracer.frame(frame) for frame in frames)]
        dr.set_thread_count(1)
        numba.set_num_threads(1)
        tracer = Tracer(person_bundle, small_radio, two_devices, depth=2, seed=0)
        second = [tracer.frame(frames[1]), tracer.frame(frames[0]), tracer.static()][::-1]
    finally:
        dr.set_thread_count(before[0])
        numba.set_num_threads(before[1])
    assert [a.tobytes() for a in first] == [b.tobytes() for b in second]
    assert not np.array_equal(first[1], first[2])


def test_person_changes_the_channel_by_shadow_and_scatter(
    person_bundle: Bundle, small_radio: Radio, two_devices: list[DevicePose]
) -> None:
    from dataset_factory.trace import Tracer

    soft = Tracer(person_bundle, small_radio, two_devices, depth=1)
    hard = Tracer(person_bundle, small_radio, two_devices, depth=1, shadow="hard")
    frame = person_bundle.frame(1)
    static, with_person = soft.static(), soft.frame(frame)
    assert -60 < error_db(with_person, static) < 0
    assert not np.array_equal(hard.frame(frame), with_person)
    assert soft.timings["environment"] > 0 and soft.timings["people_direct"] > 0
    assert soft.timings["people_bounces"] == 0
