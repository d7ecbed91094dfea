# SPDX-License-Identifier: Apache-2.0
"""`rfgs-factory validate`."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import tyro


@dataclass(frozen=True)
class ValidateArgs:
    """Checks every promise a dataset makes; exit code 1 for faults.

    Schema, checksums, counts, numbers, physics and labels; each fault is named with its file.
    """

    dataset: tyro.conf.Positional[Path]
    """Folder of the dataset."""


def run(args: ValidateArgs) -> int:
    """Prints every fault and a verdict."""
    from dataset_factory.check.validate import validate

    faults = validate(args.dataset)
    for fault in faults:
        sys.stdout.write(f"fault: {fault}\n")
    verdict = f"{len(faults)} faults" if faults else "sound"
    sys.stdout.write(f"{args.dataset}: {verdict}\n")
    return int(bool(faults))
