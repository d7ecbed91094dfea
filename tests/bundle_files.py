# SPDX-License-Identifier: Apache-2.0
"""Bundles that tests write or change, with the digests that an export gives them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rfgs_core.files import sha256
from rfgs_core.seals import read_sealed_json, write_sealed_json


def describe_bundle(folder: Path, info: dict[str, Any] | None = None) -> None:
    """Writes `bundle.json` for the files that are there; without `info`, what it said before."""
    file = folder / "bundle.json"
    said = read_sealed_json(file, "") if info is None else info
    files = [path for path in folder.rglob("*") if path.is_file() and path != file]
    digests = {path.relative_to(folder).as_posix(): sha256(path) for path in files}
    write_sealed_json(file, {**said, "digests": digests})
