# SPDX-License-Identifier: Apache-2.0
"""Array files: what was written comes back, and nothing else is believed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rfgs_core.arrays import load_arrays, save_arrays
from rfgs_core.errors import RfgsError, RfgsFormatError

SHAPES = {"means": ("M", 3), "power": ("M",), "scale": (), "names": None}


@pytest.fixture
def arrays() -> dict[str, np.ndarray]:
    """Two rows that fit `SHAPES`."""
    return {
        "means": np.arange(6.0).reshape(2, 3),
        "power": np.array([1, 2]),
        "scale": np.array(0.5),
        "names": np.array(["a", "b"]),
    }


def test_round_trip_and_equal_bytes(arrays, tmp_path: Path) -> None:
    save_arrays(tmp_path / "a.npz", arrays)
    save_arrays(tmp_path / "b.npz", arrays)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    loaded = load_arrays(tmp_path / "a.npz", "remedy", SHAPES)
    for name, value in arrays.items():
        np.testing.assert_array_equal(loaded[name], value)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"means": None}, "missing means"),
        ({"means": np.zeros((2, 4))}, r"means has shape \(2, 4\), expected \(2, 3\)"),
        ({"means": np.zeros(6)}, r"means has shape \(6,\)"),
        ({"power": np.zeros(3)}, r"power has shape \(3,\), expected \(2,\)"),
        ({"scale": np.array(np.nan)}, "scale holds something else than finite numbers"),
        ({"power": np.array(["1", "2"])}, "power holds something else than finite numbers"),
        ({"names": np.array([{"pickled": 1}], dtype=object)}, "damaged"),
    ],
)
def test_what_does_not_fit_is_refused(arrays, tmp_path: Path, change: dict, message: str) -> None:
    changed = {name: value for name, value in (arrays | change).items() if value is not None}
    save_arrays(tmp_path / "a.npz", changed)
    with pytest.raises(RfgsFormatError, match=rf"a\.npz: .*{message}.*; make it again"):
        load_arrays(tmp_path / "a.npz", "make it again", SHAPES)


def test_a_missing_file_and_a_single_array_are_refused(tmp_path: Path) -> None:
    with pytest.raises(RfgsError, match="no such file; make it again"):
        load_arrays(tmp_path / "a.npz", "make it again")
    with (tmp_path / "a.npz").open("wb") as stream:
        np.save(stream, np.zeros(3))
    with pytest.raises(RfgsFormatError, match="expected named arrays, found a single one"):
        load_arrays(tmp_path / "a.npz", "make it again")


def _refused(file: Path, *, seal: bool) -> float:
    """Share of damaged bytes with which a file is refused."""
    whole, refused = file.read_bytes(), 0
    places = range(0, len(whole), 3)
    for position in places:
        damaged = bytearray(whole)
        damaged[position] ^= 0xFF
        file.write_bytes(damaged)
        try:
            load_arrays(file, "make it again", {"means": ("M", 3)}, seal=seal)
        except RfgsFormatError:
            refused += 1
    return refused / len(places)


def test_no_damaged_byte_of_a_compressed_file_escapes(tmp_path: Path) -> None:
    arrays = {"means": np.random.default_rng(0).random((20, 3))}
    save_arrays(tmp_path / "sealed.npz", arrays, packed=True)
    np.savez_compressed(tmp_path / "plain.npz", **arrays)
    with pytest.raises(RfgsFormatError, match=r"expected a seal .*found none.*; make it again"):
        load_arrays(tmp_path / "plain.npz", "make it again")
    assert _refused(tmp_path / "sealed.npz", seal=True) == 1.0
    assert 0.5 < _refused(tmp_path / "plain.npz", seal=False) < 1.0
