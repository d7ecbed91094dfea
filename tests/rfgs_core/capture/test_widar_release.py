# SPDX-License-Identifier: Apache-2.0
"""Widar 3.0 on a miniature of its release tree."""

from __future__ import annotations

from pathlib import Path

import capture_files as files
import numpy as np
import pytest

from rfgs_core.capture import widar
from rfgs_core.capture.prepare import prepare
from rfgs_core.capture.to_dataset import write_dataset
from rfgs_core.capture.widar.release import Take
from rfgs_core.capture.widar.tables import GESTURES, ROOM_OF_DATE, gesture_name, room_of
from rfgs_core.dataset import open_dataset
from rfgs_core.errors import RfgsError, RfgsFormatError

DATES = {20181109: (1, 2, 3), 20181117: (1, 2), 20181211: (3, 7, 8)}


def write_packets(path: Path, packets: int, skipped: tuple[int, ...] = (), seed: int = 0) -> None:
    """A file of packets 1 ms apart, some of which were lost on air."""
    path.parent.mkdir(parents=True, exist_ok=True)
    value = files.integers((packets, 3, 1, 30), 100, seed)
    records = [
        files.intel5300_record(value[time], 0b100100, 1000 * time)
        for time in range(packets)
        if time not in skipped
    ]
    path.write_bytes(b"".join(records))


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three dates, six receivers, two gestures; an empty, a known-bad and a foreign file."""
    root = tmp_path_factory.mktemp("widar")
    for date, users in DATES.items():
        for user in users:
            folder = root / f"CSI_{date}" if date == 20181117 else root / str(date)
            for gesture in (1, 4):
                for receiver in range(1, 7):
                    name = f"user{user}-{gesture}-2-3-1-r{receiver}.dat"
                    write_packets(folder / f"user{user}" / name, 4)
    user8 = root / "20181211" / "user8"
    (user8 / "user8-1-1-1-1-r5.dat").write_bytes(b"junk")
    (user8 / "user8-1-2-3-9-r1.dat").write_bytes(b"")
    (user8 / "notes.dat").write_bytes(b"?")
    return root


def test_the_tree_is_put_together(tree: Path) -> None:
    release = widar.scan(tree)
    assert len(release.takes) == 2 * sum(map(len, DATES.values())) == len(release.whole())
    assert sorted(release.left_out) == [
        *("1 empty files", "1 files known to be empty", "1 names that are not of Widar 3.0")
    ]
    take = Take(20181109, 1, 4, 2, 3, 1)
    assert sorted(release.takes[take]) == [1, 2, 3, 4, 5, 6]
    assert (take.room, take.gesture_name) == (1, "Slide")
    assert Take(20181117, 1, 4, 2, 3, 1).gesture_name == "Draw-O(Vertical)"
    chosen = widar.choose(release.takes, rooms=[2, 3], users=[1, 8])
    assert {(take.room, take.user) for take in chosen} == {(2, 1), (3, 8)}


@pytest.mark.parametrize(
    ("date", "user", "number", "name"),
    [
        (20181112, 2, 10, "Draw-0"),
        (20181116, 4, 0, "Draw-0"),
        (20181112, 2, 3, "Draw-3"),
        (20181121, 1, 2, "Draw-O(Horizontal)"),
        (20181128, 2, 4, "Draw-O(Horizontal)"),
        (20181130, 12, 9, "Draw-Rectangle(Horizontal)"),
        (20181205, 2, 1, "Draw-O(Horizontal)"),
        (20181205, 3, 1, "Slide"),
        (20181209, 6, 5, "Draw-O(Horizontal)"),
    ],
)
def test_numbers_of_gestures_mean_what_the_date_says(
    date: int, user: int, number: int, name: str
) -> None:
    assert gesture_name(date, user, number) == name


@pytest.mark.parametrize(
    ("date", "user", "number"),
    [(20181208, 3, 4), (20181209, 2, 2), (20181205, 1, 1), (20181109, 1, 7), (20190101, 1, 1)],
)
def test_unknown_gestures_are_refused(date: int, user: int, number: int) -> None:
    with pytest.raises(RfgsFormatError, match="no gesture"):
        gesture_name(date, user, number)


def test_there_are_22_gestures_15_days_and_3_rooms() -> None:
    assert len(GESTURES) == 22 and len(ROOM_OF_DATE) == 15
    assert set(ROOM_OF_DATE.values()) == {1, 2, 3}
    with pytest.raises(RfgsFormatError, match="nothing was recorded on 20181231"):
        room_of(20181231)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("20181109/userA-1-2-3-r1.dat", "expected userU-gesture"),
        ("20181109/user18-1-2-3-1-r1.dat", "user 1 to 17"),
        ("20181109/user1-1-9-3-1-r1.dat", "torso 1 to 8"),
        ("here/user1-1-2-3-1-r1.dat", "named after the day"),
        ("20181109/user1-7-2-3-1-r1.dat", "no gesture 7"),
    ],
)
def test_names_are_checked(name: str, message: str) -> None:
    with pytest.raises(RfgsFormatError, match=message):
        widar.parse_name(Path("/data") / name)


def test_six_receivers_are_aligned(tmp_path: Path) -> None:
    paths = {}
    for receiver in range(1, 7):
        paths[receiver] = tmp_path / f"r{receiver}.dat"
        skipped = tuple(range(40, 70)) if receiver == 4 else (5, 6)
        write_packets(paths[receiver], 100 + 5 * receiver, skipped, seed=receiver)
    recording = widar.read_take(paths)
    # All share the time of the shortest; a gap of 30 ms is known, one of 3 ms bridged.
    assert recording.values.shape == (105, 6, 3, 30)
    np.testing.assert_allclose(recording.time_s, 1e-3 * np.arange(105), atol=1e-9)
    value = files.integers((105, 3, 1, 30), 100, 1)
    np.testing.assert_array_equal(
        recording.values[:, 0][[0, 4, 5, 7, 104]], value[[0, 4, 4, 7, 104], :, 0]
    )
    assert recording.trusted[:, 0].all() and not recording.trusted[45:65, 3].any()
    assert recording.receivers == (1, 2, 3, 4, 5, 6)


def test_a_take_becomes_a_dataset(tmp_path: Path) -> None:
    paths = []
    for receiver in range(1, 7):
        paths.append(tmp_path / f"r{receiver}.dat")
        write_packets(paths[-1], 210, seed=receiver)
    prepared, warnings = prepare(paths, widar.layout_of())
    write_dataset(tmp_path / "out", prepared, {"files": [path.name for path in paths]})
    sequence = open_dataset(tmp_path / "out").sequence()
    layout = sequence.layout("widar")
    assert not warnings and layout.rx_xyz.shape == (18, 3) and layout.tx_xyz.shape == (1, 3)
    assert sequence.csi_samples("widar", 1).shape == (100, 1, 18, 57)
    np.testing.assert_allclose(sequence.devices("widar")[2].position_m, (1.365, -0.455, 1.0))
    guessed = {row["what"] for row in sequence.info.guesses}
    assert {"height", "direction of the arrays"} <= guessed


def test_velocity_profiles_read(tmp_path: Path) -> None:
    from scipy.io import savemat

    folder = tmp_path / "20181109-VS" / "6-link" / "user1"
    folder.mkdir(parents=True)
    path = folder / "user1-1-2-3-4-1-1e-07-100-20-100000-L0.mat"
    profile = np.random.default_rng(0).uniform(size=(20, 20, 7))
    savemat(path, {"velocity_spectrum_ro": profile})
    np.testing.assert_array_equal(widar.read_bvp(path), profile)
    savemat(path, {"velocity_spectrum_ro": profile[:, :10]})
    with pytest.raises(RfgsFormatError, match="20 × 20"):
        widar.read_bvp(path)


def takes() -> list[Take]:
    """Takes of ten people in two rooms."""
    days = {20181109: range(1, 8), 20181117: range(4, 11)}
    return [
        Take(date, user, gesture, 1, 1, repetition)
        for date, users in days.items()
        for user in users
        for gesture in (1, 2, 3)
        for repetition in range(1, 4)
    ]


def test_the_random_split_is_80_10_10_and_leaks_people() -> None:
    rows = takes()
    parts = widar.split(rows, "random")
    sizes = [len(parts.train), len(parts.validation), len(parts.test)]
    assert sum(sizes) == len(rows) and sizes[0] == int(0.8 * len(rows))
    assert not set(parts.train) & set(parts.test) and not set(parts.validation) & set(parts.test)
    assert parts.leaks["users"] > 0 and parts.leaks["rooms"] == 2
    assert widar.split(reversed(rows), "random") == parts
    assert widar.split(rows, "random", seed=1) != parts


def test_the_splits_by_person_and_room_do_not() -> None:
    rows = takes()
    by_user = widar.split(rows, "user")
    assert by_user.leaks["users"] == 0 and by_user.test and by_user.validation
    assert not {t.user for t in by_user.validation} & {t.user for t in by_user.train}
    by_room = widar.split([t for t in rows if t.room == 1 or t.user < 9], "room")
    assert by_room.leaks["rooms"] == 0 and {t.room for t in by_room.test} == {2}
    with pytest.raises(RfgsError, match="room \\[1\\] alone"):
        widar.split([t for t in rows if t.room == 1], "room")
    with pytest.raises(RfgsError, match="expected at least 3"):
        widar.split([t for t in rows if t.user < 3], "user")
    with pytest.raises(RfgsError, match="at least 10"):
        widar.split(rows[:9], "random")


def test_folders_without_recordings_are_refused(tmp_path: Path) -> None:
    with pytest.raises(RfgsError, match="no such folder"):
        widar.scan(tmp_path / "no")
    with pytest.raises(RfgsFormatError, match="found none below"):
        widar.scan(tmp_path)
