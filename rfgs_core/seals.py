# SPDX-License-Identifier: Apache-2.0
"""Seals: a file's own SHA-256 within it, so that a reader notices every change of it.

A seal is `MARK` and 64 hexadecimal digits in a place that the format leaves free: a field of JSON,
a comment of PLY, the comment of an archive. It is the digest of the file with zeros for these
digits. It tells damage, not who wrote the file: whoever can write one can seal it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.files import decoded_json, json_bytes, json_text, write_bytes

MARK = b"rfgs-sha256:"
_ZEROS = b"0" * 64
#: What a format writes where the seal shall stand.
BLANK = (MARK + _ZEROS).decode()


def sealed(data: bytes) -> bytes:
    """A file's bytes with the digits of its seal in place of those of `BLANK`."""
    head, _, tail = data.partition(BLANK.encode())
    return head + MARK + hashlib.sha256(data).hexdigest().encode() + tail


def check_seal(path: Path, data: bytes, remedy: str) -> None:
    """Refuses a file that has changed since it was sealed.

    Args:
        path: The file, for the message.
        data: Its bytes.
        remedy: What to do about it.

    Raises:
        RfgsFormatError: It has no seal, or another one than its bytes have.
    """
    head, mark, rest = data.partition(MARK)
    if not mark:
        raise RfgsFormatError(
            f"{path}: expected a seal ({MARK.decode()}…), found none: damaged, or of another "
            f"program or version of rfgs; {remedy}"
        )
    digits = hashlib.sha256(head + mark + _ZEROS + rest[64:]).hexdigest()
    if digits.encode() != rest[:64]:
        raise RfgsFormatError(f"{path}: changed or damaged since it was written; {remedy}")


def write_sealed_json(path: Path, value: Mapping[str, Any]) -> None:
    """Writes an object as `write_json` does, with a seal in a field `seal`."""
    write_bytes(path, sealed(json_text({**value, "seal": BLANK}).encode()))


def read_sealed_json(path: Path, remedy: str) -> dict[str, Any]:
    """Reads an object that `write_sealed_json` wrote, without its seal.

    Args:
        path: The file.
        remedy: What to do about a file that has changed.

    Raises:
        RfgsError: There is no such file.
        RfgsFormatError: It is no JSON object, or has changed since it was written.
    """
    try:
        data = json_bytes(path)
    except FileNotFoundError as error:
        raise RfgsError(f"{path}: no such file; {remedy}") from error
    value = decoded_json(path, data)
    if not isinstance(value, dict):
        raise RfgsFormatError(f"{path}: expected an object, found something else; {remedy}")
    check_seal(path, data, remedy)
    value.pop("seal", None)
    return value
