# SPDX-License-Identifier: Apache-2.0
"""`rfgs-factory impair`."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import tyro


@dataclass(frozen=True)
class ImpairArgs:
    """Adds what imperfect radios would report, beside the clean channels.

    Thermal noise, carrier, clock and timing offsets, phase noise, antenna order, gain control,
    converter steps and lost packets; all seeded, all stored with what was drawn.
    """

    dataset: tyro.conf.Positional[Path]
    """Folder of the dataset."""
    impairments: str
    """thermal, lab or commodity, or a JSON file such as {"thermal_noise": true, "cfo_std_hz": 50};
    an unknown setting lists all that exist."""
    radio: tyro.conf.UseAppendAction[tuple[str, ...]] = ()
    """Which radio; repeat the option for several; default: all."""
    seed: int | None = None
    """Root seed; default: the dataset's own."""
    replace: bool = False
    """Replace impaired channels that are there already."""


def run(args: ImpairArgs) -> int:
    """Adds the impaired channels and seals the dataset anew."""
    from dataset_factory.make.impair import impair_dataset
    from rfgs_core.radio.impairments import read_impairments

    settings = read_impairments(args.impairments)
    impair_dataset(
        args.dataset, settings, radios=args.radio, seed=args.seed, replacing=args.replace
    )
    sys.stdout.write(f"{args.dataset}: impaired channels added\n")
    return 0
