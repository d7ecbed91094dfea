# SPDX-License-Identifier: Apache-2.0
"""`rfgs selftest`: whether kernels agree with their twins here, and how fast they are."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

from rfgs_core.device import Device


@dataclass(frozen=True)
class SelftestArgs:
    """Checks every compiled kernel against its plain twin on this machine, and measures its speed.

    Channels and gradients are held against double precision: awkward sizes, and a cloud 10,000
    wavelengths away; pictures (on a GPU with gradients and 32 features) against a rasteriser that
    visits every Gaussian at every pixel. Then
    the propagation model is timed, beside what this chip makes of a product of matrices in the same
    run. Exit code 1 where a kernel is wrong. On a GPU: --device cuda.
    """

    device: Device = "cpu"
    """Where the kernels run."""
    json: Path | None = None
    """Also write all numbers into this file."""


def run(args: SelftestArgs) -> int:
    """Runs all checks; exit code 0 when they hold."""
    from dataclasses import asdict

    from tqdm import tqdm

    from rfgs_core.bench import hardware
    from rfgs_core.device import need_device
    from rfgs_core.extras import require
    from rfgs_core.files import refuse_place, write_json
    from rfgs_core.selftest import PICTURES, SIZES, SPEED, checks, throughput

    need_device(args.device)
    if args.device == "cuda":
        require("gsplat")
    if args.json is not None:
        refuse_place(args.json)
    count = 4 * (len(SIZES) + 1) + len(PICTURES) * (4 if args.device == "cuda" else 1)
    found = list(tqdm(checks(args.device), total=count, desc="selftest", unit="check"))
    for check in found:
        word = "holds" if check.holds else "WRONG"
        sys.stdout.write(
            f"{check.what:42} error {check.error:.1e}, allowed {check.bound:.0e}: {word}\n"
        )
    speed = throughput(args.device)
    gaussians, links, subcarriers = SPEED[args.device]
    machine = hardware()
    where = (
        machine["gpu"] if args.device == "cuda" else f"{machine['cpu']}, {machine['cores']} cores"
    )
    size = f"{gaussians:,} Gaussians x {links} links x {subcarriers} subcarriers"
    sys.stdout.write(
        f"{size}: {1e3 * speed.forward_s:.1f} ms, "
        f"{speed.rate / 1e9:.1f} of {speed.ceiling / 1e9:.1f} billion operations per second "
        f"({speed.rate / speed.ceiling:.0%} of a product of matrices) on {where}\n"
    )
    if args.json is not None:
        rows = [{**asdict(check), "holds": check.holds} for check in found]
        write_json(
            args.json,
            {"device": args.device, "checks": rows, "speed": asdict(speed), **machine},
        )
    wrong = [check for check in found if not check.holds]
    if wrong:
        sys.stderr.write(f"error: {len(wrong)} of {len(found)} checks are wrong\n")
    return 1 if wrong else 0
