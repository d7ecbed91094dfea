# SPDX-License-Identifier: Apache-2.0
"""Symbolic links out of datasets and runs: nothing is read or written where they lead."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from dataset_factory.check.validate import validate
from dataset_factory.cli import main as factory
from rfgs_core.cli import main as rfgs
from rfgs_core.dataset import open_dataset
from rfgs_core.errors import RfgsFormatError
from rfgs_core.files import read_json, write_text
from rfgs_core.links import refuse_link, strange_entries
from rfgs_core.run import Run, open_run


@pytest.fixture
def data(tiny_dataset: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(tiny_dataset, tmp_path / "data"))


@pytest.fixture
def run(small_run: Run, tiny_dataset: Path, tmp_path: Path) -> Path:
    """A copy that finds the dataset where it was."""
    copy = Path(shutil.copytree(small_run.path, tmp_path / "own_run"))
    return open_run(copy).with_dataset(tiny_dataset).path


def elsewhere(tmp_path: Path) -> Path:
    folder = tmp_path / "victim"
    folder.mkdir()
    (folder / "kept.txt").write_text("mine")
    return folder


def one_line(capsys: pytest.CaptureFixture[str]) -> str:
    err = capsys.readouterr().err.splitlines()
    lines = [line for line in err if line.startswith("error: ")]
    assert len(lines) == 1 and "Traceback" not in "".join(err)
    return lines[0]


def test_preview_does_not_write_where_a_link_leads(
    data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    victim = elsewhere(tmp_path)
    (data / "log").symlink_to(victim)
    assert factory(["preview", str(data)]) == 2
    assert f"a symbolic link leads out of {data}" in one_line(capsys)
    assert [file.name for file in victim.iterdir()] == ["kept.txt"]


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("predictions", ["predict", "--tx", "1,1,1", "--rx", "2,2,1"]),
        ("metrics.json", ["report"]),
    ],
)
def test_commands_on_runs_do_not_follow_links(
    run: Path, tmp_path: Path, name: str, arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    victim = elsewhere(tmp_path)
    (run / name).symlink_to(victim / "kept.txt" if "." in name else victim)
    assert rfgs([arguments[0], str(run), *arguments[1:]]) == 2
    assert name in one_line(capsys)
    assert [file.name for file in victim.iterdir()] == ["kept.txt"]
    assert (victim / "kept.txt").read_text() == "mine"


def test_a_dataset_is_not_made_into_linked_folders(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    victim, out = elsewhere(tmp_path), tmp_path / "new"
    for name in (".work", "log"):
        out.mkdir(exist_ok=True)
        (out / name).symlink_to(victim)
        assert factory(["generate", "living_room_walk", "--radio", "wifi", "--out", str(out)]) == 2
        assert f"{name}: a symbolic link" in one_line(capsys)
        (out / name).unlink()
    assert (victim / "kept.txt").read_text() == "mine"


def test_validate_names_every_link(data: Path, tmp_path: Path) -> None:
    assert validate(data) == []
    victim = elsewhere(tmp_path)
    (data / "log").mkdir()
    links = [
        data / "log" / "page",
        data / "tiny" / "more",
        data / "tiny" / "geometry" / "000001.npz",
    ]
    links[2].unlink()
    for link in links:
        link.symlink_to(victim)
    faults = validate(data)
    for link in links:
        assert any(fault.startswith(f"{link}: a symbolic link to {victim}") for fault in faults)
    assert sorted(strange_entries(data)) == sorted(links)


def read_every_kind(data: Path) -> None:
    """Reads one file of each kind of a dataset."""
    sequence = open_dataset(data).sequence()
    sequence.csi("wifi", 1)
    sequence.coordinates("wifi")
    sequence.image("cam00", 1)
    sequence.depth("cam00", 1)
    sequence.moving_mesh(1)
    sequence.static_mesh()


@pytest.mark.parametrize(
    "name",
    [
        "images/cam00/000001.png", "depth/cam00/000001.exr", "geometry/static.ply",
        "geometry/000001.npz", "sequence.json", "radio/wifi/csi.zarr/csi/c/0/0/0/0",
        "radio/wifi/csi.zarr/freq_hz/c/0", "radio/wifi/csi.zarr/csi/zarr.json",
        "radio/wifi/done/000001", "radio/wifi/csi.zarr", "geometry", "images/cam00",
    ],
)  # fmt: skip
def test_nothing_is_read_through_a_link_that_leads_out(
    data: Path, tmp_path: Path, name: str
) -> None:
    place = data / "tiny" / name
    moved = tmp_path / "moved"
    place.rename(moved)
    place.symlink_to(moved)

    with pytest.raises(RfgsFormatError, match="a symbolic link leads out of"):
        read_every_kind(data)
    # The same files within the dataset: that is a matter of the owner.
    place.unlink()
    own = moved.rename(data / "tiny" / "kept")
    place.symlink_to(own)
    read_every_kind(data)


@pytest.mark.parametrize("schema", ["rfgs-dataset\\/1", "\\u0072fgs-dataset/1"])
def test_a_schema_with_escapes_in_it_is_guarded_too(
    data: Path, tmp_path: Path, schema: str
) -> None:
    file, picture = data / "dataset.json", data / "tiny/images/cam00/000001.png"
    file.write_text(file.read_text().replace("rfgs-dataset/1", schema))
    assert open_dataset(data).sequence().image("cam00", 1).any()
    picture.symlink_to(picture.rename(tmp_path / "elsewhere.png"))
    with pytest.raises(RfgsFormatError, match="a symbolic link leads out of"):
        open_dataset(data).sequence().image("cam00", 1)


@pytest.mark.parametrize(
    "name",
    [
        "sequence.json", "images/cam00/000001.png", "depth/cam00/000001.exr",
        "geometry/static.ply", "geometry/000001.npz", "radio/wifi/csi.zarr/zarr.json",
        "radio/wifi/csi.zarr/csi/c/0/0/0/0", "radio/wifi/csi.zarr/freq_hz/c/0",
    ],
)  # fmt: skip
def test_nobody_waits_for_a_pipe(data: Path, name: str) -> None:
    place = data / "tiny" / name
    place.unlink()
    os.mkfifo(place)

    with pytest.raises(RfgsFormatError, match="expected a file or a folder, found a pipe"):
        read_every_kind(data)
    assert f"{place}: a pipe; expected files and folders" in validate(data)


def test_a_run_is_not_read_through_links(run: Path, tmp_path: Path) -> None:
    file = run / "gaussians" / "000001.ply"
    file.symlink_to(file.rename(tmp_path / "elsewhere.ply"))
    with pytest.raises(RfgsFormatError, match=r"000001\.ply: a symbolic link leads out of"):
        open_run(run).moving(1)


def test_links_to_a_dataset_and_around_it_are_nobody_elses_business(
    data: Path, tmp_path: Path
) -> None:
    (tmp_path / "short").symlink_to(data)
    assert open_dataset(tmp_path / "short").sequence().csi("wifi", 1).any()
    # A folder of somebody's project that happens to hold such names is no dataset.
    for name in ("config.json", "dataset.json"):
        (tmp_path / name).write_text('{"schema": "theirs"}')
    refuse_link(tmp_path / "short" / "log" / "page")
    write_text(tmp_path / "short" / "log" / "page", "x")
    assert (data / "log" / "page").read_text() == "x"
    assert read_json(tmp_path / "short" / "dataset.json")["sequences"] == ["tiny"]
