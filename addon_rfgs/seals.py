# SPDX-License-Identifier: GPL-3.0-or-later
"""Seals: a file's own SHA-256 within it. A twin of `rfgs_core.seals`, which says more of them."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

from .errors import AddonError
from .files import json_text, refuse_pipe, replacing

MARK = b"rfgs-sha256:"
#: What a format writes where the seal shall stand.
BLANK = MARK.decode() + "0" * 64


def sealed(data: bytes) -> bytes:
    """A file's bytes with the digits of its seal in place of those of `BLANK`."""
    head, _, tail = data.partition(BLANK.encode())
    return head + MARK + hashlib.sha256(data).hexdigest().encode() + tail


def write_sealed_json(path: Path, value: dict[str, Any]) -> None:
    """Writes an object with a seal in a field `seal`."""
    data = sealed(json_text({**value, "seal": BLANK}).encode())
    with replacing(path) as temporary:
        temporary.write_bytes(data)


def check_seal(path: Path, remedy: str) -> None:
    """Refuses a file that has changed since it was sealed.

    Raises:
        AddonError: It cannot be read, has no seal, or another one than its bytes have.
    """
    refuse_pipe(path)
    try:
        data = path.read_bytes()
    except OSError as error:
        raise AddonError(f"{path}: cannot be read ({error.strerror}); {remedy}") from error
    head, mark, rest = data.partition(MARK)
    if not mark:
        raise AddonError(f"{path}: no seal, so not a file of this version of rfgs; {remedy}")
    if sealed(head + BLANK.encode() + rest[64:]) != data:
        raise AddonError(f"{path}: changed or damaged since it was written; {remedy}")
