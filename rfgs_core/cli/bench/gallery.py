# SPDX-License-Identifier: Apache-2.0
"""`rfgs bench gallery`: every scene on one page."""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from rfgs_core.cli.bench.tables import outcomes
from rfgs_core.cli.spreading import Spreading, need_folder, watched
from rfgs_core.device import Device

if TYPE_CHECKING:
    from rfgs_core.report.page import Tile
    from rfgs_core.study.paper_tables import Cell


@dataclass(frozen=True, kw_only=True)
class Gallery:
    """A page of every scene: true surface, our Gaussians and the strongest baseline, playing."""

    out: Path
    """Folder of the page, and of datasets, runs and cells; what is finished is kept, and the same
    command goes on where it stopped. May be that of table1 --size paper-cpu."""
    scenes: tuple[str, ...] = ()
    """Which scenes; left out: all of ours."""
    radio: str | None = None
    """Radio of all scenes; left out: mmwave, and wifi behind walls and outdoors."""
    device: Device = "cpu"
    """Where Gaussians are trained: cpu, or cuda, the current GPU."""
    spread: Annotated[Spreading, tyro.conf.arg(name="")] = field(default_factory=Spreading)

    def run(self) -> int:
        """Makes what is missing, and writes OUT/gallery.html.

        Returns:
            0 when every scene has an answer, else 1.

        Raises:
            RfgsError: An option is out of range, or there are no workers.
        """
        from tqdm import tqdm

        from rfgs_core.device import need_device
        from rfgs_core.report.gallery import write_gallery
        from rfgs_core.study.gallery import SIZE, gallery_cells

        need_device(self.device)
        need_folder(self.out)
        spread = self.spread.checked()
        chosen = gallery_cells(self.scenes, self.radio)
        failed: dict[Cell, str] = {}
        walk = partial(outcomes, chosen, self.out, SIZE, self.device, spread)
        for cell, failure in watched(walk, len(chosen), "gallery", "scene"):
            if failure:
                failed[cell] = failure.replace(f"{self.out}{os.sep}", "")
        with tqdm(chosen, desc="pictures", unit="scene") as bar:
            tiles = [self._tile(cell, failed.get(cell, "")) for cell in bar]
        page = self.out / "gallery.html"
        write_gallery(page, tiles, self._command())
        sys.stdout.write(f"{page} written, {page.stat().st_size / 1e6:.1f} MB\n")
        for cell, why in failed.items():
            sys.stdout.write(f"failed, and without an answer: {cell.name}: {why}\n")
        return 1 if failed else 0

    def _command(self) -> str:
        """What was asked for, apart from places."""
        words = ["rfgs bench gallery"]
        words += ["--scenes", *self.scenes] if self.scenes else []
        words += ["--radio", self.radio] if self.radio else []
        return " ".join(words)

    def _tile(self, cell: Cell, failure: str) -> Tile:
        from rfgs_core.report.gallery import tile_of, tile_without_run
        from rfgs_core.run import open_run
        from rfgs_core.study.cells import stored
        from rfgs_core.study.gallery import SIZE

        found = None if failure else stored(cell, self.out, SIZE)
        if found is None:
            return tile_without_run(cell.scene, cell.radio, self.out / cell.dataset, failure)
        return tile_of(open_run(self.out / "runs" / cell.name), found["methods"])
