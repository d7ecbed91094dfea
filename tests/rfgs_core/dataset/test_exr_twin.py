# SPDX-License-Identifier: Apache-2.0
"""Our reader of EXR beside the library, and beside files that crash the library."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rfgs_core.dataset.exr import decode_exr
from rfgs_core.dataset.pictures import read_exr, read_planes, write_exr
from rfgs_core.errors import RfgsFormatError


@pytest.mark.parametrize("kind", [np.float16, np.float32])
@pytest.mark.parametrize("shape", [(1, 1), (16, 7), (17, 5), (33, 64), (240, 320)])
def test_both_readers_give_the_same_values(kind: type, shape: tuple, tmp_path: Path) -> None:
    state, file = np.random.default_rng(0), tmp_path / "a.exr"
    for plane in (
        state.normal(size=shape),
        np.zeros(shape),
        np.where(state.random(shape) < 0.5, np.inf, 3.0),
    ):
        write_exr(file, {name: (plane + i).astype(kind) for i, name in enumerate("XYZ")})
        theirs = read_exr(file)
        for name, ours in zip("XYZ", read_planes(file, "XYZ"), strict=True):
            assert ours.dtype == np.float32
            np.testing.assert_array_equal(ours, theirs[name])


def test_every_damaged_byte_is_refused_or_read(tmp_path: Path) -> None:
    file = tmp_path / "a.exr"
    write_exr(file, {"Z": np.arange(20 * 90, dtype=np.float32).reshape(20, 90)})
    whole, refused = file.read_bytes(), 0
    for position in range(len(whole)):
        damaged = bytearray(whole)
        damaged[position] ^= 0xFF
        file.write_bytes(damaged)
        try:
            read_planes(file, "Z")
        except RfgsFormatError as error:
            refused += 1
            assert str(file) in str(error)
    for end in range(0, len(whole), 7):
        file.write_bytes(whole[:end])
        with pytest.raises(RfgsFormatError, match="damaged or truncated EXR"):
            read_planes(file, "Z")
    assert refused > 0.5 * len(whole)


def test_other_kinds_of_exr_are_named(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="expected one part of scan lines"):
        decode_exr(b"P6", 10)
    write_exr(tmp_path / "a.exr", {"Z": np.ones((2, 2), np.float32)})
    with pytest.raises(RfgsFormatError, match="expected channel 'X', got Z"):
        read_planes(tmp_path / "a.exr", "X")
    with pytest.raises(ValueError, match="too large"):
        decode_exr((tmp_path / "a.exr").read_bytes(), 3)
