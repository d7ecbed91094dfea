# SPDX-License-Identifier: Apache-2.0
"""`rfgs limbs`: trains the network that tells limbs, on random worlds alone."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from rfgs_core.device import Device


@dataclass(frozen=True)
class LimbsArgs:
    """Trains the network that tells where limbs are, from what radios hear of random worlds.

    Rooms, devices, bodies and motions are drawn by chance and their echoes are computed as they
    are needed: no picture, no dataset and none of our scenes takes part. The file serves
    `rfgs train` for radios of the same band. Stopped at any moment, the same command goes on.
    """

    radio: str
    """Preset whose band and antennas the worlds have: mmwave or wifi."""
    out: Path
    """File to write, NAME.safetensors."""
    frames: int = 300_000
    """Frames of random worlds: 60 (mmwave) or 30 (wifi) take a second on one core."""
    hours: float | None = None
    """End after this long, however many frames there were."""
    passes: float = 24.0
    """How often each frame is seen on average; frames are kept in memory and seen again."""
    kept: int = 150_000
    """Frames that are kept in memory, 9 kB each (wifi: 7 kB)."""
    workers: int = 1
    """Processes that make worlds, beside the one that trains."""
    batch: int = 64
    """Frames of a step."""
    size: Literal["small", "large"] = "small"
    """Size of the network: small, or large (5 MB) for millions of frames."""
    device: Device = "cpu"
    """Where worlds are heard and the network is trained: cpu or cuda, which hears thousands a
    second and takes workers, one per core, to draw them."""
    seed: int = 0
    """Seed of worlds and weights; 0 is a seed like any other."""


def run(args: LimbsArgs) -> int:
    """Trains and writes the network; exit code 0."""
    import torch
    from tqdm import tqdm

    from rfgs_core.errors import RfgsError
    from rfgs_core.limbs.learn import LearnConfig, learn
    from rfgs_core.limbs.weights import save_network
    from rfgs_core.radio.presets import preset

    radio = preset(args.radio)
    if radio.antennas_move or radio.ultra_wide:
        raise RfgsError(
            f"--radio {args.radio}: expected one whose devices stand still and whose band one "
            "frequency stands for, such as mmwave or wifi"
        )
    if args.out.suffix != ".safetensors":
        raise RfgsError(f"--out {args.out}: expected a file name that ends in .safetensors")
    for name in ("frames", "kept", "batch"):
        if getattr(args, name) < 1:
            raise RfgsError(f"--{name} {getattr(args, name)}: expected at least 1")
    _check(args)
    config = LearnConfig(
        frames=args.frames, hours=args.hours, passes=args.passes, kept=args.kept,
        workers=args.workers, batch=args.batch, size=args.size, device=args.device, seed=args.seed,
    )  # fmt: skip
    if args.frames < config.least_frames:
        raise RfgsError(
            f"--frames {args.frames}: expected at least {config.least_frames}, which the first "
            "step waits for with this --batch, --kept and --passes"
        )
    torch.set_num_threads(1)
    partial = args.out.with_suffix(".partial")
    with tqdm(total=args.frames, desc=f"limbs {args.radio}", unit="frame") as bar:

        def on_chunk(frames: int, words: str) -> None:
            bar.update(frames - bar.n)
            bar.set_postfix_str(words)

        learned = learn(radio, config, on_chunk, partial)
    card = {
        "data": "random worlds, made as they were needed",
        "frames": learned.progress.frames,
        "seed": args.seed,
        "passes": args.passes,
        "batch": args.batch,
        "device": args.device,
        "hours": round(learned.progress.spent_s / 3600.0, 2),
        "unseen_worlds_m": round(learned.unseen_m, 4),
    }
    save_network(args.out, learned.network, radio, card)
    partial.unlink(missing_ok=True)
    sys.stdout.write(
        f"{args.out}: joints off by {learned.unseen_m:.3f} m in worlds it was not trained "
        f"on, after {learned.progress.frames} frames\n"
    )
    return 0


def _check(args: LimbsArgs) -> None:
    """Refuses numbers that nothing comes of.

    Raises:
        RfgsError: One is out of range, or there is no such device.
    """
    from rfgs_core.device import need_device
    from rfgs_core.errors import RfgsError

    if not (args.hours is None or 0.0 < args.hours < 10_000.0):
        raise RfgsError(f"--hours {args.hours}: expected more than 0")
    if not 0.0 < args.passes <= 10_000.0:
        raise RfgsError(f"--passes {args.passes}: expected more than 0")
    need_device(args.device)
    if not 0 <= args.seed < 2**63:
        raise RfgsError(f"--seed {args.seed}: expected 0 to 2^63 - 1")
    if not 0 <= args.workers <= 256:
        raise RfgsError(f"--workers {args.workers}: expected 0 to 256")
