# SPDX-License-Identifier: Apache-2.0
"""What comes with the package can be looked at at once, and says so where it cannot."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest

from rfgs_core import example, open_dataset
from rfgs_core.errors import RfgsError
from rfgs_core.example import ARCHIVE, chosen_run, example_folder, pack
from rfgs_core.run import open_run
from rfgs_core.view.frame import load_frame


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache"


def test_the_example_is_small_and_whole() -> None:
    assert ARCHIVE.stat().st_size < 8_000_000
    place = example_folder()
    run = open_run(place / "run")
    run.need_frames()
    sequence = open_dataset(place / "dataset").sequence()
    assert run.sequence.name == sequence.name == "living_room_walk"
    frame = load_frame(run, run.frames[0], None)
    # Half of the Gaussians lie within 15 cm of the person who really walks there.
    assert np.median(frame.error_m) < 0.15
    assert (run.path / "metrics.json").is_file() and (run.path / "pose.npz").is_file()
    assert sequence.image(sequence.cameras[0]["name"], run.frames[0]).std() > 10


def test_it_is_unpacked_once_and_may_be_worked_in() -> None:
    mark = example_folder() / "run" / "mine.txt"
    mark.write_text("kept")
    assert example_folder() == mark.parents[1] and mark.read_text() == "kept"


def test_a_run_or_the_example_must_be_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for run, wanted in ((None, False), (tmp_path, True)):
        with pytest.raises(RfgsError, match="expected the folder of a run, or --example"):
            chosen_run(run, wanted)
    assert chosen_run(tmp_path, False) == tmp_path
    assert chosen_run(None, True).name == "run"
    assert "the example" in capsys.readouterr().err


def test_what_was_cut_short_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    short = tmp_path / "example.zip"
    short.write_bytes(ARCHIVE.read_bytes()[:-9])
    monkeypatch.setattr(example, "ARCHIVE", short)
    with pytest.raises(RfgsError, match="damaged, its digest is not"):
        example_folder()
    short.unlink()
    with pytest.raises(RfgsError, match="not part of this installation"):
        example_folder()


def test_an_archive_leaves_out_what_only_a_training_needs(tmp_path: Path) -> None:
    for name in ("dataset/dataset.json", "run/checkpoints/a.pt", "run/gaussians/000001.ply"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(name)
    digests = [
        pack(tmp_path / "dataset", tmp_path / "run", tmp_path / f"{name}.zip") for name in "ab"
    ]
    assert digests[0] == digests[1], "equal files give equal bytes"
    with zipfile.ZipFile(tmp_path / "a.zip") as archive:
        assert archive.namelist() == ["dataset/dataset.json", "run/gaussians/000001.ply"]
