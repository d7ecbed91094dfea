# SPDX-License-Identifier: Apache-2.0
"""One run of the factory: what to make, where, and how long each stage took."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from dataset_factory.plan.contents import Plan
from dataset_factory.plan.tracers import TracingDevice
from dataset_factory.scene.blender import Blender, Progress
from dataset_factory.scene.bundle import sanitised
from dataset_factory.scene.overrides import overrides_file
from rfgs_core.dataset.names import SequenceFiles
from rfgs_core.files import write_json
from rfgs_core.past import Clock, Speed
from rfgs_core.timings import Timings


@dataclass
class Job:
    """One run of the factory on one folder."""

    out: Path
    """Folder of the dataset."""
    plan: Plan
    """What it shall hold."""
    blender: Blender
    """Opens the scene."""
    workers: int
    """Worker processes; on a cluster, those that it has when tracing begins."""
    worker_memory_gb: float = 0.0
    """Memory that each of them may take [GB]; 0 shares the machine's."""
    scheduler: str = ""
    """Address of a Dask scheduler that traces instead; empty for this machine."""
    device: TracingDevice = "auto"
    """What Sionna RT traces on."""
    overrides_label: str = "command line"
    """Where the plan's overrides come from, for messages."""
    seconds: Timings = field(default_factory=Timings)
    """Wall time per stage of this run [s]."""
    speeds: dict[str, Speed] = field(default_factory=dict)
    """Speed of the stages of this run that had enough steps to tell."""
    traced: list[tuple[str, int | None, dict[str, Any]]] = field(default_factory=list)
    """Radio, frame and answer (seconds per stage, memory) of each channel traced in this run."""

    @property
    def work(self) -> Path:
        """Half-made work, removed at the end."""
        return self.out / ".work"

    @property
    def name(self) -> str:
        """Name of the sequence."""
        return sanitised(self.plan.scene)

    @property
    def files(self) -> SequenceFiles:
        """Where the sequence's files lie."""
        return SequenceFiles(self.out / self.name)

    def run_blender(self, name: str, *arguments: str, progress: Progress | None = None) -> None:
        """Runs one of the add-on's commands on the scene with the plan's overrides.

        Raises:
            RfgsError: The command failed; the message is the add-on's own.
        """
        with overrides_file(self.plan.overrides, self.overrides_label) as more:
            self.blender.run(name, *arguments, *more, progress=progress)

    @property
    def picture_size(self) -> list[str]:
        """Arguments of the add-on that choose cameras and resolution."""
        cameras = ["--cameras", str(self.plan.cameras)] if self.plan.cameras else []
        return [*cameras, "--resolution", str(self.plan.resolution)]

    @contextmanager
    def clock(self, name: str) -> Iterator[Clock]:
        """Measures a stage step by step."""
        clock = Clock()
        try:
            yield clock
        finally:
            self.note_speed(name, clock)

    def note_speed(self, name: str, clock: Clock) -> None:
        """Keeps what a clock has to say."""
        speed = clock.speed()
        if speed:
            self.speeds[name] = speed

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Measures a stage; times go to the log, never into the data."""
        try:
            with self.seconds.stage(name):
                yield
        finally:
            rounded = {stage: round(seconds, 3) for stage, seconds in self.seconds.items()}
            write_json(self.out / "log" / "generate.json", {"seconds": rounded})
