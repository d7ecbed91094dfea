# SPDX-License-Identifier: Apache-2.0
"""The tutorial runs, and what it computes is what the geometry says."""

from __future__ import annotations

import importlib.util
import subprocess
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from PIL import Image

from rfgs_core import open_dataset
from rfgs_core.radio.constants import SPEED_OF_LIGHT

TUTORIAL = Path(__file__).resolve().parents[2] / "docs" / "tutorial.py"
Script = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture(scope="module")
def tutorial() -> ModuleType:
    """The tutorial's functions, without running it."""
    spec = importlib.util.spec_from_file_location("tutorial", TUTORIAL)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_tutorial_runs_and_draws(script: Script, tiny_dataset: Path, tmp_path: Path) -> None:
    out = tmp_path / "tour.png"
    done = script(TUTORIAL, tiny_dataset, "--out", out)
    told = done.stdout
    assert done.returncode == 0 and "frames [1, 2] at 10 fps" in told
    assert "batch: frames [1, 2], csi (2, 4, 32, 16)" in told
    assert "person with instance id 1: stand" in told
    with Image.open(out) as image:
        assert image.size == (1300, 800)
        pixels = np.asarray(image.convert("L"))
    # Six panels: none of the six thirds of the sheet is blank.
    panels = [half for part in np.array_split(pixels, 2) for half in np.array_split(part, 3, 1)]
    assert all(panel.std() > 10 for panel in panels)


def test_the_tutorial_names_what_is_wrong(script: Script, tmp_path: Path) -> None:
    done = script(TUTORIAL, tmp_path / "nothing")
    assert done.returncode == 2
    assert done.stderr.strip().splitlines()[-1].startswith("error: ")
    assert "no dataset there" in done.stderr


def test_delay_profile_peaks_at_the_straight_line(tutorial: ModuleType, tiny_dataset: Path) -> None:
    sequence = open_dataset(tiny_dataset).sequence()
    layout, spec = sequence.layout("wifi"), sequence.radio_spec("wifi")
    response, length_m = tutorial.delay_profile(sequence, "wifi", sequence.csi_static("wifi"))
    direct_m = np.linalg.norm(layout.tx_xyz[:, None] - layout.rx_xyz, axis=-1)
    peak = np.abs(response).argmax(axis=-1)
    bin_m = length_m[1] - length_m[0]
    assert np.abs(length_m[peak] - direct_m).max() < 0.6 * bin_m
    # At its delay a path has its amplitude and the carrier's phase.
    friis = SPEED_OF_LIGHT / spec.centre_hz / (4 * np.pi * direct_m)
    found = np.take_along_axis(response, peak[..., None], axis=-1)[..., 0]
    np.testing.assert_allclose(np.abs(found), friis, rtol=0.05)


@pytest.mark.parametrize("pair", [(0, 1), (3, 2), (1, 1)])
def test_delay_angle_points_at_what_moves(
    tutorial: ModuleType, tiny_dataset: Path, pair: tuple[int, int]
) -> None:
    sequence = open_dataset(tiny_dataset).sequence()
    change = sequence.csi("wifi", 1) - sequence.csi_static("wifi")
    power, angle_deg, length_m = tutorial.delay_angle(sequence, "wifi", change, pair)
    angle, length = np.unravel_index(power.argmax(), power.shape)
    expected = tutorial.seen_from(sequence, "wifi", pair, sequence.joints(1)[0, 8])
    # Four columns at half a wavelength resolve 25°, 160 MHz 1.9 m; the ball is 0.6 m wide.
    assert angle_deg[angle] == pytest.approx(expected[0], abs=8.0)
    assert length_m[length] == pytest.approx(expected[1], abs=0.6)
