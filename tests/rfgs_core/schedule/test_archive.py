# SPDX-License-Identifier: Apache-2.0
"""Folders travel whole, and nothing that comes back leads out of its folder."""

from __future__ import annotations

import io
import os
import zipfile
from pathlib import Path

from rfgs_core.schedule.archive import packed, unpack


def test_a_folder_arrives_as_it_left(tmp_path: Path) -> None:
    folder, there = tmp_path / "here", tmp_path / "there"
    for name, data in (("a.json", b"{}"), ("deep/b.npz", bytes(range(256)) * 99), ("skip/c", b"c")):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(data)
    # Files of some archives are dated at the beginning of time, before zip files can be.
    os.utime(folder / "a.json", (0, 0))
    unpack(packed(folder, without="skip"), there)
    found = {path.relative_to(there).as_posix() for path in there.rglob("*") if path.is_file()}
    assert found == {"a.json", "deep/b.npz"}
    assert all((there / name).read_bytes() == (folder / name).read_bytes() for name in found)


def test_nothing_leads_out_of_the_folder(tmp_path: Path) -> None:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name in ("../beside", str(tmp_path / "absolute"), "in/../../beside"):
            archive.writestr(name, b"x")
    unpack(buffer.getvalue(), tmp_path / "folder")
    outside = [path for path in tmp_path.iterdir() if path.name != "folder"]
    assert outside == []
