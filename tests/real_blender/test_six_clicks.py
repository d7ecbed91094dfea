# SPDX-License-Identifier: Apache-2.0
"""From the installed extension to Gaussians in the viewport with six clicks, no setting touched."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from window import play

HERE = Path(__file__).parent


@pytest.mark.blender
@pytest.mark.slow
def test_six_clicks_lead_to_gaussians(blender, programs, tiny_blend: Path, tmp_path: Path) -> None:
    pictures = tmp_path / "pictures"
    done = play(
        *(blender, HERE / "play_six_clicks.py", tiny_blend, pictures, *programs),
        size=(1920, 1800),
        timeout=1900,
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    assert "Traceback" not in done.stdout + done.stderr
    told = json.loads((pictures / "told.json").read_text())
    assert len(told["placed"]) >= 3 and len(set(told["placed"])) == 1
    assert len(told["clouds"]) == 4 and min(told["clouds"]) > 1000
    assert told["coloured"] != "MATERIAL", "white balls in the Solid view"
