# SPDX-License-Identifier: Apache-2.0
"""The release tree of Widar 3.0: file names taken apart, recordings put together."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from rfgs_core.capture.widar.tables import BAD_FILES, RECEIVERS, USERS, gesture_name, room_of
from rfgs_core.errors import RfgsError, RfgsFormatError

_CSI = re.compile(r"user(\d+)-(\d+)-(\d+)-(\d+)-(\d+)-r([1-6])\.dat")
_DATE = re.compile(r"(?:CSI_)?(20\d{6})")


@dataclass(frozen=True, order=True)
class Take:
    """One repetition of one gesture by one person at one place."""

    date: int
    """Day, YYYYMMDD; it tells the room and what the gesture's number means."""
    user: int
    """Person, 1 to 17."""
    gesture: int
    """Number of the gesture on that day."""
    torso: int
    """Place of the person, 1 to 8."""
    orientation: int
    """Way the person faces, 1 to 5."""
    repetition: int
    """Which time."""

    @property
    def room(self) -> int:
        """Number of the room: 1 classroom, 2 hall, 3 office."""
        return room_of(self.date)

    @property
    def gesture_name(self) -> str:
        """What the gesture is called, alike on all days."""
        return gesture_name(self.date, self.user, self.gesture)


@dataclass(frozen=True)
class Release:
    """What a tree holds."""

    takes: dict[Take, dict[int, Path]]
    """Takes with the file of each receiver, sorted."""
    left_out: list[str] = field(default_factory=list)
    """One sentence per kind of file that was passed over, with its count."""

    def whole(self) -> list[Take]:
        """Takes that all six receivers recorded."""
        return [take for take, files in self.takes.items() if len(files) == len(RECEIVERS)]


def parse_name(path: Path) -> tuple[Take, int]:
    """Take and receiver of a file `…/DATE/…/userU-gesture-torso-orientation-repetition-rR.dat`.

    The second field is the gesture, as the authors' code and tables say; one note of a third
    party calls it the room, which is told by the date.

    Raises:
        RfgsFormatError: The name or the folders above it are none of Widar 3.0's.
    """
    match = _CSI.fullmatch(path.name)
    if match is None:
        raise RfgsFormatError(f"{path}: expected userU-gesture-torso-orientation-repetition-rR.dat")
    user, gesture, torso, orientation, repetition, receiver = map(int, match.groups())
    take = Take(_date(path), user, gesture, torso, orientation, repetition)
    _check(path, take)
    return take, receiver


def scan(root: Path) -> Release:
    """Finds every recording below a folder.

    Args:
        root: Anywhere above the folders of dates.

    Raises:
        RfgsError: There is no such folder.
        RfgsFormatError: Nothing below it is of Widar 3.0.
    """
    if not root.is_dir():
        raise RfgsError(f"{root}: no such folder")
    takes: dict[Take, dict[int, Path]] = {}
    count = {"names that are not of Widar 3.0": 0, "files known to be empty": 0, "empty files": 0}
    for path in sorted(root.rglob("*.dat")):
        try:
            take, receiver = parse_name(path)
        except RfgsFormatError:
            count["names that are not of Widar 3.0"] += 1
            continue
        if f"{take.date}/user{take.user}/{path.name}" in BAD_FILES:
            count["files known to be empty"] += 1
        elif not path.stat().st_size:
            count["empty files"] += 1
        else:
            takes.setdefault(take, {})[receiver] = path
    if not takes:
        raise RfgsFormatError(
            f"{root}: expected DATE/userU/userU-…-rR.dat of Widar 3.0, found none below it"
        )
    left_out = [f"{number} {kind}" for kind, number in count.items() if number]
    return Release({take: takes[take] for take in sorted(takes)}, left_out)


def choose(
    takes: Iterable[Take], *, rooms: Iterable[int] = (), users: Iterable[int] = ()
) -> list[Take]:
    """Takes in some rooms and by some people; all rooms or people where none is named."""
    rooms, users = set(rooms), set(users)
    return [
        take
        for take in takes
        if (not rooms or take.room in rooms) and (not users or take.user in users)
    ]


def _date(path: Path) -> int:
    """Day of a recording by the nearest folder that is named after one."""
    for folder in path.parents:
        match = _DATE.match(folder.name)
        if match is not None:
            return int(match[1])
    raise RfgsFormatError(f"{path}: expected a folder named after the day, YYYYMMDD, above it")


def _check(path: Path, take: Take) -> None:
    """Refuses numbers that Widar 3.0 does not have."""
    fits = take.user in USERS and 1 <= take.torso <= 8 and 1 <= take.orientation <= 5
    if not fits:
        raise RfgsFormatError(
            f"{path}: expected user 1 to 17, torso 1 to 8 and orientation 1 to 5, got {take}"
        )
    _ = take.gesture_name, take.room
