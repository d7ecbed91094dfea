# SPDX-License-Identifier: Apache-2.0
"""Truncated, empty, garbage, wrong-kind and mutated files: counted warnings or one clear line."""

from __future__ import annotations

import os
import resource
import time
import warnings
from pathlib import Path

import capture_files as files
import numpy as np
import pytest

from rfgs_core.capture import Reading, read_capture
from rfgs_core.capture.model import MOST_MEMORY_BYTES
from rfgs_core.errors import RfgsError

#: Formats that a process of its own reads, with limits; each file takes a fifth of a second.
APART = ("acconeer", "matlab")
#: Mutated files per format, in quick tests and in all.
FEW, ALL = 150, 2000


def read_or_refuse(path: Path, name: str | None) -> Reading | str:
    """What a reader gives, or its one line."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            reading = read_capture(path, name)
    except RfgsError as error:
        line = str(error)
        assert "\n" not in line and str(path.parent) in line, line
        return line
    for capture in reading.captures:
        assert np.isfinite(capture.values).all() and np.isfinite(capture.time_s).all()
        assert (np.diff(capture.time_s) >= 0).all() and (np.diff(capture.bins) >= 0).all()
    return reading


def mutated(data: bytes, generator: np.random.Generator) -> bytes:
    """A file with bits flipped, bytes set, a piece cut out, doubled or replaced."""
    changed = bytearray(data)
    for _ in range(generator.integers(1, 6)):
        at = int(generator.integers(0, len(changed)))
        count = int(generator.integers(1, 40))
        kind = generator.integers(0, 5)
        if kind == 0:
            changed[at] ^= 1 << int(generator.integers(0, 8))
        elif kind == 1:
            changed[at : at + 4] = generator.choice([b"\xff" * 4, b"\0" * 4, b"\x7f" * 4])
        elif kind == 2 and len(changed) > count + 1:
            del changed[at : at + count]
        elif kind == 3:
            changed[at:at] = changed[at : at + count]
        else:
            changed[at : at + count] = generator.bytes(count)
        if not changed:
            changed = bytearray(b"\0")
    return bytes(changed)


def mutate_all(name: str, folder: Path, count: int) -> None:
    """Reads mutated files of one format; every second one with the format named."""
    file, write = files.WRITERS[name]
    write(folder / file)
    data = (folder / file).read_bytes()
    generator = np.random.default_rng(11)
    started, read = time.monotonic(), 0
    for number in range(count):
        (folder / file).write_bytes(mutated(data, generator))
        answer = read_or_refuse(folder / file, name if number % 2 else None)
        read += isinstance(answer, Reading)
    assert time.monotonic() - started < count * (3.0 if name in APART else 0.2)
    # Most damage spares most records; the whole file is one where a library reads it.
    assert read > count / 4 or name in APART, f"{read} of {count} gave records"


@pytest.mark.parametrize("name", [name for name in files.WRITERS if name not in APART])
def test_mutated_files(name: str, tmp_path: Path) -> None:
    mutate_all(name, tmp_path, FEW)


@pytest.mark.parametrize("name", APART)
def test_mutated_files_of_libraries(name: str, tmp_path: Path) -> None:
    mutate_all(name, tmp_path, 12)


@pytest.mark.slow
@pytest.mark.parametrize("name", files.WRITERS)
def test_two_thousand_mutated_files(name: str, tmp_path: Path) -> None:
    mutate_all(name, tmp_path, ALL)
    peak_bytes = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert peak_bytes < MOST_MEMORY_BYTES


@pytest.mark.parametrize("name", files.WRITERS)
def test_truncated_files_give_what_is_whole(name: str, tmp_path: Path) -> None:
    file, write = files.WRITERS[name]
    write(tmp_path / file)
    data = (tmp_path / file).read_bytes()
    whole = read_capture(tmp_path / file)
    steps = 4 if name in APART else 40
    counts = []
    for length in np.linspace(0, len(data) - 1, steps).astype(int):
        (tmp_path / file).write_bytes(data[:length])
        answer = read_or_refuse(tmp_path / file, None)
        if isinstance(answer, Reading):
            counts.append(sum(map(len, answer.captures)))
            for capture in answer.captures:
                first = next(
                    c for c in whole.captures if c.index.tolist() == capture.index.tolist()
                )
                before = first.values[: len(capture), :, : capture.values.shape[2]]
                np.testing.assert_array_equal(capture.values[capture.valid], before[capture.valid])
    if name not in APART:
        assert counts and counts == sorted(counts)


@pytest.mark.parametrize("name", files.WRITERS)
@pytest.mark.parametrize("content", [b"", b"\0" * 5000, bytes(range(256)) * 20, b"\xff" * 5000])
def test_empty_and_garbage_files_are_refused(name: str, content: bytes, tmp_path: Path) -> None:
    file, write = files.WRITERS[name]
    write(tmp_path / file)
    (tmp_path / file).write_bytes(content)
    if name == "ti_adc" and content:
        return  # Any numbers are samples.
    assert isinstance(read_or_refuse(tmp_path / file, name), str)


@pytest.mark.parametrize("name", files.WRITERS)
def test_files_of_another_kind_are_refused(name: str, tmp_path: Path) -> None:
    pytest.importorskip("h5py")
    for other, (file, write) in files.WRITERS.items():
        if other == name or "ti_adc" in (name, other):
            continue
        write(tmp_path / file)
        assert isinstance(read_or_refuse(tmp_path / file, name), str), other


def test_a_folder_is_no_file(tmp_path: Path) -> None:
    for name in files.WRITERS:
        assert isinstance(read_or_refuse(tmp_path, name), str)
    assert isinstance(read_or_refuse(tmp_path, None), str)


def test_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.dat")
    for name in (None, *files.WRITERS):
        assert isinstance(read_or_refuse(tmp_path / "pipe.dat", name), str)


def test_damage_between_records_is_counted(tmp_path: Path) -> None:
    chains = files.integers((3, 1, 30), 100)
    record = files.intel5300_record(chains, 0b100100, 5)
    (tmp_path / "a.dat").write_bytes(record + b"spoilt!" + record + record[:-3])
    reading = read_capture(tmp_path / "a.dat")
    assert len(reading.largest) == 2
    assert reading.warnings == ["7 bytes that belong to no record", "1 record cut off at the end"]


def test_sizes_are_bounded_before_anything_is_decoded(tmp_path: Path, monkeypatch) -> None:
    from rfgs_core.capture import file_bytes, intel5300

    chains = files.integers((3, 1, 30), 100)
    (tmp_path / "a.dat").write_bytes(4 * files.intel5300_record(chains, 0b100100, 5))
    monkeypatch.setattr(file_bytes, "MOST_VALUES", 100)
    assert "at most 100 are read" in str(read_or_refuse(tmp_path / "a.dat", None))
    monkeypatch.setattr(file_bytes, "LARGEST_FILE_BYTES", 100)
    assert "cut the capture into pieces" in str(read_or_refuse(tmp_path / "a.dat", None))
    assert intel5300.NAME == "intel5300"


def test_a_library_that_crashes_ends_its_own_process(tmp_path: Path, monkeypatch) -> None:
    from rfgs_core.capture import table_file

    files.newrf_file(tmp_path / "a.mat")
    monkeypatch.setattr(table_file, "MEMORY_BYTES", 1)
    assert "expected a whole MATLAB file" in str(read_or_refuse(tmp_path / "a.mat", None))
