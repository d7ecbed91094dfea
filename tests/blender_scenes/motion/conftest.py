# SPDX-License-Identifier: Apache-2.0
"""The skeleton of anny's default body, so that motion is tested without building it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from blender_scenes.motion.score import Figure
from blender_scenes.motion.skeleton import Skeleton


@pytest.fixture(scope="session")
def skeleton() -> Skeleton:
    """Bones of `Phenotype()`, to a tenth of a millimetre."""
    stored = json.loads(Path(__file__).with_name("skeleton.json").read_text())
    names, parents, heads = zip(*stored["bones"], strict=True)
    return Skeleton(names, parents, np.array(heads), np.array(stored["heel_m"]))


@pytest.fixture(scope="session")
def figure(skeleton: Skeleton) -> Figure:
    """Who moves in the tests."""
    return Figure(skeleton)


@pytest.fixture
def rng() -> np.random.Generator:
    """Random numbers of a fixed seed."""
    return np.random.default_rng(0)
