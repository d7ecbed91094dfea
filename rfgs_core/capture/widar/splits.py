# SPDX-License-Identifier: Apache-2.0
"""What to train on and what to judge by: at random as papers do it, by person, and by room."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rfgs_core.capture.widar.release import Take
from rfgs_core.errors import RfgsError
from rfgs_core.seeds import sub_seed

#: random: 80/10/10 as the RF-GS paper, whose people and rooms are then in every part.
Kind = Literal["random", "user", "room"]
_SHARES = (0.8, 0.1)


@dataclass(frozen=True)
class Split:
    """Takes of each part; no take is in two."""

    train: list[Take]
    """To learn from."""
    validation: list[Take]
    """To choose by."""
    test: list[Take]
    """To judge by."""

    @property
    def leaks(self) -> dict[str, int]:
        """How many people and rooms of the test part were in the training part."""
        seen = {
            "users": ({take.user for take in self.train}, {take.user for take in self.test}),
            "rooms": ({take.room for take in self.train}, {take.room for take in self.test}),
        }
        return {name: len(train & test) for name, (train, test) in seen.items()}


def split(takes: Iterable[Take], kind: Kind, seed: int = 0) -> Split:
    """Divides takes; equal takes and seeds give equal parts in any order.

    Args:
        takes: What there is.
        kind: random 80/10/10; user, of which the test part has some that training never saw (a
            tenth each for validation and test, at least one); room, the one with fewest takes
            for testing and a tenth of the others for validation.
        seed: Root seed.

    Raises:
        RfgsError: There are too few takes, people or rooms for such a split.
    """
    rows = sorted(set(takes))
    generator = np.random.default_rng(sub_seed(seed, "widar", kind))
    if kind == "random":
        return _random(rows, generator)
    if kind == "user":
        return _by_user(rows, generator)
    return _by_room(rows, generator)


def _random(rows: list[Take], generator: np.random.Generator) -> Split:
    if len(rows) < 10:
        raise RfgsError(f"Widar 3.0: {len(rows)} takes; expected at least 10 for 80/10/10")
    order = generator.permutation(len(rows))
    first, second = (int(share * len(rows)) for share in (_SHARES[0], sum(_SHARES)))
    parts = np.split(order, [first, second])
    return Split(*[sorted(rows[index] for index in part) for part in parts])


def _by_user(rows: list[Take], generator: np.random.Generator) -> Split:
    users = sorted({take.user for take in rows})
    if len(users) < 3:
        raise RfgsError(f"Widar 3.0: {len(users)} people; expected at least 3 to tell them apart")
    order = [users[index] for index in generator.permutation(len(users))]
    held = max(1, round(len(users) / 10))
    test, validation = set(order[:held]), set(order[held : 2 * held])
    return Split(
        _where(rows, lambda take: take.user not in test | validation),
        _where(rows, lambda take: take.user in validation),
        _where(rows, lambda take: take.user in test),
    )


def _by_room(rows: list[Take], generator: np.random.Generator) -> Split:
    rooms = sorted({take.room for take in rows})
    if len(rooms) < 2:
        raise RfgsError(f"Widar 3.0: takes of room {rooms} alone; expected two rooms or more")
    held = min(rooms, key=lambda room: sum(take.room == room for take in rows))
    others = _where(rows, lambda take: take.room != held)
    chosen = set(generator.permutation(len(others))[: max(1, len(others) // 10)].tolist())
    return Split(
        [take for index, take in enumerate(others) if index not in chosen],
        [take for index, take in enumerate(others) if index in chosen],
        _where(rows, lambda take: take.room == held),
    )


def _where(rows: list[Take], fits: Callable[[Take], bool]) -> list[Take]:
    return [take for take in rows if fits(take)]
