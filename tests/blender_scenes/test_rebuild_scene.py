# SPDX-License-Identifier: Apache-2.0
"""Every committed scene is what its builder makes today."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from blender_scenes.catalogue import scenes


@pytest.mark.slow
@pytest.mark.skipif(find_spec("anny") is None, reason="needs anny")
@pytest.mark.parametrize("name", sorted(scenes()))
def test_building_again_gives_the_committed_scene(
    name: str, python: Callable[..., subprocess.CompletedProcess[str]], tmp_path: Path
) -> None:
    again = tmp_path / f"{name}.blend"
    python("-m", "blender_scenes", "build", name, "--out", again, must_work=True)
    found = []
    for blend in (scenes()[name].path, again):
        out = tmp_path / "scene.json"
        script = Path(__file__).with_name("survey_catalogue.py")
        python(script, out, blend, must_work=True)
        found.append(json.loads(out.read_text())[name])
    committed, built = found
    for key in ("frames", "faces", "actions", "seen", "materials", "view_transform"):
        assert built[key] == committed[key], key
    for key in ("people", "devices"):
        assert list(built[key]) == list(committed[key])
        for item, places in built[key].items():
            assert np.allclose(places, committed[key][item], rtol=0.0, atol=1e-5), (key, item)
    assert list(built["static"]) == list(committed["static"])
    for item, (collection, *corners) in built["static"].items():
        assert collection == committed["static"][item][0]
        assert np.allclose(corners, committed["static"][item][1:], rtol=0.0, atol=1e-5), item
