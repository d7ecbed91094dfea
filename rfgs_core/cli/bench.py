# SPDX-License-Identifier: Apache-2.0
"""`rfgs bench`: speed as a ratio to the plain twin of the same run."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal

import tyro

from rfgs_core.device import Device


@dataclass(frozen=True)
class BenchArgs:
    """Times a part beside its plain twin, in the same run.

    propagation: 20,000 Gaussians x 64 links x 64 subcarriers, scattering and shadows, forward
    and with gradients. raster: 20,000 Gaussians at 256 x 256 pixels. blender: 1,000,000 Gaussians
    imported and 100,000 per frame played by the add-on, in Blender as a program of its own.
    training: 20,000 Gaussians on one frame of a dataset, until the loss of links that are set
    aside changes by under 1 % over 50 steps; or --gaussians and --steps of your own.
    readers: captures of Intel 5300 beside csiread, and of FeitCSI. real: not speed but how well
    measured data are explained, each part beside a baseline; docs/captures.md names the files.
    tracers: the fast tracer beside Sionna RT on our scenes, as `rfgs-factory tracers`.
    limbs: joints and surface of a dataset's one person beside what knows less.
    people: how often a dataset's people are counted right, beside channels without any; or with
    --data, joints of real people in a public set (MM-Fi, mmBody, HuPR, RT-Pose, M4Human) by our
    network, which saw synthetic radio alone.
    live: six receivers of 1,000 packets/s each over UDP, made here: packets lost, latency, updates.
    fields: the grid search that settings of neural fields, our baselines, were taken from.
    table1, table2, table3: the paper's tables, resumable: methods x Wi-Fi and mmWave; its recipe
    less one part at a time; Wi-Fi, mmWave, UWB and SAR beside baselines. See --size and --out.
    scaling: how the cost of the fast tracer and of propagation grows over two decades of facets,
    Gaussians, links and subcarriers: CPU seconds and exponents, some two minutes.
    performance: a page of how fast the kernels are here, some five minutes; see --out.
    """

    part: tyro.conf.Positional[
        Literal[
            "propagation",
            "raster",
            "blender",
            "training",
            "readers",
            "real",
            "tracers",
            "limbs",
            "people",
            "live",
            "fields",
            "table1",
            "table2",
            "table3",
            "scaling",
            "performance",
        ]
    ]
    """What to time or judge."""
    data: Path | None = None
    """Folder of real captures for the part `real`, or of a public set for the part `people`."""
    blender: Path | None = None
    """Blender program for the part `blender`; else $BLENDER, else pip's bpy."""
    dataset: Path | None = None
    """Dataset for the parts `training`, `limbs`, `people` and `fields`."""
    radio: str = "wifi"
    """Radio for these parts."""
    network: Path | None = None
    """Network for the part `limbs`, and `people` with --data, as `rfgs limbs` makes it; left out:
    the one that comes with the package."""
    hold_out: bool = False
    """For the parts `limbs` and `people`: hide what the dataset holds out, as training does."""
    frames: str | None = None
    """Frames A:B[:STEP] (inclusive) for the part `people`; all when left out."""
    seconds: float = 60.0
    """How long the part `live` follows its receivers [s]."""
    frame: int | None = None
    """Frame for the parts `training` and `fields`; the first one when left out."""
    gaussians: int = 20_000
    """Gaussians for the parts `propagation` and `training`."""
    steps: int | None = None
    """Adam steps for the parts `training` (left out: until the loss stands still) and `fields`."""
    device: Device = "cpu"
    """Where the parts `propagation`, `training` and `performance` run: cpu, or cuda, the current
    GPU."""
    size: Literal["smoke", "paper-cpu", "full"] = "smoke"
    """For the paper's tables: one scene; the study's four with the paper's steps (hours); or these
    with five seeds and larger neural fields (days)."""
    seeds: int | None = None
    """For the paper's tables: trainings of each method; left out: what the size has."""
    out: Path | None = None
    """For the paper's tables: folder of datasets, runs and cells; what is finished is kept. For
    the part `performance`: the page; left out, it is printed."""
    json: Path | None = None
    """Also write the numbers to this file: one flat dictionary, except for `performance`."""


def _bench(args: BenchArgs) -> Callable[[], dict[str, Any]]:
    """What a part runs; nothing of another part is imported."""
    parts: dict[str, Callable[[BenchArgs], dict[str, Any]]] = {
        "blender": _blender,
        "training": _training,
        "real": _real,
        "limbs": _limbs,
        "people": _people,
        "live": _live,
        "fields": _fields,
        "propagation": _propagation,
    }
    if args.part in parts:
        return partial(parts[args.part], args)
    if args.part == "readers":
        from rfgs_core.real.reading import bench_readers

        return bench_readers
    if args.part == "scaling":
        return _scaling
    from rfgs_core.render.bench import bench_raster

    return bench_raster


def _blender(args: BenchArgs) -> dict[str, Any]:
    from rfgs_core.bench import hardware
    from rfgs_core.blender_bench import bench_blender

    return {**bench_blender(args.blender), **hardware()}


def _propagation(args: BenchArgs) -> dict[str, Any]:
    from rfgs_core.bench import PropagationBench, bench_propagation
    from rfgs_core.device import need_device

    need_device(args.device)
    return bench_propagation(PropagationBench(num_gaussians=args.gaussians, device=args.device))


def _training(args: BenchArgs) -> dict[str, Any]:
    from rfgs_core.bench import hardware
    from rfgs_core.errors import RfgsError
    from rfgs_core.fit.bench import TrainingBench, bench_training

    if args.dataset is None:
        raise RfgsError("bench training: expected --dataset FOLDER, see `rfgs-factory generate`")
    bench = TrainingBench(args.gaussians, args.steps, args.device)
    return {**bench_training(args.dataset, args.radio, args.frame, bench), **hardware()}


def _real(args: BenchArgs) -> dict[str, Any]:
    from rfgs_core.errors import RfgsError
    from rfgs_core.real import bench_real

    if args.data is None:
        raise RfgsError("bench real: expected --data FOLDER of captures, see docs/captures.md")
    return bench_real(args.data, _note)


def _limbs(args: BenchArgs) -> dict[str, Any]:
    from tqdm import tqdm

    from rfgs_core.bench import hardware
    from rfgs_core.dataset import open_dataset
    from rfgs_core.errors import RfgsError
    from rfgs_core.evaluate.limbs import limb_table
    from rfgs_core.limbs.weights import load_network, own_network

    if args.dataset is None:
        raise RfgsError("bench limbs: expected --dataset FOLDER, see `rfgs-factory generate`")
    sequence = open_dataset(args.dataset).sequence()
    freq_hz = sequence.coordinates(args.radio)["freq_hz"].values
    trained = load_network(args.network) if args.network else own_network(freq_hz)
    network = None if trained is None else trained.network
    with tqdm(total=len(sequence.frames), desc="limbs") as bar:
        table = limb_table(
            sequence, args.radio, network, sequence.frames,
            everything=not args.hold_out, on_frame=bar.update,
        )  # fmt: skip
    flat = {
        f"{row}: {name}": value for row, values in table.items() for name, value in values.items()
    }
    return {**flat, "frames": len(sequence.frames), **hardware()}


def _people(args: BenchArgs) -> dict[str, Any]:
    from tqdm import tqdm

    from rfgs_core.bench import hardware
    from rfgs_core.dataset import open_dataset
    from rfgs_core.errors import RfgsError
    from rfgs_core.evaluate.head_count import head_count_table
    from rfgs_core.frames import chosen_frames
    from rfgs_core.threads import one_torch_thread

    if args.data is not None and args.dataset is None:
        return _people_set(args, args.data)
    if args.dataset is None or args.data is not None:
        raise RfgsError(
            "bench people: expected --dataset FOLDER of ours, see `rfgs-factory generate`, or "
            "--data FOLDER of a public set, see docs/captures.md"
        )
    sequence = open_dataset(args.dataset).sequence()
    frames = chosen_frames(args.frames, sequence.frames)
    with tqdm(total=len(frames), desc="people") as bar, one_torch_thread():
        table = head_count_table(
            sequence, args.radio, frames, everything=not args.hold_out, on_frame=bar.update
        )
    return {**table, **hardware()}


def _people_set(args: BenchArgs, folder: Path) -> dict[str, Any]:
    from tqdm import tqdm

    from rfgs_core.bench import hardware
    from rfgs_core.limbs.weights import load_network, own_network
    from rfgs_core.people_sets.judge import MOST_FRAMES, judge_people
    from rfgs_core.radio import PRESETS
    from rfgs_core.threads import one_torch_thread

    trained = load_network(args.network) if args.network else own_network(PRESETS["mmwave"].freq_hz)
    assert trained is not None
    with tqdm(total=MOST_FRAMES, desc="people") as bar, one_torch_thread():
        table = judge_people(folder, trained.network, bar.update)
    return {**table, **hardware()}


def _live(args: BenchArgs) -> dict[str, Any]:
    from rfgs_core.bench import hardware
    from rfgs_core.errors import RfgsError
    from rfgs_core.live.bench import bench_live

    if not 1.0 <= args.seconds <= 3600.0:
        raise RfgsError(f"--seconds {args.seconds:g}: expected 1 to 3600")
    return {**bench_live(args.seconds, note=_note), **hardware()}


def _fields(args: BenchArgs) -> dict[str, Any]:
    from tqdm import tqdm

    from rfgs_core.bench import hardware
    from rfgs_core.dataset import open_dataset
    from rfgs_core.errors import RfgsError
    from rfgs_core.evaluate.field_search import candidates, search, search_table
    from rfgs_core.frames import chosen_frames
    from rfgs_core.neural.settings import FieldSettings
    from rfgs_core.settings import TrainConfig

    if args.dataset is None:
        raise RfgsError("bench fields: expected --dataset FOLDER, see `rfgs-factory generate`")
    dataset = open_dataset(args.dataset)
    frames = dataset.sequence().frames
    frame = chosen_frames(None if args.frame is None else str(args.frame), frames)[0]
    tried = candidates(args.steps or FieldSettings().steps)
    with tqdm(total=len(tried), desc="fields") as bar:
        rows = search(dataset, args.radio, frame, TrainConfig(grid_side=32), tried, bar.update)
    _note(search_table(rows))
    names = ("kind", "objective", "learning_rate", "octaves", "finest_m", "contrast", "evenness")
    table = {
        " ".join(f"{name} {row[name]}" for name in names): [
            row[key] for key in ("f05", "f10", "f20")
        ]
        for row in rows
    }
    steps = {"steps": tried[0].steps, "radio": args.radio, "frame": frame}
    return {**table, **steps, **hardware()}


def _scaling() -> dict[str, Any]:
    from rfgs_core.scaling import bench_scaling

    return bench_scaling(lambda words: _note(f"timing {words}"))


def _performance(args: BenchArgs) -> int:
    from dataclasses import asdict

    from rfgs_core.device import need_device
    from rfgs_core.evaluate.provenance import now
    from rfgs_core.extras import require
    from rfgs_core.files import refuse_place, write_json, write_text
    from rfgs_core.performance import measure, page

    need_device(args.device)
    if args.device == "cuda":
        require("gsplat")
    for place in filter(None, (args.out, args.json)):
        refuse_place(place)
    found = measure(args.device, lambda words: _note(f"timing {words}"))
    text = page(found, now()[:10])
    if args.out is None:
        sys.stdout.write(text)
    else:
        write_text(args.out, text)
    if args.json is not None:
        write_json(args.json, asdict(found))
    return 0


def _note(line: str) -> None:
    """Tells something that is no result."""
    sys.stderr.write(f"{line}\n")


def run(args: BenchArgs) -> int:
    """Prints one number per line."""
    from rfgs_core.errors import RfgsError
    from rfgs_core.files import write_json

    asked = {"gaussians": args.gaussians, "steps": args.steps, "seeds": args.seeds}
    for name, value in asked.items():
        if value is not None and value < 1:
            raise RfgsError(f"--{name} {value}: expected at least 1")
    if args.part == "tracers":
        from rfgs_core.cli.calls import call

        call("dataset_factory", "tracers", *(["--json", args.json] if args.json else []))
        return 0
    if args.part in ("table1", "table2", "table3"):
        from rfgs_core.cli.tables import make_table

        return make_table(args.part, args.out, args.size, args.seeds, args.json)
    if args.part == "performance":
        return _performance(args)
    if args.part in ("propagation", "raster", "blender"):
        sys.stderr.write(f"timing {args.part}; the plain twin takes most of it, about a minute\n")
    result = _bench(args)()
    width = max(28, *map(len, result))
    for name, value in result.items():
        shown = f"{value:.4g}" if isinstance(value, float) else value
        sys.stdout.write(f"{name:<{width}} {shown}\n")
    if args.json is not None:
        write_json(args.json, result)
    return 0
