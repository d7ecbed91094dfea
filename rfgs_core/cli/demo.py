# SPDX-License-Identifier: Apache-2.0
"""`rfgs demo`: the whole loop, from the Blender scene to Gaussians back in Blender."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from rfgs_core.cli.calls import call

RADIOS = ("wifi", "mmwave")
_SETTINGS = "settings.json"


@dataclass(frozen=True)
class DemoArgs:
    """Runs the whole loop on the living room and writes DEMO/report.html.

    Stages: generate a dataset from the Blender scene, validate it, train on Wi-Fi and on
    mmWave, evaluate beside the baselines, bring the Gaussians back into Blender. Finished
    stages are kept: a second run with the same settings only writes the report.
    """

    out: Path = Path("demo")
    """Folder of the demo."""
    scene: str = "living_room_walk"
    """Scene name (see `rfgs-factory scenes`) or a .blend file."""
    frames: str = "10:45:5"
    """Frames A:B:STEP of the scene."""
    cameras: int = 6
    """Cameras to render ground truth from."""
    resolution: int = 192
    """Pixels per picture side."""
    depth: int = 2
    """Bounces of the radio paths that meet the person: 1 is direct only."""
    seed: int = 0
    """Root seed."""


class Stages:
    """Runs stages once, remembers how long each took, and says which are already done."""

    def __init__(self, out: Path) -> None:
        self._path = out / "timings.json"
        self.seconds: dict[str, float] = _kept(self._path, dict[str, float]) or {}

    def run(self, name: str, done: Path, work: Callable[[], None]) -> None:
        """Runs `work` unless `done` exists and the stage was timed, that is, finished."""
        from rfgs_core.seals import write_sealed_json

        if done.exists() and name in self.seconds:
            sys.stderr.write(f"[{name}] done before ({self.seconds[name]:.0f} s)\n")
            return
        sys.stderr.write(f"[{name}]\n")
        begin = time.perf_counter()
        work()
        self.seconds[name] = round(time.perf_counter() - begin, 1)
        write_sealed_json(self._path, self.seconds)


def keep_settings(args: DemoArgs) -> None:
    """Remembers what a demo was asked for, once its dataset shows that it can be had."""
    from rfgs_core.seals import write_sealed_json

    write_sealed_json(args.out / _SETTINGS, _asked(args))


def _kept(path: Path, kind: Any) -> Any:
    """What an earlier call has kept in a file; None where there was none.

    Raises:
        RfgsFormatError: The file has changed since.
    """
    from rfgs_core.records import record
    from rfgs_core.seals import read_sealed_json

    if not path.exists():
        return None
    return record(path, read_sealed_json(path, "delete it"), kind)


def _asked(args: DemoArgs) -> dict[str, Any]:
    return {name: value for name, value in asdict(args).items() if name != "out"}


def refuse_other_settings(args: DemoArgs) -> None:
    """Refuses a folder with a demo of other settings: stages are only good for their own.

    Raises:
        RfgsError: The folder holds such a demo.
    """
    from rfgs_core.errors import RfgsError

    asked = _asked(args)
    found = _kept(args.out / _SETTINGS, dict[str, Any]) or asked
    differing = [name for name, value in asked.items() if found.get(name) != value]
    if differing:
        raise RfgsError(
            f"{args.out} holds a demo with another {', '.join(differing)}; choose another --out or "
            "delete that folder"
        )


def _scene_file(scene: str) -> Path:
    """The .blend of a scene of ours or of the user's own."""
    own = Path(__file__).resolve().parents[2] / "blender_scenes" / f"{scene}.blend"
    return own if own.exists() else Path(scene)


def _generate(args: DemoArgs, dataset: Path) -> None:
    radios = [word for radio in RADIOS for word in ("--radio", radio)]
    call(
        "dataset_factory", "generate", args.scene, *radios,
        *("--frames", args.frames, "--out", dataset, "--seed", str(args.seed)),
        *("--cameras", str(args.cameras), "--resolution", str(args.resolution)),
        *("--depth", str(args.depth), "--workers", str(max(os.cpu_count() or 1, 1))),
    )  # fmt: skip
    keep_settings(args)


def _inspect(args: DemoArgs, run: Path) -> None:
    target = args.out / "inspect.blend"
    call(
        "addon_rfgs", "--blend", _scene_file(args.scene), "import", run,
        "--out", target, "--picture", args.out / "inspect.png",
    )  # fmt: skip


def run(args: DemoArgs) -> int:
    """Runs all stages; exit code 0 when the report is there."""
    from rfgs_core.report import write_demo_report
    from rfgs_core.run import open_run

    refuse_other_settings(args)
    stages = Stages(args.out)
    dataset = args.out / "dataset"
    runs = {radio: args.out / f"run-{radio}" for radio in RADIOS}
    stages.run("generate", dataset / "dataset.json", lambda: _generate(args, dataset))
    stages.run(
        "validate",
        dataset / "dataset.json",
        lambda: call("dataset_factory", "validate", dataset),
    )
    stages.run("preview", dataset / "log", lambda: call("dataset_factory", "preview", dataset))
    for radio, folder in runs.items():
        train = ("rfgs_core.cli", "train", dataset, "--radio", radio, "--out", folder)
        seed = ("--seed", str(args.seed))
        stages.run(f"train {radio}", folder / "point_cloud.ply", lambda c=(*train, *seed): call(*c))
        evaluate = ("rfgs_core.cli", "eval", folder)
        stages.run(f"evaluate {radio}", folder / "metrics.json", lambda c=evaluate: call(*c))
        stages.run(
            f"report {radio}",
            folder / "report.html",
            lambda f=folder: call("rfgs_core.cli", "report", f),
        )
    picture = args.out / "inspect.png"
    stages.run("back to Blender", picture, lambda: _inspect(args, runs[RADIOS[-1]]))
    page = write_demo_report(
        args.out, [open_run(folder) for folder in runs.values()], stages.seconds
    )
    total = sum(stages.seconds.values()) / 60
    sys.stdout.write(f"{page} written; all stages together took {total:.1f} minutes\n")
    return 0
