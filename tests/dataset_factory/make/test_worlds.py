# SPDX-License-Identifier: Apache-2.0
"""Random worlds on disk: sound datasets, the same from any shard, whole or absent."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from dataset_factory.check.validate import validate
from dataset_factory.cli import main
from dataset_factory.make.world_files import name_of
from dataset_factory.make.worlds import make_worlds, parse_shard
from rfgs_core import open_dataset
from rfgs_core.errors import RfgsError
from rfgs_core.files import sha256
from rfgs_core.radio.presets import preset
from rfgs_core.worlds.settings_file import WorldsFile
from rfgs_core.worlds.world import WorldSettings, random_world

ASKED = ("worlds", "--radio", "wifi_commodity", "--frames", "2", "--depth", "1", "--count", "2")


def digests(out: Path) -> dict[str, str]:
    found = sorted(path for path in out.rglob("*") if path.is_file())
    return {path.relative_to(out).as_posix(): sha256(path) for path in found}


def test_every_world_is_a_sound_dataset(two_worlds: Path) -> None:
    for index in range(2):
        assert validate(two_worlds / name_of(index)) == []
        sequence = open_dataset(two_worlds / name_of(index)).sequence()
        world = random_world(preset("wifi_commodity"), WorldSettings(frames=2, depth=1), 0, index)
        np.testing.assert_allclose(sequence.joints(2), world.joints(0.1), atol=1e-6)
        assert sequence.actions(1) == [actor.motion.family for actor in world.actors]


def test_shards_make_the_same_worlds_and_a_stopped_run_goes_on(two_worlds: Path, tmp_path) -> None:
    out = tmp_path / "shards"
    assert main([*ASKED, "--shard", "2/2", "--out", str(out)]) == 0
    assert [path.name for path in sorted(out.glob("world_*"))] == [name_of(1)]
    left = out / f".tmp-0000-{name_of(0)}"
    left.mkdir()
    (left / "half").write_text("")
    assert main([*ASKED, "--shard", "1/2", "--out", str(out)]) == 0
    assert not left.exists()
    locks = {name for name in digests(out) if name.startswith(".lock")}
    assert len(locks) == 2
    whole = {
        name: value for name, value in digests(two_worlds).items() if not name.startswith(".lock")
    }
    assert {k: v for k, v in digests(out).items() if k not in locks} == whole


def test_other_settings_and_other_folders_are_refused(two_worlds: Path, tmp_path, capsys) -> None:
    (tmp_path / "mine").write_text("")
    for more, said in (
        (["--seed", "1", "--out", str(two_worlds)], "made with other settings"),
        (["--out", str(tmp_path)], "not empty and no worlds"),
        (["--out", str(tmp_path / "new"), "--people", "x"], "--people 'x'"),
        (["--out", str(tmp_path / "new"), "--shard", "3/2"], "--shard '3/2'"),
        (["--out", str(tmp_path / "new"), "--radio", "sar"], "antennas move"),
        (["--out", str(tmp_path / "new"), "--radio", "scene"], "no Empties"),
        (["--out", str(tmp_path / "new"), "--motion", "fly"], "'fly'"),
    ):
        assert main([*ASKED, *more]) != 0
        lines = [line for line in capsys.readouterr().err.splitlines() if line.strip()]
        assert said in lines[-1] and lines[-1].startswith("error: ")
    assert not (tmp_path / "new").exists(), "what is refused leaves nothing"


def test_a_world_is_made_by_one_process_at_a_time(two_worlds: Path, tmp_path: Path) -> None:
    out = Path(shutil.copytree(two_worlds, tmp_path / "worlds"))
    shared = WorldsFile(preset("wifi_commodity"), WorldSettings(frames=2, depth=1), 0)
    first = make_worlds(out, shared, "wifi_commodity", range(0, 4))
    next(first)
    with pytest.raises(RfgsError, match="another rfgs-factory worlds"):
        next(make_worlds(out, shared, "wifi_commodity", range(0, 4)))


def test_shards_have_one_form() -> None:
    assert parse_shard("8/8") == (8, 8)
    for text in ("0/2", "3/2", "1", "1/0", "a/b", "1/2/3", "-1/2"):
        with pytest.raises(RfgsError, match="expected K/N"):
            parse_shard(text)
