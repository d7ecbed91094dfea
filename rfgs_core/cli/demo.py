# SPDX-License-Identifier: Apache-2.0
"""`rfgs demo`: the whole loop, from the Blender scene to Gaussians back in Blender."""

from __future__ import annotations

import contextlib
import os
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

from rfgs_core.cli.calls import beside, call
from rfgs_core.errors import RfgsError

RADIOS: tuple[Literal["wifi", "mmwave"], ...] = ("wifi", "mmwave")
_SETTINGS = "settings.json"
#: The two radios' stages run side by side where so much memory is free [bytes]: each takes some
#: 3 GB, and with less the machine would swap.
_ENOUGH = 8 * 2**30


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
    only: Literal["wifi", "mmwave"] | None = None
    """Only train on this radio, evaluate and report, once the dataset is there: so the demo runs
    the two side by side."""


class Stages:
    """Runs stages once, remembers how long each took, and says which are already done."""

    def __init__(self, out: Path, name: str = "timings") -> None:
        self._path = out / f"{name}.json"
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
    return {name: value for name, value in asdict(args).items() if name not in ("out", "only")}


def refuse_other_settings(args: DemoArgs) -> None:
    """Refuses a folder with a demo of other settings: stages are only good for their own.

    Raises:
        RfgsError: The folder holds such a demo.
    """
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
        "addon_rfgs", "--blend", _scene_file(args.scene), "import", run, "--samples", "8",
        "--out", target, "--picture", args.out / "inspect.png",
    )  # fmt: skip


def run(args: DemoArgs) -> int:
    """Runs all stages; exit code 0 when the report is there."""
    from rfgs_core.report import write_demo_report
    from rfgs_core.run import open_run

    refuse_other_settings(args)
    runs = {radio: _run_of(args, radio) for radio in RADIOS}
    if args.only is not None:
        if not (_dataset(args) / "dataset.json").exists():
            raise RfgsError(f"{_dataset(args)}: no dataset yet; run `rfgs demo` without --only")
        _one_radio(args, args.only)
        return 0
    stages, dataset = Stages(args.out), _dataset(args)
    stages.run("generate", dataset / "dataset.json", lambda: _generate(args, dataset))
    stages.run(
        "validate",
        dataset / "dataset.json",
        lambda: call("dataset_factory", "validate", dataset),
    )
    stages.run("preview", dataset / "log", lambda: call("dataset_factory", "preview", dataset))
    results = [args.out / "inspect.png", *(folder / "report.html" for folder in runs.values())]
    missing = next((path for path in results if not path.exists()), results[0])
    stages.run(" and ".join(RADIOS), missing, lambda: _radios(args))
    parts = [Stages(args.out, f"timings-{radio}").seconds for radio in RADIOS]
    seconds = {**stages.seconds, **{f"– {n}": s for part in parts for n, s in part.items()}}
    page = write_demo_report(args.out, [open_run(folder) for folder in runs.values()], seconds)
    total = sum(stages.seconds.values()) / 60
    sys.stdout.write(f"{page} written; all stages together took {total:.1f} minutes\n")
    return 0


def _dataset(args: DemoArgs) -> Path:
    return args.out / "dataset"


def _run_of(args: DemoArgs, radio: str) -> Path:
    return args.out / f"run-{radio}"


def _radios(args: DemoArgs) -> None:
    """The stages of all radios, side by side where the machine can."""
    import psutil

    first, *others = RADIOS
    with contextlib.ExitStack() as at_work:
        for radio in others:
            if psutil.virtual_memory().available < _ENOUGH or (os.cpu_count() or 1) < 2:
                at_work.callback(_one_radio, args, radio)
                continue
            log = args.out / f"{radio}.log"
            sys.stderr.write(f"[{radio}] at work beside {first}; {log} tells how far it is\n")
            asked = [(f"--{name}", str(value)) for name, value in _asked(args).items()]
            words = [word for pair in asked for word in pair]
            command = ("rfgs_core.cli", "demo", "--out", args.out, *words, "--only", radio)
            at_work.enter_context(beside(*command, log=log))
        _one_radio(args, first)


def _one_radio(args: DemoArgs, radio: str) -> None:
    """Trains on one radio, evaluates and reports; the last one's Gaussians go back to Blender."""
    stages, folder = Stages(args.out, f"timings-{radio}"), _run_of(args, radio)
    train = ("rfgs_core.cli", "train", _dataset(args), "--radio", radio, "--out", folder)
    seed = ("--seed", str(args.seed))
    stages.run(f"train {radio}", folder / "point_cloud.ply", lambda: call(*train, *seed))
    evaluate = ("rfgs_core.cli", "eval", folder)
    stages.run(f"evaluate {radio}", folder / "metrics.json", lambda: call(*evaluate))
    report = folder / "report.html"
    stages.run(f"report {radio}", report, lambda: call("rfgs_core.cli", "report", folder))
    if radio == RADIOS[-1]:
        stages.run("back to Blender", args.out / "inspect.png", lambda: _inspect(args, folder))
