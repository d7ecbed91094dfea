# SPDX-License-Identifier: Apache-2.0
"""A card of physics: closed forms beside what Blender, the export and the tracer make of them."""

from __future__ import annotations

import importlib
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from dataset_factory.plan.tracers import TracerName
from dataset_factory.verify.card import Card, Group
from dataset_factory.verify.workshop import Workshop
from rfgs_core.errors import RfgsError

#: Modules of this package by their names on the command line, and about how long each takes [s].
GROUPS: dict[str, float] = {
    "friis": 11.0, "box": 16.0, "reciprocity": 9.0, "targets": 12.0, "shadow": 35.0,
    "doppler": 16.0, "delay": 6.0, "energy": 3.0, "pictures": 5.0, "convergence": 17.0,
}  # fmt: skip


def chosen_groups(only: Sequence[str]) -> list[str]:
    """Groups to verify, in the card's order; all of them if none is named.

    Raises:
        RfgsError: There is no such group; the message lists those that exist.
    """
    for name in only:
        if name not in GROUPS:
            raise RfgsError(f"no group {name!r}; expected some of {', '.join(GROUPS)}")
    return [name for name in GROUPS if not only or name in only]


def verify(
    only: Sequence[str],
    work: Path,
    done: Callable[[str, float], None] = lambda name, s: None,
    tracer: TracerName = "sionna",
) -> Card:
    """Builds the scenes, traces them and compares.

    Args:
        only: Names of groups; none takes all.
        work: A folder in which scenes are built; what is made there is removed.
        done: Called before each group with its name and the usual seconds of the one before.
        tracer: Which tracer to verify.

    Raises:
        RfgsError: There is no such group, or a scene could not be built or traced.
    """
    card, before_s = Card(), 0.0
    names = chosen_groups(only)
    with tempfile.TemporaryDirectory(prefix=".tmp-", dir=work) as folder:
        for name in names:
            done(name, before_s)
            start = time.perf_counter()
            module = importlib.import_module(f"{__name__}.{name}")
            group: Group = module.verify(Workshop(Path(folder), tracer))
            card.groups.append(replace(group, seconds=time.perf_counter() - start))
            before_s = GROUPS[name]
        done("", before_s)
    return card
