# SPDX-License-Identifier: Apache-2.0
"""Joints of articulated bodies are where the scenes' own code has them on anny's."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from rfgs_core.articulated import Body, people

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(find_spec("anny") is None, reason="needs anny"),
]


def test_joints_are_those_of_the_scenes(
    python: Callable[..., subprocess.CompletedProcess[str]], tmp_path: Path
) -> None:
    """Bodies that the space was not made of, described by their nearest coefficients."""
    python(Path(__file__).with_name("rig_joints.py"), tmp_path / "rig.npz", must_work=True)
    with np.load(tmp_path / "rig.npz") as found:
        space, bones = people(), found["heads"].shape[1]
        slope = space.components[:, -bones:].reshape(len(space.components), -1).T
        for heads, wanted in zip(found["heads"], found["joints"], strict=True):
            apart = (heads - space.mean[-bones:]).ravel() / 0.003
            matrix = np.concatenate([slope / 0.003, np.eye(slope.shape[1])])
            right = np.concatenate([apart, np.zeros(slope.shape[1])])
            body = space.body(np.linalg.lstsq(matrix, right, rcond=None)[0])
            # The definition of the joints alone, and then with what the shape space leaves out.
            exact = Body(body.vertices, body.faces, heads, body.weights)
            np.testing.assert_allclose(exact.joints17(exact.rest), wanted, atol=1e-4)
            off = np.linalg.norm(body.joints17(body.rest) - wanted, axis=1)
            assert off.max() < 0.015
