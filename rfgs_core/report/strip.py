# SPDX-License-Identifier: Apache-2.0
"""The strip of a table: the true surface, ours and whatever it is held against, side by side."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from PIL import Image

from rfgs_core.evaluate.scene import Scene
from rfgs_core.figures.clouds import FARTHEST_M
from rfgs_core.figures.style import new_figure, power_colours, write_picture
from rfgs_core.report.stage import points_of, staged
from rfgs_core.report.tables import show
from rfgs_core.run import open_run
from rfgs_core.study.cell_rows import label
from rfgs_core.study.gallery import ranked_baselines
from rfgs_core.study.paper_tables import FIELDS, Cell
from rfgs_core.study.sensitivity_rows import OF_BODIES

#: Panels side by side, and the size of one [in].
_ACROSS, _WIDTH_IN, _HEIGHT_IN = 6, 1.7, 2.5
#: Share of a panel around the true surface: images are larger.
_MARGIN = 0.3
#: The image that neural fields are fitted to, shown whether it is the strongest or not.
_PLAIN = "matched_filter_all_sum"


class Shown(NamedTuple):
    """A panel."""

    title: str
    """Who it is of, and how good that is."""
    picture: Image.Image
    """The picture, transparent beside what is drawn."""


def write_strip(path: Path, made: Mapping[Cell, Mapping[str, Any]], out: Path) -> None:
    """Writes a PNG: the first frame of each scene and radio as every method has it.

    Each is drawn by the voxels that its scores are told from, their colours by the distance to
    the true surface. Of neural fields those are shown that the paper has, fitted to features and
    without a prior; of baselines our prior alone, the strongest of those that know of no bodies,
    and the plain matched filter. Cells of the first seed; nothing is written without any.

    Args:
        path: The picture.
        made: What the cells' files say.
        out: Folder of the table.
    """
    rows = []
    for scene, radio in dict.fromkeys((cell.scene, cell.radio) for cell in made):
        here = {cell: made[cell] for cell in made if (cell.scene, cell.radio) == (scene, radio)}
        first = min(cell.seed for cell in here)
        shown = list(panels_of({c: one for c, one in here.items() if c.seed == first}, out))
        rows += [
            (f"{scene}, {radio}", shown[at : at + _ACROSS]) for at in range(0, len(shown), _ACROSS)
        ]
    if not rows:
        return
    with new_figure(_WIDTH_IN * _ACROSS, _HEIGHT_IN * len(rows) + 0.5) as figure:
        panels = figure.subplots(len(rows), _ACROSS, squeeze=False)
        for axes, (where, shown) in zip(panels, rows, strict=True):
            for axis in axes:
                axis.set_axis_off()
            axes[0].text(-0.08, 0.5, where, rotation=90, va="center", transform=axes[0].transAxes)
            for axis, one in zip(axes, shown, strict=False):
                axis.imshow(np.asarray(one.picture), interpolation="none")
                axis.set_title(one.title, fontsize=7.5)
        _add_scale(figure, panels)
        write_picture(figure, path)


def panels_of(cells: Mapping[Cell, Mapping[str, Any]], out: Path) -> Iterator[Shown]:
    """The panels of one scene and radio: the truth, ours, its baselines, then who was trained.

    Args:
        cells: What the files of its cells say; without any run there are no panels.
        out: Folder of the table.
    """
    runs = {cell: open_run(place) for cell in cells if (place := out / "runs" / cell.name).exists()}
    if not runs:
        return
    sequence, frame = (first := next(iter(runs.values()))).sequence, first.frames[0]
    stage = staged(sequence, [frame], _MARGIN)
    yield Shown("true surface\n", stage.truth(frame))
    for cell, found in cells.items():
        scene = Scene.of(runs[cell]) if cell in runs else None
        points = _kept(cell, found) if scene is None else points_of(scene, frame)
        if points is not None:
            yield _titled(cell.method, found["methods"], stage.voxels(points, frame))
        if scene is not None and cell.method == "rfgs":
            for name in _baselines(found["methods"]):
                points = points_of(scene, frame, name)
                yield _titled(name, found["methods"], stage.voxels(points, frame))


def _kept(cell: Cell, found: Mapping[str, Any]) -> np.ndarray | None:
    """Voxels of a neural field as the paper has it [m], shape (n, 3); None of any other cell."""
    field = FIELDS.get(cell.method)
    if field is None or field.prior or field.objective != "features" or not found.get("voxels"):
        return None
    return np.asarray(found["voxels"], dtype=np.float64)


def _baselines(methods: Mapping[str, Any]) -> Iterator[str]:
    """Names of the baselines that are shown."""
    ranked = list(ranked_baselines(methods))
    bodiless = [name for name in ranked if name not in OF_BODIES]
    wanted = ["body_prior", *bodiless[:1], _PLAIN]
    yield from (name for name in dict.fromkeys(wanted) if name in ranked)


def _titled(method: str, methods: Mapping[str, Any], picture: Image.Image) -> Shown:
    """A panel with its name and its F-scores over all frames."""
    scores = methods[method]["geometry"]
    words = label(method).replace("paper's recipe, from our start, ", "")
    told = f"F5 {show(scores['f05'], 2)}, F10 {show(scores['f10'], 2)}"
    return Shown(f"{words}\n{told}", picture)


def _add_scale(figure: Any, panels: np.ndarray) -> None:
    """What the colours mean."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    scale = ScalarMappable(Normalize(0.0, 100 * FARTHEST_M), power_colours())
    bar = figure.colorbar(
        scale, ax=panels, orientation="horizontal", shrink=0.4, aspect=40, pad=0.02
    )
    bar.set_label("distance to the true surface [cm], and farther")
