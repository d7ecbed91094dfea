# SPDX-License-Identifier: Apache-2.0
"""`rfgs pose` on a trained run: what it writes, and what it says of a run that is too old."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from rfgs_core.arrays import load_arrays, save_arrays
from rfgs_core.cli.pose import PoseArgs, run
from rfgs_core.errors import RfgsError
from rfgs_core.files import read_json
from rfgs_core.run import Run, open_run
from rfgs_core.skeleton import JOINTS


@pytest.fixture
def own_run(trained_run: Run, tiny_dataset: Path, tmp_path: Path) -> Path:
    """A copy of the run; `dataset` leads to the same data."""
    folder = Path(shutil.copytree(trained_run.path, tmp_path / "run"))
    return open_run(folder).with_dataset(tiny_dataset).path


def test_poses_errors_and_picture_are_written(own_run: Path, capsys) -> None:
    assert run(PoseArgs(own_run)) == 0
    stored = load_arrays(own_run / "pose.npz", "try again")
    assert stored["joints"].shape == (2, 1, 17, 3)
    assert stored["frames"].tolist() == [1, 2]
    scores = read_json(own_run / "pose.json")
    for name in ("fit", "standing"):
        assert 0.0 < scores[name]["aligned_m"] < 1.0
    assert "standing" in capsys.readouterr().out
    assert (own_run / "pose.png").read_bytes()[:4] == b"\x89PNG"


def test_the_posture_of_the_run_is_that_of_the_pose(own_run: Path) -> None:
    run(PoseArgs(own_run))
    knee, hip = JOINTS.index("left_knee"), JOINTS.index("left_hip")

    def thighs() -> np.ndarray:
        joints = load_arrays(own_run / "pose.npz", "try again")["joints"]
        return joints[:, 0, knee] - joints[:, 0, hip]

    hanging = thighs()
    path = own_run / "checkpoints" / "000001.npz"
    arrays = load_arrays(path, "try again", unknown=("velocity_xy", "knees_rad"))
    save_arrays(path, {**arrays, "knees_rad": np.array([0.0])})
    run(PoseArgs(own_run))
    seated = thighs()
    assert hanging[0, 2] < -0.3 and seated[0, 2] > -0.3 and seated[0, 0] > 0.2
    # The frame in which the body stands again starts afresh.
    np.testing.assert_allclose(seated[1, 2], hanging[1, 2], atol=0.15)


def test_a_run_without_bodies_is_refused(own_run: Path) -> None:
    path = own_run / "gaussians" / "000002.features.npz"
    arrays = load_arrays(path, "try again")
    save_arrays(path, {name: value for name, value in arrays.items() if name != "body"})
    with pytest.raises(RfgsError, match=r"000002\.features\.npz: .* missing body; delete what"):
        run(PoseArgs(own_run))
    save_arrays(path, {**arrays, "body": np.full_like(arrays["body"], 3)})
    with pytest.raises(RfgsError, match="no Gaussian of frame 2 belongs to body 0"):
        run(PoseArgs(own_run))
