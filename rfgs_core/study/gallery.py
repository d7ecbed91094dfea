# SPDX-License-Identifier: Apache-2.0
"""What the gallery consists of: every scene once, and who is strongest there beside ours."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rfgs_core.errors import RfgsError
from rfgs_core.radio import preset
from rfgs_core.study.cases import EVERY_SCENE
from rfgs_core.study.cell_rows import is_baseline
from rfgs_core.study.paper_tables import SIZES, Cell

#: Size of its cells: those of the study's scenes are cells of `rfgs bench table1 --size paper-cpu`.
SIZE = SIZES["paper-cpu"]


def gallery_cells(scenes: Sequence[str], radio: str | None) -> list[Cell]:
    """A cell of RF-GS for each scene, which brings all baselines that need no training.

    Args:
        scenes: Names; none takes all.
        radio: Radio of all of them; None takes one that hears each scene.

    Raises:
        RfgsError: A scene or the radio is unknown.
    """
    for scene in scenes:
        if scene not in EVERY_SCENE:
            raise RfgsError(f"--scenes {scene}: expected some of {', '.join(EVERY_SCENE)}")
    if radio is not None:
        preset(radio)
    return [
        Cell(scene, radio or known.radio, "rfgs", 0)
        for scene, known in EVERY_SCENE.items()
        if not scenes or scene in scenes
    ]


def ranked_baselines(methods: Mapping[str, Any]) -> dict[str, float]:
    """Mean F10 of all that is not ours and finds any of the surface, the strongest first.

    Args:
        methods: Groups of metrics by name, as a cell's file holds them.
    """
    scores = {name: groups["geometry"].get("f10") for name, groups in methods.items()}
    found = {name: f10 for name, f10 in scores.items() if f10 and is_baseline(name)}
    return dict(sorted(found.items(), key=lambda row: -row[1]))
