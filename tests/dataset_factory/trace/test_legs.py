# SPDX-License-Identifier: Apache-2.0
"""The quick candidate generator against Sionna's own."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest
from sionna.rt.path_solvers.sb_candidate_generator import SBCandidateGenerator
from sionna.rt.path_solvers.sb_deterministic import SBDeterministicCandidateGenerator

from dataset_factory.bundle import Bundle
from dataset_factory.trace.legs import LegCandidates
from dataset_factory.trace.scene import environment_scene
from rfgs_core.radio import Radio

RAYS = 400


@pytest.fixture
def room(person_bundle: Bundle, small_radio: Radio) -> mi.Scene:
    return environment_scene(person_bundle, small_radio).mi_scene


def candidates(generator: SBCandidateGenerator, scene: mi.Scene, budget: int) -> list[np.ndarray]:
    """Every field of the candidates between scattered points and five devices."""
    rng = np.random.default_rng(3)
    points = rng.uniform((0.5, 0.5, 0.3), (3.5, 3.5, 2.2), (60, 3)).astype(np.float32)
    # The third and the last are outside, where only what has missed the walls is in sight.
    devices = np.array(
        [[0.4, 0.5, 1.2], [3.5, 3.6, 2.1], [5.0, 2.0, 1.0], [2.0, 0.1, 2.5], [2, 2, 4]], np.float32
    )
    paths = generator(
        scene,
        mi.Point3f(*points.T),
        mi.Point3f(*devices.T),
        samples_per_src=RAYS,
        max_num_paths_per_src=budget,
        max_depth=1,
        los=True,
        specular_reflection=True,
        diffuse_reflection=False,
        refraction=True,
        diffraction=False,
        edge_diffraction=False,
        seed=7,
    )
    paths.schedule()
    paths.shrink()
    fields = [paths.source_indices, paths.target_indices, paths.valid, *paths.k_tx, *paths.k_rx]
    fields += [paths.interaction_types, paths.shapes, paths.primitives, paths.probs]
    fields += [paths.vertices_x, paths.vertices_y, paths.vertices_z]
    return [np.array(field).ravel() for field in fields]


@pytest.mark.parametrize(
    ("budget", "table"),
    [(128, 4096), (12, 4096), (40, 40)],
    ids=["usual", "more than fit", "colliding"],
)
def test_same_candidates_in_the_same_order(room, monkeypatch, budget, table):
    monkeypatch.setattr(SBCandidateGenerator, "MIN_SPEC_COUNT_SIZE", table)
    usual = candidates(SBDeterministicCandidateGenerator(), room, budget)
    quick = candidates(LegCandidates(), room, budget)
    assert len(usual[0]) > 60
    for ours, theirs in zip(quick, usual, strict=True):
        np.testing.assert_array_equal(ours, theirs)
