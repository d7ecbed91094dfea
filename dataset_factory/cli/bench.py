# SPDX-License-Identifier: Apache-2.0
"""`rfgs-factory bench`."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import tyro


@dataclass(frozen=True)
class BenchArgs:
    """Times the stages of a frame, two workers beside one, and moving beside reloading.

    Makes eight or more Wi-Fi frames at depth 2 twice, with two single-threaded workers and with
    one, in a temporary folder: some minutes. Run it on a quiet machine; the load is printed too.
    """

    scene: tyro.conf.Positional[str] = "living_room_walk"
    """Name from `rfgs-factory scenes`, or path of a .blend file."""
    frames: str = "10:54:4"
    """Frames A:B[:STEP]; at least eight."""
    json: Path | None = None
    """Also write the numbers to this file, as one flat dictionary."""


def run(args: BenchArgs) -> int:
    """Prints one number per line."""
    import tempfile

    from dataset_factory.make.bench import FactoryBench, bench
    from dataset_factory.scene.catalogue import find_scene
    from dataset_factory.trace.setup import prepare
    from rfgs_core.extras import require
    from rfgs_core.files import write_json

    require("sionna")
    prepare(threads=1)
    config = FactoryBench(find_scene(args.scene), args.frames)
    with tempfile.TemporaryDirectory(prefix="rfgs-bench-") as folder:
        result = bench(config, Path(folder), _say)
    for name, value in result.items():
        sys.stdout.write(f"{name:<24} {value:.4g}\n")
    if args.json is not None:
        write_json(args.json, result)
    return 0


def _say(text: str) -> None:
    sys.stderr.write(f"bench: {text}\n")
