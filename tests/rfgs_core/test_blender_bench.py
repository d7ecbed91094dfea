# SPDX-License-Identifier: Apache-2.0
"""The benchmark of the add-on runs in Blender, and its numbers are of real work."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import pytest

from rfgs_core.blender_bench import bench_blender
from rfgs_core.errors import MissingToolError

pytestmark = pytest.mark.skipif(find_spec("bpy") is None, reason="needs bpy")


@pytest.mark.slow
def test_arrays_beat_a_loop_over_points(monkeypatch: pytest.MonkeyPatch) -> None:
    """Sizes are taken at their word: counts come from the meshes in Blender."""
    monkeypatch.delenv("BLENDER", raising=False)
    numbers = bench_blender(None, 40_000, 5_000, 4, 1_000)
    counts = [numbers[name] for name in ("num_gaussians", "gaussians_per_frame", "frames")]
    assert counts == [40_000, 5_000, 4]
    assert numbers["import_ratio"] > 2 and numbers["points_ratio"] > 2
    assert numbers["import_ratio"] == numbers["import_loop_s"] / numbers["import_s"]
    for mode in ("points", "ellipsoids", "solid"):
        assert numbers[f"{mode}_fps"] > 10
    larger = bench_blender(None, 200_000, 5_000, 1, 1_000)
    assert larger["num_gaussians"] == 200_000 and larger["import_s"] > 2 * numbers["import_s"]


def test_a_blender_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(MissingToolError, match="no such program"):
        bench_blender(tmp_path / "blender", 10, 10, 1, 1)
