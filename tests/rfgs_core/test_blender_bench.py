# SPDX-License-Identifier: Apache-2.0
"""The benchmark of the add-on runs in Blender, and its numbers are of real work."""

from __future__ import annotations

from pathlib import Path

import pytest

from rfgs_core.blender_bench import bench_blender
from rfgs_core.errors import MissingToolError

pytest.importorskip("bpy")


def test_what_is_timed_was_imported_and_played(monkeypatch: pytest.MonkeyPatch) -> None:
    """Counts come from the meshes in Blender; how fast it was is not for a test to say."""
    monkeypatch.delenv("BLENDER", raising=False)
    numbers = bench_blender(None, 4_000, 1_000, 4, 500)
    counts = [numbers[name] for name in ("num_gaussians", "gaussians_per_frame", "frames")]
    assert counts == [4_000, 1_000, 4]
    assert numbers["import_ratio"] == numbers["import_loop_s"] / numbers["import_s"] > 0
    assert numbers["points_ratio"] == numbers["points_fps"] / numbers["loop_fps"] > 0
    assert min(numbers["ellipsoids_fps"], numbers["solid_fps"]) > 0


def test_a_blender_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(MissingToolError, match="no such program"):
        bench_blender(tmp_path / "blender", 10, 10, 1, 1)
