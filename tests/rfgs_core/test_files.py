# SPDX-License-Identifier: Apache-2.0
"""Files are whole or absent, and names stay inside their folder."""

from __future__ import annotations

from pathlib import Path

import pytest

from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.files import (
    inside,
    read_json,
    replacing,
    sha256,
    write_bytes,
    write_json,
    write_text,
)


def test_a_replaced_file_appears_whole_with_its_folders(tmp_path: Path) -> None:
    target = tmp_path / "deep" / "er" / "data.npz"
    with replacing(target) as temporary:
        assert temporary.parent == target.parent
        assert temporary.suffix == ".npz"
        temporary.write_bytes(b"new")
        assert not target.exists()
    assert target.read_bytes() == b"new"
    assert [path.name for path in target.parent.iterdir()] == ["data.npz"]


def test_a_failed_write_keeps_the_old_file_and_leaves_no_rest(tmp_path: Path) -> None:
    target = tmp_path / "data.bin"
    write_bytes(target, b"old")
    with pytest.raises(KeyboardInterrupt), replacing(target) as temporary:
        temporary.write_bytes(b"half")
        raise KeyboardInterrupt
    assert target.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [target]


def test_equal_values_give_equal_bytes(tmp_path: Path) -> None:
    write_json(tmp_path / "a.json", {"b": [1, 2.5], "a": "ä"})
    write_json(tmp_path / "b.json", {"a": "ä", "b": [1, 2.5]})
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()
    assert read_json(tmp_path / "a.json") == {"a": "ä", "b": [1, 2.5]}


def test_not_a_number_is_no_json_and_keeps_the_old_file(tmp_path: Path) -> None:
    target = tmp_path / "a.json"
    write_json(target, 1)
    with pytest.raises(ValueError, match="JSON compliant"):
        write_json(target, {"x": float("nan")})
    assert read_json(target) == 1


def test_missing_and_damaged_json_are_told_apart(tmp_path: Path) -> None:
    with pytest.raises(RfgsError, match=r"gone\.json: no such file"):
        read_json(tmp_path / "gone.json")
    write_text(tmp_path / "cut.json", '{"a": ')
    with pytest.raises(RfgsFormatError, match=r"cut\.json: expected JSON"):
        read_json(tmp_path / "cut.json")
    write_bytes(tmp_path / "binary.json", b"\xff\xfe\x00")
    with pytest.raises(RfgsFormatError, match=r"binary\.json: expected JSON"):
        read_json(tmp_path / "binary.json")


def test_digest_is_that_of_the_standard(tmp_path: Path) -> None:
    write_bytes(tmp_path / "abc", b"abc")
    # FIPS 180-2, appendix B.1.
    expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
    assert sha256(tmp_path / "abc") == expected


@pytest.mark.parametrize("name", ["../other", "/etc/passwd", "a/../../b", "link/x"])
def test_names_that_leave_the_folder_are_refused(tmp_path: Path, name: str) -> None:
    root = tmp_path / "root"
    root.mkdir()
    (root / "link").symlink_to(tmp_path)
    with pytest.raises(RfgsFormatError, match="leads outside"):
        inside(root, name)


def test_names_inside_the_folder_are_joined(tmp_path: Path) -> None:
    assert inside(tmp_path, "a/../b") == tmp_path.resolve() / "b"
    assert inside(tmp_path, ".") == tmp_path.resolve()
