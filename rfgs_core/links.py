# SPDX-License-Identifier: Apache-2.0
"""Symbolic links that lead out of a dataset or a run: nothing is read or written through them.

Both kinds of folder are handed around, so what lies in them may come from anywhere.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator
from pathlib import Path

from rfgs_core.errors import RfgsFormatError

#: What makes a folder a dataset, a run or a scene bundle, and what that file then holds.
_MARKS = (
    ("dataset.json", b'"rfgs-dataset/'),
    ("config.json", b'"rfgs-run/'),
    ("bundle.json", b'"rfgs-bundle/'),
)


def refuse_link(path: Path | str) -> None:
    """Refuses a path that leaves the dataset or run that it lies in through a symbolic link.

    Datasets and runs may themselves be reached through links, and may hold links to their own
    files. Whether `path` exists does not matter.

    Raises:
        RfgsFormatError: It leads elsewhere.
    """
    spelt, real = os.path.abspath(path), os.path.realpath(path)
    if spelt == real:
        return
    folder = os.path.dirname(spelt)
    while folder != os.path.dirname(folder):
        home = os.path.realpath(folder)
        if os.path.commonpath([home, real]) != home and _is_marked(folder):
            raise RfgsFormatError(
                f"{path}: a symbolic link leads out of {folder}, to {real}; expected files and "
                "folders of its own, replace the link by what it points to"
            )
        folder = os.path.dirname(folder)


def symbolic_links(folder: Path | str, without: Collection[str] = ()) -> Iterator[Path]:
    """Every symbolic link below a folder; none is followed.

    Args:
        folder: Where to look.
        without: Names of folders in it that are not looked into.
    """
    with os.scandir(folder) as entries:
        rows = sorted(entries, key=lambda entry: entry.name)
    for entry in rows:
        if entry.is_symlink():
            yield Path(entry.path)
        elif entry.name not in without and entry.is_dir():
            yield from symbolic_links(entry.path)


def _is_marked(folder: str) -> bool:
    """Whether a folder is a dataset, a run or a scene bundle."""
    for name, word in _MARKS:
        try:
            with open(os.path.join(folder, name), "rb") as stream:
                if word in stream.read():
                    return True
        except OSError:
            continue
    return False
