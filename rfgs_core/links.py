# SPDX-License-Identifier: Apache-2.0
"""Symbolic links that lead out of a dataset or a run: nothing is read or written through them.

Both kinds of folder are handed around, so what lies in them may come from anywhere. Nor is
anything read that is neither file nor folder: a pipe keeps its reader waiting for ever.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import msgspec

from rfgs_core.errors import RfgsFormatError

#: What makes a folder a dataset, a run or a scene bundle, and how its schema then begins.
_MARKS = {
    "a dataset": ("dataset.json", "rfgs-dataset/"),
    "a run": ("config.json", "rfgs-run/"),
    "a scene bundle": ("bundle.json", "rfgs-bundle/"),
}
#: Larger files are refused wherever they are read, so they mark nothing [bytes].
_LARGEST_MARK = 2**25


#: Where programs that this one starts learn which folders are `filled`, as a list in JSON.
_FILLED = "RFGS_FILLED_FOLDERS"


class _Mark(msgspec.Struct):
    schema: str


@contextmanager
def filled(folder: Path) -> Iterator[None]:
    """While a command fills a folder, no link leads out of that, here or in programs it starts.

    Args:
        folder: Where the command writes; it need not be there yet.
    """
    before = os.environ.get(_FILLED, "[]")
    folders = [*msgspec.json.decode(before), os.path.abspath(folder)]
    os.environ[_FILLED] = msgspec.json.encode(folders).decode()
    try:
        yield
    finally:
        os.environ[_FILLED] = before


def refuse_link(path: Path | str) -> None:
    """Refuses a path that leaves the folder that it lies in through a symbolic link.

    Such folders are datasets, runs, scene bundles, and what a command fills (`filled`).

    Datasets and runs may themselves be reached through links, and may hold links to their own
    files. Whether `path` exists does not matter.

    Raises:
        RfgsFormatError: It leads elsewhere, or is a pipe, a socket or a device.
    """
    spelt = os.path.abspath(path)
    if _is_plain(spelt):
        return
    real = os.path.realpath(path)
    with suppress(OSError):
        kind = os.lstat(real).st_mode
        if not (stat.S_ISREG(kind) or stat.S_ISDIR(kind)):
            raise RfgsFormatError(f"{path}: expected a file or a folder, found {_kind(kind)}")
    if spelt == real:
        return
    folder = os.path.dirname(spelt)
    while folder != os.path.dirname(folder):
        home = os.path.realpath(folder)
        if os.path.commonpath([home, real]) != home and (
            folder in msgspec.json.decode(os.environ.get(_FILLED, "[]")) or kind_of(folder)
        ):
            raise RfgsFormatError(
                f"{path}: a symbolic link leads out of {folder}, to {real}; expected files and "
                "folders of its own, replace the link by what it points to"
            )
        folder = os.path.dirname(folder)


def _is_plain(spelt: str) -> bool:
    """Whether an absolute path is one of a file or folder without any link, as the system says.

    Faster than looking at every folder on the way; where it cannot be asked, the answer is no.
    """
    try:
        # Opens nothing: a pipe does not wait.
        place = os.open(spelt, os.O_PATH | os.O_CLOEXEC)
    except (AttributeError, OSError, ValueError):
        return False
    try:
        return stands_at(place, spelt)
    finally:
        os.close(place)


def stands_at(place: int, path: Path | str) -> bool:
    """Whether an open file or folder is the one of this path, and no link is on the way there.

    Where the system cannot be asked, the answer is no; `refuse_link` then looks itself.

    Args:
        place: Descriptor of what is open.
        path: By which it was opened.
    """
    try:
        kind = os.fstat(place).st_mode
        plain = stat.S_ISREG(kind) or stat.S_ISDIR(kind)
        return plain and os.readlink(f"/proc/self/fd/{place}") == os.path.abspath(path)
    except OSError:
        return False


def strange_entries(folder: Path | str, without: Collection[str] = ()) -> Iterator[Path]:
    """Everything below a folder that is neither file nor folder: links, pipes, sockets, devices.

    Args:
        folder: Where to look; no link is followed.
        without: Names of folders in it that are not looked into.
    """
    left, first = [os.fspath(folder)], True
    while left:
        with os.scandir(left.pop()) as entries:
            for entry in entries:
                if entry.is_dir(follow_symlinks=False):
                    if not first or entry.name not in without:
                        left.append(entry.path)
                elif not entry.is_file(follow_symlinks=False):
                    yield Path(entry.path)
        first = False


def described(entry: Path) -> str:
    """What `strange_entries` has found, in words."""
    if entry.is_symlink():
        return f"a symbolic link to {entry.readlink()}"
    return _kind(entry.lstat().st_mode)


def _kind(mode: int) -> str:
    kinds = ((stat.S_ISFIFO, "a pipe"), (stat.S_ISSOCK, "a socket"))
    return next((name for matches, name in kinds if matches(mode)), "a device")


def kind_of(folder: Path | str) -> str:
    """What a folder is: a dataset, a run or a scene bundle; empty where it is something else."""
    for kind, (name, begin) in _MARKS.items():
        # As it will be read: a schema may be spelt with escapes, too.
        with suppress(OSError, msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
            file = os.path.join(folder, name)
            about = os.stat(file)
            if not stat.S_ISREG(about.st_mode) or about.st_size > _LARGEST_MARK:
                continue
            with open(file, "rb") as stream:
                mark = msgspec.json.decode(stream.read(), type=_Mark)
            if mark.schema.startswith(begin):
                return kind
    return ""
