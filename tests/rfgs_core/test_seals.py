# SPDX-License-Identifier: Apache-2.0
"""Files that carry their own digest: every change of one byte is noticed."""

from __future__ import annotations

import hashlib
from pathlib import Path

import pytest

from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.files import write_json
from rfgs_core.seals import BLANK, MARK, check_seal, read_sealed_json, sealed, write_sealed_json

SAID = {"name": "Zoë", "values": [1.5, None, True], "inner": {"a": "b"}}


def test_a_seal_is_the_digest_with_zeros_in_its_place() -> None:
    data = f"one {BLANK} two".encode()
    digest = hashlib.sha256(b"one rfgs-sha256:" + b"0" * 64 + b" two").hexdigest()
    assert sealed(data) == f"one rfgs-sha256:{digest} two".encode()
    check_seal(Path("a"), sealed(data), "do something")


def test_json_comes_back_without_its_seal(tmp_path: Path) -> None:
    for name in "ab":
        write_sealed_json(tmp_path / name, SAID)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
    assert read_sealed_json(tmp_path / "a", "") == SAID


def test_every_changed_byte_is_noticed(tmp_path: Path) -> None:
    file = tmp_path / "a.json"
    write_sealed_json(file, SAID)
    whole = file.read_bytes()
    for place in range(len(whole)):
        for bit in (1, 32):
            damaged = bytearray(whole)
            damaged[place] ^= bit
            file.write_bytes(damaged)
            with pytest.raises(RfgsFormatError, match=r"a\.json: "):
                read_sealed_json(file, "write it again")
    for longer in (whole + b" ", b"\n" + whole):
        file.write_bytes(longer)
        with pytest.raises(RfgsFormatError, match=r"changed or damaged .*; write it again"):
            read_sealed_json(file, "write it again")


def test_what_was_never_sealed_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "a.json"
    with pytest.raises(RfgsError, match=r"a\.json: no such file; write it again"):
        read_sealed_json(file, "write it again")
    write_json(file, SAID)
    with pytest.raises(RfgsFormatError, match=r"expected a seal .*found none.*; write it again"):
        read_sealed_json(file, "write it again")
    write_json(file, {**SAID, "seal": MARK.decode()})
    with pytest.raises(RfgsFormatError, match="changed or damaged"):
        read_sealed_json(file, "write it again")
    write_json(file, [1])
    with pytest.raises(RfgsFormatError, match="expected an object"):
        read_sealed_json(file, "write it again")
