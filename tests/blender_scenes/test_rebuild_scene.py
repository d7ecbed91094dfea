# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("anny")


@pytest.mark.slow
def test_building_again_gives_the_committed_scene(
    walk: SimpleNamespace,
    survey: Callable[[Path, Path], SimpleNamespace],
    python: Callable[..., subprocess.CompletedProcess[str]],
    tmp_path: Path,
) -> None:
    out = tmp_path / "again.blend"
    done = python("-m", "blender_scenes", "build", "--out", out)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    again = survey(out, tmp_path)
    assert np.array_equal(again.faces, walk.faces)
    assert np.abs(again.vertices - walk.vertices).max() < 1e-5
    assert np.abs(again.cameras - walk.cameras).max() < 1e-5
    assert again.report["materials"] == walk.report["materials"]
    assert list(again.report["objects"]) == list(walk.report["objects"])
    for name, item in again.report["objects"].items():
        assert item["low"] == pytest.approx(walk.report["objects"][name]["low"], abs=1e-5)
        assert item["high"] == pytest.approx(walk.report["objects"][name]["high"], abs=1e-5)
