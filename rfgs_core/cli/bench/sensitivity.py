# SPDX-License-Identifier: Apache-2.0
"""`rfgs bench sensitivity`: how much radio it takes."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from rfgs_core.cli.spreading import Spreading, need_folder, watched
from rfgs_core.device import Device

if TYPE_CHECKING:
    from rfgs_core.schedule.spread import Spread
    from rfgs_core.study.sensitivity import Setup, SetupPart, Sweep

SweepName = Literal["bandwidth", "elements", "devices", "depth", "noise", "people", "walls"]


@dataclass(frozen=True, kw_only=True)
class Sensitivity:
    """F-scores against radio, depth, noise, people and walls, one thing changed at a time."""

    out: Path
    """Folder of datasets, runs, tables and the picture; what is finished is kept, and the same
    command goes on where it stopped."""
    radio: str = "wifi"
    """Preset that is changed."""
    scene: str = "living_room_walk"
    """Which of the twelve scenes."""
    sweeps: tuple[SweepName, ...] = ()
    """What is changed; left out: everything."""
    seed: int = 0
    """Seed of the trainings."""
    device: Device = "cpu"
    """Where Gaussians are trained: cpu, or cuda, the current GPU."""
    spread: Annotated[Spreading, tyro.conf.arg(name="")] = field(default_factory=Spreading)
    json: Path | None = None
    """Also write the rows to this file."""

    def run(self) -> int:
        """Makes what is missing, prints the tables and writes OUT/RADIO.md and OUT/RADIO.png.

        Returns:
            0 when no setting is missing, else 1.

        Raises:
            RfgsError: An option is out of range, or there are no workers.
        """
        from rfgs_core.device import need_device
        from rfgs_core.errors import RfgsError
        from rfgs_core.study.sensitivity import SetupPart, every_setup, stored, sweeps
        from rfgs_core.study.sensitivity_rows import sweep_rows, sweep_table

        need_device(self.device)
        need_folder(self.out)
        spread = self.spread.checked()
        every = sweeps(self.radio, self.scene, self.seed)
        for name in self.sweeps:
            if name not in every:
                raise RfgsError(
                    f"--sweeps {name}: {self.scene} has none; expected some of {', '.join(every)}"
                )
        chosen = {name: every[name] for name in self.sweeps or every}
        parts = [SetupPart(setup, self.device) for setup in every_setup(chosen)]
        results: dict[Setup, Mapping[str, Any]] = {}
        failed: dict[str, str] = {}
        walk = partial(self._outcomes, parts, spread)
        for part, failure in watched(walk, len(parts), "sensitivity", "setting"):
            found = None if failure else stored(part.setup, self.out)
            if found is None:
                failed[str(part)] = failure
            else:
                results[part.setup] = found
            self._write(chosen, results, failed)
        sys.stdout.write(sweep_table(sweep_rows(chosen, results)))
        for name, why in failed.items():
            sys.stdout.write(f"failed, and without figures: {name}: {why}\n")
        return 1 if failed else 0

    def _outcomes(
        self, parts: Sequence[SetupPart], spread: Spread, tell: Callable[[str], None]
    ) -> Iterator[tuple[SetupPart, str]]:
        from rfgs_core.cli.calls import call
        from rfgs_core.study.parts import outcomes
        from rfgs_core.study.sensitivity import stored

        def generate(part: SetupPart) -> None:
            call(*part.setup.generate(self.out))

        def finished(part: SetupPart) -> bool:
            return stored(part.setup, self.out) is not None

        return outcomes(parts, self.out, spread, finished, generate, tell)

    def _write(
        self,
        chosen: Mapping[str, Sweep],
        results: Mapping[Setup, Mapping[str, Any]],
        failed: Mapping[str, str],
    ) -> None:
        """Writes the tables and the picture so far."""
        from dataclasses import asdict

        from rfgs_core.bench import hardware
        from rfgs_core.evaluate.provenance import now
        from rfgs_core.figures.sweeps import write_sweeps
        from rfgs_core.files import write_json, write_text
        from rfgs_core.study.sensitivity_rows import sweep_rows, sweep_table

        rows = sweep_rows(chosen, results)
        write_text(self.out / f"{self.radio}.md", sweep_table(rows))
        write_sweeps(self.out / f"{self.radio}.png", rows)
        if self.json is not None:
            about = {"scene": self.scene, "radio": self.radio, "seed": self.seed}
            found = {"rows": [asdict(row) for row in rows], "failed": dict(failed)}
            write_json(self.json, {**about, **found, **hardware(), "date": now()})
