# SPDX-License-Identifier: Apache-2.0
"""Reads files of the Lightning Memory-Mapped Database (LMDB, data version 1, by `mdb.c` of 0.9).

The library maps a file and trusts every number in it, so a damaged one ends the process. Here each
page is read and held against the file before it is followed. Pages are as long as the file's first
one says; entries of a page are nodes, of which a branch names the page below and a leaf a value, in
the page itself or from an overflow page on. Databases with several values of a key are refused.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from rfgs_core.errors import RfgsError, RfgsFormatError

_MAGIC, _VERSION = 0xBEEFC0DE, 1
_BRANCH, _LEAF, _OVERFLOW, _META = 1, 2, 4, 8
#: A node's value lies on overflow pages.
_BIG = 1
#: Number of a page, padding, flags, ends of the room that is left.
_HEADER = struct.Struct("<QHHHH")
#: Magic, version, address, size of the map.
_MAPPED = struct.Struct("<IIQQ")
#: Padding (the first database's is the length of a page), flags, depth, pages of three kinds,
#: entries, root.
_TREE = struct.Struct("<IHHQQQQQ")
#: Last page, transaction.
_LAST = struct.Struct("<QQ")
_META_BYTES = _HEADER.size + _MAPPED.size + 2 * _TREE.size + _LAST.size
_NODE = struct.Struct("<HHHH")
_NO_PAGE = 2**64 - 1
#: Levels of a tree; one of 32 holds more than any disk.
_DEEPEST = 32
#: Entries of a file.
_MOST_ENTRIES = 2**23


class _Node(NamedTuple):
    """An entry of a page."""

    key: bytes
    page: int
    """Page below, of a branch."""
    value: bytes
    big: int
    """Length of a value on overflow pages [bytes], 0 where it lies in the page."""


class LmdbFile:
    """One file, open for reading; a context manager.

    Args:
        path: The file itself, not its folder.

    Raises:
        RfgsError: There is no such file.
        RfgsFormatError: It is no database of LMDB, or damaged; also by the methods.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        try:
            self._file = os.open(path, os.O_RDONLY)
        except OSError as error:
            raise RfgsError(f"{path}: {error.strerror or error}") from None
        self._bytes = os.fstat(self._file).st_size
        try:
            first = self._meta(0)
            self._page_bytes = first[0]
            if self._page_bytes not in (2**k for k in range(9, 17)):
                raise self._damaged(f"pages of {self._page_bytes} bytes")
            # Both are written in turn: the later transaction counts.
            self._root = max(first, self._meta(self._page_bytes), key=lambda meta: meta[1])[2]
        except RfgsFormatError:
            self.close()
            raise

    def __enter__(self) -> LmdbFile:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Ends reading."""
        os.close(self._file)

    def keys(self) -> Iterator[bytes]:
        """All keys, in the order of their bytes."""
        waiting = [] if self._root == _NO_PAGE else [(self._root, 0)]
        left, entries = self._bytes // self._page_bytes, 0
        while waiting:
            number, depth = waiting.pop()
            left -= 1
            if left < 0:
                raise self._damaged("pages that lead to each other")
            branch, nodes = self._nodes(number, depth)
            entries += len(nodes)
            if entries > _MOST_ENTRIES:
                raise RfgsFormatError(f"{self._path}: over {_MOST_ENTRIES} entries")
            if branch:
                waiting += [(node.page, depth + 1) for node in reversed(nodes)]
            else:
                yield from (node.key for node in nodes)

    def get(self, key: bytes, most_bytes: int) -> bytes | None:
        """The value of a key; None if there is none.

        Args:
            key: As it was stored.
            most_bytes: A longer value is refused.
        """
        number, depth = self._root, 0
        while number != _NO_PAGE:
            branch, nodes = self._nodes(number, depth)
            if branch:
                # The first key of a branch stands for all that is smaller.
                below = [node for node in nodes[1:] if node.key <= key]
                number, depth = (below[-1] if below else nodes[0]).page, depth + 1
                continue
            for node in nodes:
                if node.key == key:
                    return self._value(node, most_bytes)
            return None
        return None

    def _value(self, node: _Node, most_bytes: int) -> bytes:
        size = node.big or len(node.value)
        if size > most_bytes:
            raise RfgsFormatError(f"{self._path}: a value of {size} bytes, at most {most_bytes}")
        if not node.big:
            return node.value
        start = node.page * self._page_bytes
        if not _HEADER.unpack(self._read(start, _HEADER.size))[2] & _OVERFLOW:
            raise self._damaged("a value on a page of another kind")
        return self._read(start + _HEADER.size, size)

    def _nodes(self, number: int, depth: int) -> tuple[bool, list[_Node]]:
        """Whether a page is a branch, and its entries."""
        if depth > _DEEPEST:
            raise self._damaged("a tree that has no end")
        page = self._read(number * self._page_bytes, self._page_bytes)
        _, _, flags, low, _ = _HEADER.unpack_from(page)
        # Values of one key only, each with a header: neither subpages nor pages of bare keys.
        if flags & ~0x10 not in (_BRANCH, _LEAF) or not _HEADER.size <= low <= len(page):
            raise self._damaged(f"page {number} of kind {flags:#x}")
        count, branch = (low - _HEADER.size) // 2, bool(flags & _BRANCH)
        if branch and not count:
            raise self._damaged(f"page {number} without entries")
        starts = struct.unpack_from(f"<{count}H", page, _HEADER.size)
        return branch, [self._node(page, start, branch) for start in starts]

    def _node(self, page: bytes, start: int, branch: bool) -> _Node:
        if start + _NODE.size > len(page):
            raise self._damaged("an entry past its page")
        low, high, flags, key_bytes = _NODE.unpack_from(page, start)
        at = start + _NODE.size
        key, rest = page[at : at + key_bytes], at + key_bytes
        if branch:
            return _Node(key, low | high << 16 | flags << 32, b"", 0)
        if flags & ~_BIG:
            raise self._damaged("several values of a key")
        size = low | high << 16
        ends = rest + (8 if flags else size)
        if ends > len(page):
            raise self._damaged("an entry past its page")
        if flags:
            return _Node(key, int.from_bytes(page[rest:ends], "little"), b"", size)
        return _Node(key, 0, page[rest:ends], 0)

    def _meta(self, start: int) -> tuple[int, int, int]:
        """Length of a page, transaction and root, by a meta page."""
        page = self._read(start, _META_BYTES)
        magic, version, _, _ = _MAPPED.unpack_from(page, _HEADER.size)
        if magic != _MAGIC or version != _VERSION or not _HEADER.unpack_from(page)[2] & _META:
            raise self._damaged("no such header")
        at = _HEADER.size + _MAPPED.size
        page_bytes = _TREE.unpack_from(page, at)[0]
        root = _TREE.unpack_from(page, at + _TREE.size)[7]
        return page_bytes, _LAST.unpack_from(page, at + 2 * _TREE.size)[1], root

    def _read(self, start: int, size: int) -> bytes:
        """Bytes of the file; all of them."""
        if start + size > self._bytes:
            raise self._damaged(f"{size} bytes from {start} on, past the end")
        found = os.pread(self._file, size, start)
        if len(found) != size:
            raise self._damaged("an end before its length")
        return found

    def _damaged(self, found: str) -> RfgsFormatError:
        return RfgsFormatError(f"{self._path}: expected a whole file of LMDB, found {found}")
