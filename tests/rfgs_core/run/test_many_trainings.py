# SPDX-License-Identifier: Apache-2.0
"""Several sequences at once: their runs, what fails, what is kept, and the same from workers."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from rfgs_core.cli import main
from rfgs_core.cli.train import TrainArgs
from rfgs_core.cli.trainings import trainings
from rfgs_core.dataset.names import SequenceFiles
from rfgs_core.dataset.schema import read_dataset_info, read_sequence_info
from rfgs_core.dataset.writer import finish_dataset, write_dataset_info, write_sequence_info
from rfgs_core.errors import RfgsError
from rfgs_core.run import open_run
from rfgs_core.schedule.archive import unpack
from rfgs_core.settings import TrainOptions

#: A training that takes a second.
QUICK = (
    "--gaussians", "40", "--iterations", "1", "--people", "1", "--posture", "standing",
    "--limbs", "off",
)  # fmt: skip
#: What a run says of itself and of the clock.
OF_TIME = ("train_s", "seal")


@pytest.fixture(scope="module")
def two_sequences(tiny_dataset: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The tiny dataset with its sequence twice, as `other` and `tiny`."""
    data = tmp_path_factory.mktemp("two") / "dataset"
    shutil.copytree(tiny_dataset, data)
    shutil.copytree(data / "tiny", data / "other")
    info = read_dataset_info(data / "dataset.json")
    finish_dataset(data, replace(info, sequences=["other", "tiny"]))
    return data


def asked(data: Path, out: Path, *more: str) -> list[str]:
    return ["train", str(data), "--radio", "wifi", "--out", str(out), *QUICK, *more]


def content(out: Path) -> dict[str, Any]:
    """Bytes of every file of the runs in a folder, their settings without what tells the time."""
    found: dict[str, Any] = {}
    for file in (path for path in out.glob("*-*/**/*") if path.is_file()):
        value: Any = file.read_bytes()
        if file.name == "config.json":
            value = {key: kept for key, kept in json.loads(value).items() if key not in OF_TIME}
        found[file.relative_to(out).as_posix()] = value
    return found


def names(args: TrainArgs) -> list[str]:
    return [str(one) for one in trainings(args)]


def test_runs_are_named_by_sequence_and_radio(two_sequences: Path, tmp_path: Path) -> None:
    args = TrainArgs(two_sequences, tmp_path / "runs", ("wifi", "mmwave"), ("all",))
    assert names(args) == ["other-wifi", "other-mmwave", "tiny-wifi", "tiny-mmwave"]
    args = replace(args, sequence=("tiny", "other", "tiny"), radio=("wifi",))
    assert names(args) == ["tiny-wifi", "other-wifi"]
    # One alone is the folder itself.
    assert names(replace(args, sequence=("tiny",))) == ["runs"]


def test_a_sequence_called_all_is_one_sequence(tiny_dataset: Path, tmp_path: Path) -> None:
    data = Path(shutil.copytree(tiny_dataset, tmp_path / "dataset"))
    info = read_dataset_info(data / "dataset.json")
    args = TrainArgs(data, tmp_path / "runs", ("wifi", "uwb"), ("all",))
    write_dataset_info(data, replace(info, sequences=["all", "tiny"]))
    assert names(args) == ["all-wifi", "all-uwb"]
    write_dataset_info(data, replace(info, sequences=["a", "a-b"]))
    with pytest.raises(RfgsError, match="a-b-c: radio c of a-b and radio b-c of a would share"):
        trainings(replace(args, radio=("b-c", "c")))


def test_a_radio_need_not_be_named_where_there_is_one(tiny_dataset: Path, tmp_path: Path) -> None:
    data = Path(shutil.copytree(tiny_dataset, tmp_path / "dataset"))
    args = TrainArgs(data, tmp_path / "run")
    assert [one.radio for one in trainings(args)] == ["wifi"]
    files = SequenceFiles(data / "tiny")
    info = read_sequence_info(files.info)
    radios, devices, rf = (
        {**of, "uwb": of["wifi"]} for of in (info.radios, info.devices, info.splits["rf"])
    )
    splits = {**info.splits, "rf": rf}
    write_sequence_info(files, replace(info, radios=radios, devices=devices, splits=splits))
    with pytest.raises(RfgsError, match=r"--radio is missing; .* has uwb, wifi"):
        trainings(args)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ([], "holds other, tiny; choose some with --sequence, or all with --sequence all"),
        (
            ["--sequence", "tiny", "--sequence", "no"],
            "no sequence 'no'; expected one of other, tiny",
        ),
        (["--sequence", "all", "--view"], "--view watches a single run"),
        (["--sequence", "tiny", "--view", "--scheduler", "tcp://x:1"], "--view watches a single"),
        (["--sequence", "all", "--workers", "0"], "--workers 0: expected 1 to 256"),
        (["--sequence", "all", "--encoder", "cnn:no.npz"], "no.npz"),
    ],
)
def test_what_cannot_be_is_one_line_before_anything_is_made(
    two_sequences: Path, tmp_path: Path, capsys, more: list[str], message: str
) -> None:
    assert main(asked(two_sequences, tmp_path / "runs", *more)) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and message in err
    assert not (tmp_path / "runs").exists()


def test_a_run_or_a_dataset_is_no_folder_for_several(
    two_sequences: Path, tmp_path: Path, capsys
) -> None:
    (tmp_path / "config.json").write_text("{}")
    for place, what in ((tmp_path, "a run"), (two_sequences, "a dataset")):
        assert main(asked(two_sequences, place, "--sequence", "all")) == 2
        said = f"error: {place} is {what}; expected a folder for 2 runs, choose another --out"
        assert capsys.readouterr().err.splitlines()[-1] == said


@pytest.fixture(scope="module")
def by_one_process(two_sequences: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Both sequences, trained one after another."""
    out = tmp_path_factory.mktemp("one") / "runs"
    assert main(asked(two_sequences, out, "--sequence", "all")) == 0
    return out


@pytest.fixture
def begun(two_sequences: Path, by_one_process: Path, tmp_path: Path) -> Path:
    """The same, stopped before the second frame of `tiny`, with a note of the user's."""
    out = Path(shutil.copytree(by_one_process, tmp_path / "begun" / "runs"))
    open_run(out / "other-wifi").with_dataset(two_sequences)
    run = out / "tiny-wifi"
    for file in [*run.glob("*/000002.*"), run / "shader.npz", run / "point_cloud.ply"]:
        file.unlink()
    (run / "note.txt").write_text("mine")
    return out


def test_workers_make_the_same_bytes_as_one_process(
    two_sequences: Path, by_one_process: Path, tmp_path: Path
) -> None:
    # As deep as the other, so that the way to the dataset is the same.
    out = by_one_process.parent / "by_workers"
    assert main(asked(two_sequences, out, "--sequence", "all", "--workers", "2")) == 0
    found = content(out)
    assert found == content(by_one_process)
    assert {name for name in found if name.endswith((".ply", "shader.npz"))} == {
        f"{run}-wifi/{name}"
        for run in ("other", "tiny")
        for name in (
            "gaussians/000001.ply", "gaussians/000002.ply", "gaussians/static.ply",
            "point_cloud.ply", "shader.npz",
        )
    }  # fmt: skip
    assert {path.name for path in out.iterdir()} == {"other-wifi", "tiny-wifi", "log"}
    assert open_run(out / "tiny-wifi").sequence.path == two_sequences / "tiny"


@pytest.mark.parametrize("workers", ["1", pytest.param("2", marks=pytest.mark.slow)])
def test_finished_runs_are_kept_and_a_begun_one_goes_on(
    two_sequences: Path, by_one_process: Path, begun: Path, workers: str, capsys
) -> None:
    before = (begun / "other-wifi/point_cloud.ply").stat().st_mtime_ns
    if workers != "1":
        # Two are left, as no worker is started for one.
        (begun / "other-wifi/shader.npz").unlink()
    arguments = asked(two_sequences, begun, "--sequence", "all", "--workers", workers)
    assert main(arguments) == 0
    assert "2 of 2 runs are trained; next: rfgs eval" in capsys.readouterr().out
    kept = (begun / "other-wifi/point_cloud.ply").stat().st_mtime_ns == before
    assert kept == (workers == "1")
    # It would be gone had the run begun anew.
    assert (begun / "tiny-wifi/note.txt").read_text() == "mine"
    found, expected = content(begun), content(by_one_process)
    for file in found.keys() - {"tiny-wifi/note.txt"}:
        if not file.endswith("config.json"):
            assert found[file] == expected[file], file
    place = begun / "tiny-wifi" / found["tiny-wifi/config.json"]["dataset"]
    assert place.resolve() == two_sequences


def test_what_fails_is_named_and_the_others_are_trained(
    two_sequences: Path, by_one_process: Path, tmp_path: Path, capsys
) -> None:
    out = tmp_path / "runs"
    shutil.copytree(by_one_process / "tiny-wifi", out / "tiny-wifi")
    (out / "other-wifi").mkdir()
    (out / "other-wifi/thesis.txt").write_text("precious")
    more = ("--sequence", "all", "--radio", "mmwave")
    assert main(asked(two_sequences, out, *more)) == 1
    said = capsys.readouterr().out.splitlines()
    assert said[0].startswith(f"{out}/other-wifi: failed: {out}/other-wifi is not empty and not a")
    assert said[1].startswith(f"{out}/other-mmwave: failed: {two_sequences} (other) has no radio")
    assert said[2].startswith(f"{out}/tiny-wifi: 2 frames, 40 Gaussians")
    assert said[-1] == f"{out}: 1 of 4 runs are trained, 3 failed"
    assert [path.name for path in (out / "other-wifi").iterdir()] == ["thesis.txt"]
    (out / "tiny-wifi/gaussians/000001.features.npz").write_bytes(b"damaged")
    assert main(asked(two_sequences, out, *more)) == 1
    assert f"\n{out}/tiny-wifi: failed: {out}/tiny-wifi/gaussians/" in capsys.readouterr().out
    # Other settings are no reason to overwrite a run.
    assert main(asked(two_sequences, out, "--sequence", "all", "--seed", "3")) == 1
    assert "tiny-wifi holds a run with another seed;" in capsys.readouterr().out


def test_no_link_leads_out_of_the_folder_of_runs(
    two_sequences: Path, tmp_path: Path, capsys
) -> None:
    (tmp_path / "victim").mkdir()
    out = tmp_path / "runs"
    out.mkdir()
    (out / "tiny-wifi").symlink_to(tmp_path / "victim")
    (out / "other-wifi").symlink_to(tmp_path / "nowhere")
    for workers in ("1", "2"):
        assert main(asked(two_sequences, out, "--sequence", "all", "--workers", workers)) == 1
        assert capsys.readouterr().out.count("a symbolic link leads out of") == 2
    assert not list((tmp_path / "victim").iterdir()) and not (tmp_path / "nowhere").exists()


@pytest.mark.slow
def test_a_cluster_makes_a_single_run_in_the_folder_itself(
    two_sequences: Path, by_one_process: Path, cluster: Any, tmp_path: Path, capsys
) -> None:
    out = tmp_path / "below" / "wifi-run"
    out.mkdir(parents=True)
    more = ("--sequence", "tiny", "--scheduler", cluster.scheduler_address)
    assert main(asked(two_sequences, out, *more)) == 0
    assert capsys.readouterr().out.startswith(f"people: 1, asked\n{out}: 2 frames, 40 Gaussians")
    found, expected = content(out.parent), content(by_one_process)
    for name in expected:
        if name.startswith("tiny-wifi") and not name.endswith("config.json"):
            assert found[name.replace("tiny-wifi", "wifi-run")] == expected[name], name
    assert open_run(out).sequence.path == two_sequences / "tiny"
    assert [path.name for path in out.parent.iterdir()] == ["wifi-run"]
    # What a worker refuses is an error of the command, and the run is as it was.
    assert main(asked(two_sequences, out, *more, "--seed", "3")) == 2
    assert "holds a run with another seed" in capsys.readouterr().err
    assert main([*asked(two_sequences, tmp_path / "no", *more), "--density", "paper"]) == 2
    assert "reads the sample points of the paper's" in capsys.readouterr().err


def test_a_learned_encoder_goes_to_the_worker(two_sequences: Path, tmp_path: Path, capsys) -> None:
    file, words = tmp_path / "cnn.npz", ["--radio", "wifi", "--sequence", "tiny"]
    assert main(["encode", str(two_sequences), *words, "--steps", "1", "--out", str(file)]) == 0
    options = TrainOptions(posture="standing", limbs="off")
    args = TrainArgs(
        two_sequences, tmp_path / "runs", ("wifi",), ("tiny",), encoder=f"cnn:{file}", people=1,
        iterations=1, gaussians=40, shader=False, options=options,
    )  # fmt: skip
    (training,) = trainings(args)
    parcel, there = training.parcel(tmp_path), tmp_path / "there"
    unpack(parcel.archive(), there / parcel.part.dataset)
    expected = file.read_bytes()
    file.unlink()
    parcel.part.make(there)
    assert (there / "runs/encoder.npz").read_bytes() == expected


def test_a_worker_gets_one_sequence_and_what_is_begun(
    two_sequences: Path, begun: Path, tmp_path: Path
) -> None:
    args = TrainArgs(two_sequences, begun, ("wifi",), ("all",))
    parcel = trainings(args)[1].parcel(begun)
    unpack(parcel.archive(), tmp_path / "there")
    assert {path.name for path in (tmp_path / "there").iterdir()} == {"dataset.json", "tiny"}
    # At the worker a link would be a file of its own.
    (begun / "tiny-wifi/note.txt").unlink()
    (begun / "tiny-wifi/note.txt").symlink_to(two_sequences / "dataset.json")
    with pytest.raises(RfgsError, match="a symbolic link leads out of"):
        trainings(args)[1].parcel(begun)


@pytest.mark.parametrize("command", ["eval", "report", "view"])
def test_a_folder_of_runs_names_them(by_one_process: Path, capsys, command: str) -> None:
    assert main([command, str(by_one_process)]) == 2
    held = ", ".join(f"{by_one_process}/{name}-wifi" for name in ("other", "tiny"))
    assert capsys.readouterr().err == (
        f"error: {by_one_process} is not a run, but holds some; name one: {held}\n"
    )
