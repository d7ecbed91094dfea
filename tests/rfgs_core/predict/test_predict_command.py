# SPDX-License-Identifier: Apache-2.0
"""`rfgs predict`: files, table, and one line for each mistake."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from rfgs_core.cli import main
from rfgs_core.predict.arrays import UNITS
from rfgs_core.run import Run, open_run

TX, RX = "0.5,0.5,1.0", "2.6,0.4,1.5"


@pytest.mark.parametrize("array", [False, True])
def test_it_writes_arrays_and_a_picture(
    small_run: Run, tmp_path: Path, capsys, array: bool
) -> None:
    out = tmp_path / "there" / "new.npz"
    more = ["--array", "--facing", "1.5,1.5,1.0"] if array else []
    arguments = ["predict", str(small_run.path), "--tx", TX, "--rx", RX, "--rx", "2.0,2.8,1.0"]
    assert main([*arguments, "--frame", "2", "--out", str(out), *more]) == 0
    text = capsys.readouterr().out
    assert "2.60, 0.40, 1.50" in text and "2.00, 2.80, 1.00" in text
    assert "40 Gaussians reflect" in text and "material: " in text
    assert "reflections from walls are known along recorded links only" in text
    with np.load(out, allow_pickle=False) as stored:
        arrays = dict(stored)
    named = {name: (unit, axes) for name, unit, axes in arrays.pop("units")}
    assert "recorded links only" in str(arrays.pop("note"))
    assert named == {name: UNITS[name] for name in arrays}
    elements = 8 if array else 1
    assert arrays["csi"].shape == (2, elements, 16)
    np.testing.assert_array_equal(arrays["csi"], arrays["csi_scatter"] + arrays["csi_direct"])
    assert ("beam_power" in arrays) == array
    assert arrays["gaussian_power"].shape == (2, 40)
    with Image.open(out.with_suffix(".png")) as picture:
        assert np.asarray(picture.convert("L")).std() > 5
    files = sorted(path.name for path in out.parent.iterdir())
    assert files == ["new.npz", "new.png"]
    first = out.read_bytes(), out.with_suffix(".png").read_bytes()
    assert main([*arguments, "--frame", "2", "--out", str(out), *more]) == 0
    assert (out.read_bytes(), out.with_suffix(".png").read_bytes()) == first


def test_without_a_name_it_writes_into_the_run(
    small_run: Run, tiny_dataset: Path, tmp_path: Path, capsys
) -> None:
    shutil.copytree(small_run.path, tmp_path / "a" / "run")
    shutil.copytree(tiny_dataset, tmp_path / "a" / "dataset")
    run = tmp_path / "a" / "run"
    assert open_run(run).with_dataset(run.parent / "dataset").sequence.frames == [1, 2]
    assert main(["predict", str(run), "--tx", TX, "--rx", RX, "--also", str(run)]) == 0
    assert (run / "predictions/000001.npz").is_file()
    assert (run / "predictions/000001.png").is_file()


@pytest.mark.parametrize(
    ("extra", "message"),
    [
        (["--tx", "1,2", "--rx", RX], "--tx '1,2': expected three finite coordinates x,y,z"),
        (["--tx", TX, "--rx", "1,2,3,4"], "--rx '1,2,3,4': expected three finite coordinates"),
        (["--tx", "nan,1,1", "--rx", RX], "--tx 'nan,1,1': expected three finite coordinates"),
        (["--tx", "1,inf,1", "--rx", RX], "--tx '1,inf,1': expected three finite coordinates"),
        (["--tx", "a,b,c", "--rx", RX], "--tx 'a,b,c': expected three finite coordinates"),
        (
            ["--tx", "50,0,1", "--rx", RX],
            "--tx 50,0,1: 47.0 m outside the scene, which reaches from 0,0,0 to 3,3,2.5 m",
        ),
        (["--tx", TX, "--rx", RX, "--rx", "1,1,-1.1"], "--rx 1,1,-1.1: 1.1 m outside the scene"),
        (
            ["--tx", TX, "--rx", RX, "--facing", "1,1,1"],
            "--facing 1,1,1: turns arrays; add --array",
        ),
        (["--tx", TX], "--rx: expected at least one position"),
        (["--tx", TX, "--rx", TX], "--rx 0.5,0.5,1: on top of a --tx antenna"),
        (["--tx", TX, "--rx", RX, "--rx", RX], "--rx 2.6,0.4,1.5: on top of a --rx antenna"),
        (["--tx", TX, "--rx", RX, "--frame", "9"], "holds no frame 9; it has [1, 2]"),
        (["--tx", TX, "--rx", RX, "--out", "x.npy"], "--out x.npy: expected a file name that"),
        (
            ["--tx", TX, "--rx", RX, "--array", "--facing", "2.6,0.4,0"],
            "--facing: expected a point beside the array",
        ),
    ],
)
def test_mistakes_end_in_one_line(
    small_run: Run, tmp_path: Path, monkeypatch, capsys, extra: list[str], message: str
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["predict", str(small_run.path), *extra]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("error: ") and err.count("\n") == 1
    assert message in err
    assert not list(tmp_path.iterdir())
    assert not (small_run.path / "predictions").exists()


def test_an_antenna_below_the_floor_is_told_before_the_answer(
    small_run: Run, tmp_path: Path, capsys
) -> None:
    out = ["--out", str(tmp_path / "below.npz")]
    assert main(["predict", str(small_run.path), "--tx", TX, "--rx", "1,1,-0.4", *out]) == 0
    assert "--rx 1,1,-0.4: 0.4 m outside the scene, which reaches" in capsys.readouterr().err


def test_an_antenna_inside_the_person_is_refused(small_run: Run, capsys) -> None:
    inside = ",".join(f"{value:.4f}" for value in small_run.moving(1).means[3].tolist())
    assert main(["predict", str(small_run.path), "--tx", TX, "--rx", inside]) == 2
    assert "from a Gaussian; expected at least 2.6 cm" in capsys.readouterr().err
