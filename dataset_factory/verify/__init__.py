# SPDX-License-Identifier: Apache-2.0
"""A card of physics: closed forms beside what Blender, the export and the tracer make of them."""

from __future__ import annotations

import importlib
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from dataset_factory.verify.card import Card, Group
from dataset_factory.verify.workshop import Workshop
from rfgs_core.errors import RfgsError

#: Name on the command line → module of this package and about how long it takes [s].
GROUPS: dict[str, tuple[str, float]] = {
    "friis": ("friis", 15.0),
    "box": ("box", 20.0),
    "reciprocity": ("reciprocity", 30.0),
    "targets": ("targets", 15.0),
    "shadow": ("shadow", 45.0),
    "doppler": ("doppler", 20.0),
    "delay": ("delay", 12.0),
    "energy": ("energy", 5.0),
    "pictures": ("pictures", 20.0),
    "convergence": ("convergence", 60.0),
}


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
    only: Sequence[str], work: Path, done: Callable[[str, float], None] = lambda name, s: None
) -> Card:
    """Builds the scenes, traces them and compares.

    Args:
        only: Names of groups; none takes all.
        work: A folder in which scenes are built; what is made there is removed.
        done: Called before each group with its name and the usual seconds of the one before.

    Raises:
        RfgsError: There is no such group, or a scene could not be built or traced.
    """
    card, before_s = Card(), 0.0
    names = chosen_groups(only)
    with tempfile.TemporaryDirectory(prefix=".tmp-", dir=work) as folder:
        for name in names:
            module, usual_s = GROUPS[name]
            done(name, before_s)
            start = time.perf_counter()
            group: Group = importlib.import_module(f"{__name__}.{module}").verify(
                Workshop(Path(folder))
            )
            card.groups.append(replace(group, seconds=time.perf_counter() - start))
            before_s = usual_s
        done("", before_s)
    return card
