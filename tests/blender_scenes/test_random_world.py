# SPDX-License-Identifier: Apache-2.0
"""A random world as a scene of Blender is the world that the fast tracer draws."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from blender_scenes.__main__ import main as build
from dataset_factory.check.validate import validate
from dataset_factory.cli import main
from rfgs_core import open_dataset
from rfgs_core.worlds.settings_file import read_worlds_file
from rfgs_core.worlds.world import random_world, sounded

ASKED = (
    *("worlds", "--radio", "wifi_commodity", "--frames", "1", "--depth", "1", "--count", "1"),
    *("--images", "--cameras", "2", "--resolution", "64", "--samples", "1", "--people", "2"),
)


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    """One world, rendered and traced through Blender."""
    out = tmp_path_factory.mktemp("rendered") / "worlds"
    assert main([*ASKED, "--out", str(out)]) == 0
    return out


def level_db(error: np.ndarray, truth: np.ndarray) -> float:
    return 10.0 * float(np.log10((np.abs(error) ** 2).sum() / (np.abs(truth) ** 2).sum()))


@pytest.mark.slow
def test_blender_s_channels_are_those_of_the_world(made: Path) -> None:
    """Two ways to one world: drawn here, or built, saved, opened and exported by Blender."""
    assert validate(made / "world_0000000") == []
    shared = read_worlds_file(made / "worlds.json")
    world = random_world(shared.radio, shared.settings, shared.seed, 0)
    heard = sounded(world, shared.settings, shared.seed)
    sequence = open_dataset(made / "world_0000000").sequence()
    radio = sequence.radio("wifi_commodity")
    static, csi = radio["csi_static"].values, radio["csi"].values
    assert level_db(static - heard.csi_static, heard.csi_static) < -80.0
    # Facets of people are drawn by chance, anew in each way: two draws of one way differ by -22 dB.
    truth = heard.csi - heard.csi_static
    assert level_db(csi - static - truth, truth) < -20.0
    for frame in sequence.frames:
        at_s = (frame - 1) / shared.settings.fps
        np.testing.assert_allclose(sequence.joints(frame), world.joints(at_s), atol=1e-3)
    seen = [np.unique(sequence.mask(f"cam{number:02d}", 1)) for number in range(2)]
    assert set(np.concatenate(seen).tolist()) >= {1, 2}, "everybody is in the pictures"
    assert sequence.actions(1) == [actor.motion.family for actor in world.actors]


@pytest.mark.slow
def test_the_same_command_changes_nothing(made: Path) -> None:
    scene = made / "scenes" / "world_0000000.blend"
    before = scene.stat().st_mtime_ns
    assert main([*ASKED, "--out", str(made)]) == 0
    assert scene.stat().st_mtime_ns == before


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (("--index", "-1"), "--index -1: expected 0 or more"),
        (("--index", "0"), "no such file"),
    ],
)
def test_what_cannot_be_built_is_one_line(tmp_path: Path, capsys, more, said: str) -> None:
    out = tmp_path / "world.blend"
    assert build(["world", str(tmp_path / "worlds.json"), "--out", str(out), *more]) == 2
    assert said in capsys.readouterr().err and not out.exists()


def test_pictures_are_asked_for_within_reason(tmp_path: Path, capsys) -> None:
    for more, said in (
        (("--cameras", "13"), "--cameras 13: expected 1 to 12"),
        (("--fps", "12.5"), "--fps 12.5: expected a whole number"),
    ):
        assert main([*ASKED, *more, "--out", str(tmp_path / "new")]) != 0
        assert said in capsys.readouterr().err
    assert not (tmp_path / "new").exists()
