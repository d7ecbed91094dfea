# SPDX-License-Identifier: Apache-2.0
"""`rfgs bench pictures`: a run beside Gaussians that saw the pictures."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from rfgs_core.cli import main
from rfgs_core.run import Run


def test_pictures_tell_more_of_the_person_than_radio(small_run: Run, tmp_path: Path) -> None:
    out = tmp_path / "pictures.json"
    run = str(small_run.path)
    assert main(["bench", "pictures", "--run", run, "--steps", "15", "--json", str(out)]) == 0
    table = json.loads(out.read_text())
    assert table["frames"] == 2
    for key in ("psnr_person", "f05", "f10", "f20"):
        assert table[f"Gaussians fitted to pictures: {key}"] > table[f"RF-GS: {key}"]
    # The silhouette knows the outline; the empty room has no Gaussians to lie anywhere.
    assert table["mean-colour silhouette: psnr"] > table["empty room: psnr"]
    assert "empty room: f05" not in table


@pytest.mark.parametrize("missing", ["images", "test cameras"])
def test_a_dataset_without_pictures_gets_one_line(
    small_run: Run, missing: str, tmp_path: Path, capsys
) -> None:
    # Where the run looks for it: ../../tiny0/dataset.
    own = small_run.sequence.path.parent
    data = Path(shutil.copytree(own, tmp_path / own.parent.name / own.name))
    run = Path(shutil.copytree(small_run.path, tmp_path / "runs" / "run"))
    sequence = next(data.glob("*/sequence.json"))
    if missing == "images":
        shutil.rmtree(sequence.parent / "images")
    else:
        kept = json.loads(sequence.read_text())
        kept["splits"]["images"]["test_cameras"] = []
        sequence.write_text(json.dumps(kept))
    assert main(["bench", "pictures", "--run", str(run)]) == 2
    told = capsys.readouterr()
    line = next(line for line in (told.out + told.err).splitlines() if "error" in line)
    assert "expected pictures of training and of test cameras" in line and "--no-images" in line
