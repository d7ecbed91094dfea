# SPDX-License-Identifier: Apache-2.0
"""The strip of a table shows every method by the voxels that its scores are told from."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from rfgs_core import study
from rfgs_core.dataset import open_dataset
from rfgs_core.report.strip import panels_of, write_strip
from rfgs_core.study.cells import make
from rfgs_core.study.paper_tables import Cell, Size

#: A table with its cells takes a quarter of a minute.
pytestmark = pytest.mark.slow

TINY = Size(("living_room_walk",), 1, "1:2", 3, 8, 2, 6, 0)
METHODS = ("rfgs", "paper_fixed", "nerf_features")


@pytest.fixture(scope="module")
def table(
    tiny_dataset: Path,
    tmp_path_factory: pytest.TempPathFactory,
    one_step: Callable[[pytest.MonkeyPatch], None],
) -> tuple[Path, dict[Cell, dict[str, Any]]]:
    """A folder with a few small cells, and what they say."""
    out, whole = tmp_path_factory.mktemp("table"), study.cells.train_config
    cells = [Cell("living_room_walk", "wifi", method, 0) for method in METHODS]
    shutil.copytree(tiny_dataset, out / cells[0].dataset)
    quick = {"posture": "standing", "num_gaussians": 200, "limbs": "off"}
    with pytest.MonkeyPatch.context() as patch:
        one_step(patch)
        patch.setattr(
            study.cells, "train_config", lambda cell, size: replace(whole(cell, size), **quick)
        )
        made = {cell: make(cell, out, TINY) for cell in cells}
    # A field with our prior is none of the paper's, whatever it says.
    return out, {**made, Cell("living_room_walk", "wifi", "ngp_features_prior", 0): made[cells[2]]}


def redness(picture: Image.Image) -> float:
    """How much redder than blue what is drawn is: red is far from the truth."""
    solid = np.asarray(picture).astype(int)
    solid = solid[solid[..., 3] > 220]
    return float((solid[:, 0] - solid[:, 2]).mean())


def test_there_is_a_panel_of_the_truth_of_ours_and_of_what_it_is_held_against(table) -> None:
    out, made = table
    panels = list(panels_of(made, out))
    names = [panel.title.partition("\n")[0] for panel in panels]
    assert names[:3] == ["true surface", "RF-GS", "body prior"]
    assert (
        names[-2:] == ["fixed density", "RF-NeRF, features"] and "matched filter all sum" in names
    )
    own = made[Cell("living_room_walk", "wifi", "rfgs", 0)]["methods"]["rfgs"]["geometry"]
    assert panels[1].title.endswith(f"F5 {own['f05']:.2f}, F10 {own['f10']:.2f}")
    assert len({panel.picture.size for panel in panels}) == 1
    # On the true surface everything is near it.
    assert redness(panels[0].picture) < min(redness(panel.picture) for panel in panels[1:])


def test_a_field_is_shown_where_its_voxels_are(table) -> None:
    out, made = table
    cell = Cell("living_room_walk", "wifi", "nerf_features", 0)
    frame = open_dataset(out / cell.dataset).sequence().frames[0]
    skin = open_dataset(out / cell.dataset).sequence().moving_mesh(frame)[0]
    near = {**made[cell], "voxels": skin.tolist()}
    *_, there = panels_of({**made, cell: near}, out)
    *_, found = panels_of(made, out)
    assert redness(there.picture) < redness(found.picture) - 20
    # Cells of before, which kept no voxels, have no panel.
    titles = [one.title for one in panels_of({**made, cell: {**near, "voxels": None}}, out)]
    assert not any("NeRF" in title for title in titles)


def test_the_picture_has_all_panels_and_a_scale(table, tmp_path: Path) -> None:
    out, made = table
    write_strip(tmp_path / "strip.png", made, out)
    whole = np.asarray(Image.open(tmp_path / "strip.png").convert("RGB"))
    few = {cell: one for cell, one in made.items() if cell.method == "rfgs"}
    write_strip(tmp_path / "few.png", few, out)
    less = np.asarray(Image.open(tmp_path / "few.png").convert("RGB"))
    assert whole.shape[0] > 1.5 * less.shape[0] and whole.shape[1] == less.shape[1]


def test_nothing_is_written_where_no_run_is_kept(table, tmp_path: Path) -> None:
    _, made = table
    write_strip(tmp_path / "strip.png", made, tmp_path)
    assert not (tmp_path / "strip.png").exists()
