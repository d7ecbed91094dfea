# SPDX-License-Identifier: Apache-2.0
"""One tracing process: reads tasks from its standard input until that closes.

A process of its own, not a thread, because Dr.Jit scales best with one thread per process; and
one that ends when its parent does, however that happened, because its input closes then.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import time
import traceback
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from dataset_factory.bundle import Bundle, read_bundle
from rfgs_core.dataset.csi_store import write_csi
from rfgs_core.dataset.names import SequenceFiles
from rfgs_core.dataset.path_store import write_paths
from rfgs_core.dataset.schema import device_pose, radio_from_json
from rfgs_core.errors import RfgsError
from rfgs_core.radio.path_table import PathTable

if TYPE_CHECKING:
    from dataset_factory.trace import ApertureTracer, Tracer


class Worker:
    """Traces frames of one job, keeping the scene of the current radio loaded."""

    def __init__(self, job: dict[str, Any]) -> None:
        """Opens the scene.

        Args:
            job: `bundle` (folder), `sequence` (folder the channels go to), `devices` by radio,
                `depth` (radios that cannot go so deep go as deep as they can), `shadow`, `seed`
                and `paths` (whether tables of paths are written too).
        """
        from dataset_factory.trace.setup import prepare

        prepare(threads=1)
        self.job = job
        self.bundle: Bundle = read_bundle(Path(job["bundle"]))
        self.radio = ""
        self.tracer: Tracer | ApertureTracer | None = None

    def trace(self, radio: str, frame: int | None, file: str | None) -> dict[str, float]:
        """Traces one frame and stores it.

        Args:
            radio: Name of the radio.
            frame: Frame number; None is the static channel.
            file: A `.npy` file to write instead of the job's sequence, which may not be at hand;
                a table of paths is written beside it, as `.npz`.

        Returns:
            Seconds spent on it per stage.
        """
        before = dict(self.tracer.timings) if self.tracer and self.radio == radio else {}
        tracer = self._tracer(radio)
        value, table = self._traced(tracer, frame)
        spent = {stage: s - before.get(stage, 0.0) for stage, s in tracer.timings.items()}
        start = time.perf_counter()
        if file is not None:
            np.save(file, value)
            if table is not None:
                write_paths(Path(file).with_suffix(".npz"), table)
        else:
            files = SequenceFiles(Path(self.job["sequence"]))
            if table is not None:
                # Before the channel, whose marker says that the frame is whole.
                write_paths(files.paths(radio, frame), table)
            index = None if frame is None else self.bundle.frames.index(frame)
            write_csi(files.csi(radio), index, value, files.csi_done(radio, frame))
        return {**spent, "write": time.perf_counter() - start}

    def _traced(
        self, tracer: Tracer | ApertureTracer, frame: int | None
    ) -> tuple[np.ndarray, PathTable | None]:
        """Channel of a frame, and the paths behind it if they are wanted."""
        from dataset_factory.trace import Tracer

        if not (self.job["paths"] and isinstance(tracer, Tracer)):
            value = tracer.static() if frame is None else tracer.samples(self.bundle.frame(frame))
            return value, None
        if frame is None:
            return tracer.static(), tracer.static_paths()
        moving = self.bundle.frame(frame)
        trace = tracer.trace(moving)
        return tracer.samples(moving, trace), tracer.paths(moving, trace)

    def _tracer(self, radio: str) -> Tracer | ApertureTracer:
        from dataset_factory.trace import ApertureTracer, Tracer

        if self.tracer is None or self.radio != radio:
            devices = [device_pose(row) for row in self.job["devices"][radio]]
            spec = radio_from_json(self.bundle.path, self.job["radios"][radio])
            self.radio = radio
            kind = ApertureTracer if spec.antennas_move else Tracer
            self.tracer = kind(
                self.bundle,
                spec,
                devices,
                depth=min(self.job["depth"], spec.deepest),
                shadow=self.job["shadow"],
                seed=self.job["seed"],
            )
        return self.tracer


def serve(tasks: IO[str], replies: IO[str]) -> None:
    """Answers each task with one line of JSON: seconds per stage, or an error."""
    worker: Worker | None = None
    for line in tasks:
        request = json.loads(line)
        try:
            if worker is None:
                worker = Worker(request)
                reply: dict[str, Any] = {"ready": True}
            else:
                reply = {"seconds": worker.trace(**request)}
        except RfgsError as error:
            reply = {"error": str(error)}
        except OSError as error:
            reply = {"error": str(error), "errno": error.errno, "file": str(error.filename or "")}
            traceback.print_exc()
        except Exception as error:
            # Sent to the parent, which ends the run: a fault of ours or of the ray tracer.
            reply = {"error": f"{type(error).__name__}: {error}", "crash": True}
            traceback.print_exc()
        replies.write(json.dumps(reply) + "\n")
        replies.flush()


def main() -> None:
    """Keeps standard output for replies; whatever libraries print goes to the log."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with os.fdopen(os.dup(1), "w", encoding="utf-8") as replies:
        os.dup2(2, 1)
        serve(sys.stdin, replies)


if __name__ == "__main__":
    main()
