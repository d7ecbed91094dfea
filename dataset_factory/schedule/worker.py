# SPDX-License-Identifier: Apache-2.0
"""What runs inside a worker: it keeps a scene loaded and traces one frame after the other.

A worker is a process with one thread, since Dr.Jit and numba run best so. It shares nothing with
the process that writes the dataset: scenes and moving meshes come along with the frames, channels
go back.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numba
import numpy as np

from dataset_factory.plan.contents import versions
from dataset_factory.plan.tracers import TracerName, TracingDevice
from dataset_factory.scene.bundle import BundleFrame, frame_file, read_bundle
from rfgs_core.dataset.path_store import write_paths
from rfgs_core.dataset.schema import device_pose, radio_from_json
from rfgs_core.radio.path_table import PathTable
from rfgs_core.schedule.answers import Answer, answer_of, begin, refuse_other_versions
from rfgs_core.schedule.archive import unpack

if TYPE_CHECKING:
    from dataset_factory.trace import AnyTracer, Tracer


@dataclass(frozen=True)
class Task:
    """One frame of one radio."""

    radio: str
    """Preset name."""
    frame: int | None
    """Frame number; None is the static channel."""

    def __str__(self) -> str:
        return f"{self.radio}, " + ("static" if self.frame is None else f"frame {self.frame}")


class Traced(NamedTuple):
    """What was traced of a frame."""

    channel: np.ndarray
    """Its channel."""
    paths: bytes
    """Its table of paths as a file; empty if there is none."""


@dataclass(frozen=True)
class Request:
    """What a run asks of every worker."""

    key: str
    """Tells this run from others that a worker may know."""
    radios: dict[str, Any]
    """Radios by name, as JSON holds them."""
    devices: dict[str, list[dict[str, Any]]]
    """Device poses by radio, as JSON holds them."""
    depth: int
    """Interactions of a path; radios that cannot go so deep go as deep as they can."""
    shadow: Any
    """How bodies shadow paths."""
    tracer: TracerName
    """What traces."""
    device: TracingDevice
    """What Sionna RT traces on."""
    seed: int
    """Root seed."""
    paths: bool
    """Whether tables of paths are wanted too."""
    versions: dict[str, str]
    """Versions of the packages that make the data."""
    log: str = ""
    """Folder for what libraries print; empty leaves it where it goes."""


class SceneTracer:
    """Traces frames of one scene, with the tracer of the current radio loaded."""

    def __init__(self, request: Request, bundle: Path) -> None:
        """Opens the scene."""
        if request.tracer == "fast":
            numba.set_num_threads(1)
        else:
            from dataset_factory.trace.setup import prepare

            prepare(threads=1, device=request.device)
        self._request = request
        self._bundle = read_bundle(bundle)
        self._radio = ""
        self._tracer: AnyTracer | None = None

    def trace(self, task: Task) -> tuple[np.ndarray, PathTable | None, dict[str, float]]:
        """Channel of a frame, the paths behind it if they are wanted, and seconds per stage."""
        known = self._tracer if self._radio == task.radio else None
        before = dict(known.timings) if known else {}
        tracer = known or self._load(task.radio)
        frame = None if task.frame is None else self._bundle.frame(task.frame)
        value, table = self._traced(tracer, frame)
        spent = {stage: s - before.get(stage, 0.0) for stage, s in tracer.timings.items()}
        return value, table, spent

    def _traced(
        self, tracer: AnyTracer, frame: BundleFrame | None
    ) -> tuple[np.ndarray, PathTable | None]:
        if self._request.paths:
            # Not sooner: importing it takes seconds, and the fast tracer does without Sionna RT.
            from dataset_factory.trace import Tracer

            if isinstance(tracer, Tracer):
                return _with_paths(tracer, frame)
        return tracer.static() if frame is None else tracer.samples(frame), None

    def _load(self, radio: str) -> AnyTracer:
        from dataset_factory.trace import tracer_class

        request = self._request
        devices = [device_pose(row) for row in request.devices[radio]]
        spec = radio_from_json(self._bundle.path, request.radios[radio])
        # The one before is dropped first: two scenes at once would take twice the memory.
        self._tracer, self._radio = None, radio
        tracer = tracer_class(request.tracer, spec)(
            self._bundle,
            spec,
            devices,
            depth=min(request.depth, spec.deepest),
            shadow=request.shadow,
            seed=request.seed,
        )
        self._tracer = tracer
        return tracer


def _with_paths(tracer: Tracer, frame: BundleFrame | None) -> tuple[np.ndarray, PathTable | None]:
    """Channel of a frame and the paths behind it."""
    if frame is None:
        return tracer.static(), tracer.static_paths()
    trace = tracer.trace(frame)
    return tracer.samples(frame, trace), tracer.paths(frame, trace)


class _Place:
    """Where this worker keeps the scene of a run."""

    def __init__(self, request: Request, scene: bytes, worker: Any) -> None:
        refuse_other_versions(versions(), request.versions)
        if request.log:
            begin(Path(request.log) / f"worker{worker.name}.log")
        self.key, self.frames = request.key, 0
        self._folder = tempfile.TemporaryDirectory(prefix="rfgs-", dir=worker.local_directory)
        self.path = Path(self._folder.name)
        self.bundle = self.path / "bundle"
        unpack(scene, self.bundle)
        (self.bundle / "frames").mkdir()
        self.tracer = SceneTracer(request, self.bundle)

    def close(self) -> None:
        """Removes the scene."""
        self._folder.cleanup()


_place: _Place | None = None


def trace_frame(request: Request, scene: bytes, moving: bytes, task: Task) -> Answer[Traced]:
    """Traces one frame.

    Args:
        request: What the run asks of every worker.
        scene: The scene without its frames, an archive.
        moving: What moves at the frame, as the scene's file; empty for the static channel.
        task: The frame.

    Raises:
        RfgsError: The scene cannot be traced, or other packages would trace it than elsewhere.
    """
    from distributed import get_worker

    global _place
    worker: Any = get_worker()
    if _place is None or _place.key != request.key:
        close_place()
        _place = _Place(request, scene, worker)
    if task.frame is not None:
        frame_file(_place.bundle, task.frame).write_bytes(moving)
    value, table, seconds = _place.tracer.trace(task)
    paths = b""
    if table is not None:
        file = _place.path / "paths.npz"
        write_paths(file, table)
        paths = file.read_bytes()
    _place.frames += 1
    return answer_of(worker, Traced(value, paths), seconds, _place.frames)


def close_place() -> None:
    """Drops what a run has left in this worker."""
    global _place
    if _place is not None:
        _place.close()
        _place = None
