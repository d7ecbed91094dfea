# SPDX-License-Identifier: Apache-2.0
"""What a recorded video shows when, and from where."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from rfgs_core.cli import main
from rfgs_core.errors import MissingToolError
from rfgs_core.run import Run
from rfgs_core.view.browser import find_chromium
from rfgs_core.view.recording import PICTURES_PER_S, SWING_RAD, frames_shown, swung


def test_the_camera_swings_on_a_level_arc_and_comes_back() -> None:
    start, centre = np.array([-3.0, -2.0, 2.5]), np.array([1.0, 0.5, 1.0])
    places = np.array([swung(start, centre, share) for share in np.linspace(0, 1, 41)])
    np.testing.assert_allclose(places[[0, 20, 40]], np.tile(start, (3, 1)), atol=1e-12)
    away = places - centre
    np.testing.assert_allclose(np.linalg.norm(away, axis=1), np.linalg.norm(start - centre))
    np.testing.assert_allclose(places[:, 2], start[2])
    bearing = np.unwrap(np.arctan2(away[:, 1], away[:, 0]))
    bearing -= bearing[0]
    assert bearing.max() == pytest.approx(SWING_RAD) and bearing.min() == pytest.approx(-SWING_RAD)


def test_each_frame_is_shown_as_long_as_it_lasts_and_short_runs_again() -> None:
    shown = frames_shown(np.array([1.0, 1.5, 2.0]))
    assert len(shown) == 6.0 * PICTURES_PER_S and shown[:3] == [0, 0, 0]
    assert np.bincount(shown).tolist() == [len(shown) / 3] * 3
    assert frames_shown(np.array([0.4])) == [0] * round(6.0 * PICTURES_PER_S)
    assert len(frames_shown(np.linspace(0, 100, 501))) == 30.0 * PICTURES_PER_S


@pytest.mark.slow
def test_a_recording_plays_the_run(
    known_run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    try:
        find_chromium()
    except MissingToolError as error:
        pytest.skip(str(error))
    monkeypatch.setattr("rfgs_core.view.recording.LEAST_S", 0.1)
    file = tmp_path / "run.webp"
    assert main(["view", str(known_run.path), "--port", "0", "--record", str(file)]) == 0
    with Image.open(file) as video:
        # Two frames, a tenth of a second each.
        assert video.n_frames == 2
        first = np.asarray(video.convert("RGB")).astype(int)
        video.seek(1)
        assert abs(np.asarray(video.convert("RGB")).astype(int) - first).max() > 60
