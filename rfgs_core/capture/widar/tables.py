# SPDX-License-Identifier: Apache-2.0
"""What the authors of Widar 3.0 tell beside the files: rooms, places, gestures, bad files.

Sources: the README of the data set (Zheng et al. 2019; dates, rooms, gestures) and
`DVM_main.m` of the authors' code (places). The tables were held against several independent
transcriptions, which agree.
"""

from __future__ import annotations

from rfgs_core.errors import RfgsFormatError

#: Channel 165 [Hz] and packets per second.
CENTRE_HZ = 5.825e9
RATE_HZ = 1000.0
RECEIVERS = (1, 2, 3, 4, 5, 6)
#: People in the data set, by number.
USERS = tuple(range(1, 18))

#: Room of each day: 1 a classroom, 2 a hall, 3 an office.
ROOM_OF_DATE = {
    **dict.fromkeys((20181109, 20181112, 20181115, 20181116, 20181121, 20181130), 1),
    **dict.fromkeys((20181117, 20181118, 20181127, 20181128), 2),
    **dict.fromkeys((20181204, 20181205, 20181208, 20181209), 2),
    20181211: 3,
}

#: Places on the floor [m]; heights are not told.
TRANSMITTER_M = (0.0, 0.0)
RECEIVERS_M = {
    **{1: (0.455, -0.455), 2: (1.365, -0.455), 3: (2.0, 0.0)},
    **{4: (-0.455, 0.455), 5: (-0.455, 1.365), 6: (0.0, 2.0)},
}
_LINES = ("Push&Pull", "Sweep", "Clap")
_VERTICAL = ("Draw-O(Vertical)", "Draw-Zigzag(Vertical)", "Draw-N(Vertical)")
_HORIZONTAL = ("Draw-O(Horizontal)", "Draw-Zigzag(Horizontal)", "Draw-N(Horizontal)")
_SHAPES = (*_HORIZONTAL, "Draw-Triangle(Horizontal)", "Draw-Rectangle(Horizontal)")
_DIGITS = tuple(f"Draw-{digit % 10}" for digit in range(1, 11))
_SIX = (*_LINES, "Slide", *_HORIZONTAL[:2])

#: Names of gestures 1, 2, … by date; where users differ, by (date, user).
_GESTURES: dict[int | tuple[int, int], tuple[str, ...]] = {
    20181109: (*_LINES, "Slide", *_VERTICAL[1:]),
    **dict.fromkeys((20181112, 20181116), _DIGITS),
    **dict.fromkeys((20181115, 20181117, 20181118), (*_LINES, *_VERTICAL)),
    **dict.fromkeys((20181121, 20181127), ("Slide", *_SHAPES)),
    20181128: (*_LINES, *_HORIZONTAL),
    **dict.fromkeys((20181130, 20181204), (*_LINES, "Slide", *_SHAPES)),
    (20181205, 2): _SHAPES,
    (20181205, 3): ("Slide", *_SHAPES),
    (20181208, 2): (*_LINES, "Slide"),
    (20181208, 3): _LINES,
    (20181209, 2): _LINES[:1],
    (20181209, 6): _SIX,
    20181211: _SIX,
}

#: The 22 gestures that there are under all numbers.
GESTURES = tuple(sorted({name for names in _GESTURES.values() for name in names}))

#: Files of the release without any content, `date/user/name`.
BAD_FILES = frozenset(
    {
        "20181109/user2/user2-6-4-4-2-r1.dat",
        "20181109/user3/user3-1-3-1-8-r5.dat",
        "20181118/user2/user2-3-5-3-4-r4.dat",
        "20181209/user6/user6-3-1-1-5-r5.dat",
        "20181211/user8/user8-1-1-1-1-r5.dat",
        "20181211/user8/user8-3-3-3-5-r2.dat",
        "20181211/user9/user9-1-1-1-1-r1.dat",
    }
)


def gesture_name(date: int, user: int, number: int) -> str:
    """Name of a gesture: its number means different things on different dates.

    Args:
        date: Day of the recording, YYYYMMDD.
        user: Number of the person.
        number: Second field of a file's name; 0 and 10 are both the digit 0.

    Raises:
        RfgsFormatError: The table knows no such date, user or number.

    Example:
        >>> gesture_name(20181109, 1, 4), gesture_name(20181115, 1, 4)
        ('Slide', 'Draw-O(Vertical)')
    """
    names = _GESTURES.get((date, user), _GESTURES.get(date))
    if names == _DIGITS and number == 0:
        number = 10
    if names is None or not 1 <= number <= len(names):
        raise RfgsFormatError(
            f"Widar 3.0, {date}, user {user}: no gesture {number}; known are 1 to "
            f"{len(names) if names else 0}"
        )
    return names[number - 1]


def room_of(date: int) -> int:
    """Number of the room that was used on a day.

    Raises:
        RfgsFormatError: Nothing was recorded on that day.
    """
    if date not in ROOM_OF_DATE:
        days = ", ".join(map(str, sorted(ROOM_OF_DATE)))
        raise RfgsFormatError(f"Widar 3.0: nothing was recorded on {date}; days are {days}")
    return ROOM_OF_DATE[date]
