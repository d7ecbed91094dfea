# SPDX-License-Identifier: Apache-2.0
"""What every part of `rfgs bench` has: where its numbers go, and notes that are none."""

from __future__ import annotations

import sys
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rfgs_core.errors import RfgsError


@dataclass(frozen=True, kw_only=True)
class Part(ABC):
    """A part whose numbers are printed, one per line."""

    json: Path | None = None
    """Also write the numbers to this file: one flat dictionary."""

    def run(self) -> int:
        """Prints one number per line; exit code 0."""
        from rfgs_core.files import write_json

        result = self.numbers()
        width = max(28, *map(len, result))
        for name, value in result.items():
            shown = f"{value:.4g}" if isinstance(value, float) else value
            sys.stdout.write(f"{name:<{width}} {shown}\n")
        if self.json is not None:
            write_json(self.json, result)
        return 0

    @abstractmethod
    def numbers(self) -> Mapping[str, Any]:
        """Measures."""


def note(line: str) -> None:
    """Tells something that is no result."""
    sys.stderr.write(f"{line}\n")


def need_at_least_one(**values: int | None) -> None:
    """Refuses options below 1; None is left to the part.

    Raises:
        RfgsError: Naming the first of them.
    """
    for name, value in values.items():
        if value is not None and value < 1:
            raise RfgsError(f"--{name} {value}: expected at least 1")
