# SPDX-License-Identifier: Apache-2.0
"""The skeleton of anny's default body, so that motion is tested without building it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from blender_scenes.motion.score import Figure, Score
from blender_scenes.motion.skeleton import Skeleton, Surface


@pytest.fixture(scope="session")
def skeleton() -> Skeleton:
    """Bones of `Phenotype()`, to a tenth of a millimetre."""
    stored = json.loads(Path(__file__).with_name("skeleton.json").read_text())
    names, parents, heads = zip(*stored["bones"], strict=True)
    bone, points = zip(*stored["surface"], strict=True)
    surface = Surface(np.array(points), np.array([names.index(name) for name in bone]))
    return Skeleton(names, parents, np.array(heads), np.array(stored["heel_m"]), surface)


@pytest.fixture(scope="session")
def figure(skeleton: Skeleton) -> Figure:
    """Who moves in the tests."""
    return Figure(skeleton)


@pytest.fixture
def rng() -> np.random.Generator:
    """Random numbers of a fixed seed."""
    return np.random.default_rng(0)


@pytest.fixture(scope="session")
def joints_over() -> Callable[[Score, float], np.ndarray]:
    """Joints [time, bone, 3] of a whole score, every so many seconds."""

    def follow(score: Score, step_s: float) -> np.ndarray:
        times = np.arange(0, score.duration_s + step_s, step_s)
        return np.stack([score.figure.skeleton.joints(score.pose(float(t))) for t in times])

    return follow
