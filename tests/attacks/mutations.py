# SPDX-License-Identifier: Apache-2.0
"""Damage to files: to their bytes, and to what they say where that is still a file of its kind."""

from __future__ import annotations

import functools
import io
import json
import random
import re
import zipfile
import zlib
from collections.abc import Callable
from typing import Any

import numpy as np

Mutation = Callable[[bytes, random.Random], bytes]

#: Values that no field of ours has, and some that are nearly right.
STRANGE: tuple[Any, ...] = (
    *(None, True, False, -1, 0, 1, 2, 0.5, -0.0, 1e308, -1e308, 2**31, 2**63, -(2**63), 10**30),
    *("", "x", "1", "nan", "inf", "\0", "../../../etc/passwd", "/dev/zero", "a" * 5000, "\u202e"),
    *([], {}, [[]], [None], [1, 2, 3], {"a": 1}, [{}], ["x"] * 100, list(range(5000))),
)
#: Written as they are, since no encoder of JSON would.
RAW = ("NaN", "Infinity", "1e999", "[" * 20_000, "{" * 9, "'", "0x10", "1_000", "\\ud800")


def bytes_of(data: bytes, state: random.Random) -> bytes:
    """Flips, cuts, doubles, swaps or appends bytes."""
    changed, size = bytearray(data), len(data)
    first, second = sorted((state.randrange(size + 1), state.randrange(size + 1)))
    near = min(size, first + state.randrange(1, 64))
    kind = state.randrange(9)
    if kind <= 2:
        for _ in range(state.choice((1, 1, 2, 8))):
            changed[state.randrange(size)] ^= 1 << state.randrange(8)
    elif kind == 3:
        del changed[first:]
    elif kind == 4:
        changed[first:near] = state.randbytes(near - first)
    elif kind == 5:
        changed[first:first] = state.randbytes(state.randrange(1, 40))
    elif kind == 6:
        del changed[first:near]
    elif kind == 7:
        changed += changed[first:second] if second - first < 100_000 else b"\0" * 100
    else:
        changed[first:near] = state.choice((b"\xff", b"\0", b"9", b" ")) * (near - first)
    return bytes(changed)


def json_of(data: bytes, state: random.Random) -> bytes:
    """Replaces, removes or adds a value of a JSON file."""
    if state.random() < 0.3:
        return bytes_of(data, state)
    value = json.loads(data)
    places = list(_places(value))
    holder, key = state.choice(places)
    kind = state.randrange(10)
    if kind == 0:
        del holder[key]
    elif kind == 1 and isinstance(holder, dict):
        holder[state.choice(("__class__", "x" * 3, "", "schema2"))] = state.choice(STRANGE)
    elif kind == 2 and isinstance(holder, list):
        holder.append(state.choice((holder[0], *STRANGE)))
    elif kind == 3:
        other, name = state.choice(places)
        holder[key] = other[name]
        try:
            return json.dumps(value).encode()
        except ValueError:
            holder[key] = None
    elif kind == 4:
        holder[key] = "\0mark\0"
        return json.dumps(value).replace('"\\u0000mark\\u0000"', state.choice(RAW)).encode()
    elif kind in (6, 7) and str(holder[key])[:1] == "{" and isinstance(holder[key], str):
        # JSON within JSON, as settings that an array carries.
        holder[key] = json_of(holder[key].encode(), state).decode("utf-8", "replace")
    elif kind == 5 and isinstance(holder[key], int | float):
        holder[key] = state.choice((-1, 1e9, 0.1, -1e-9, 3)) * holder[key]
    else:
        holder[key] = state.choice(STRANGE)
    return json.dumps(value).encode()


def _places(value: Any) -> Any:
    """Every holder and key within a JSON value."""
    if isinstance(value, dict | list):
        for key in value if isinstance(value, dict) else range(len(value)):
            yield value, key
            yield from _places(value[key])


def tensors_of(data: bytes, state: random.Random) -> bytes:
    """Damages a safetensors file: its bytes, its header, or the text within that."""
    size = int.from_bytes(data[:8], "little")
    head, body = data[8 : 8 + size], data[8 + size :]
    kind = state.randrange(4)
    if kind == 0:
        return bytes_of(data, state)
    if kind == 1:
        return data[: 8 + size] + bytes_of(body, state)
    card = json.loads(head).get("__metadata__", {}).get("card")
    if kind == 2 and card:
        value = json.loads(head)
        damaged = json_of(card.encode(), state).decode("utf-8", "replace")
        value["__metadata__"]["card"] = damaged
        changed = json.dumps(value).encode()
    else:
        changed = json_of(head, state)
    return len(changed).to_bytes(8, "little") + changed + body


def text_of(data: bytes, state: random.Random) -> bytes:
    """Damages a line of a text file, or its bytes."""
    if state.random() < 0.4:
        return bytes_of(data, state)
    lines = data.decode().splitlines()
    index = state.randrange(len(lines))
    name, colon, old = lines[index].partition(":")
    code = "!!python/object:os.system x"
    strange = state.choice((*map(str, STRANGE[:27]), *RAW, "&a [*a]", code))
    twice = f"{lines[index]}\n{lines[index]}"
    lines[index] = state.choice((f"{name}{colon} {strange}", f"{strange}{colon}{old}", "", twice))
    return "\n".join(lines).encode()


def numbers_of(data: bytes, state: random.Random) -> bytes:
    """Replaces a number that stands in the text at a file's head, as in that of a PLY."""
    if state.random() < 0.4:
        return bytes_of(data, state)
    end = data.find(b"end_header") + 11
    head, body = data[:end], data[end:]
    words = list(re.finditer(rb"[\w.]+", head))
    word = state.choice(words)
    other = state.choice(
        (b"-1", b"0", b"999999999999", b"3000000", b"list", b"double", b"uchar", b"ascii", b"x y",
         b"binary_big_endian", b"element", b"property", state.choice(words)[0])
    )  # fmt: skip
    return head[: word.start()] + other + head[word.end() :] + body


#: Stands for the bomb among the members of an archive.
BOMB = b"bomb"


def arrays_of(data: bytes, state: random.Random) -> bytes:
    """Damages an archive, or one array within it so that the archive is whole again."""
    if state.random() < 0.35:
        return bytes_of(data, state)
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = {info.filename: archive.read(info) for info in archive.infolist()}
    name = state.choice(list(members))
    kind = state.randrange(8)
    if kind == 0:
        del members[name]
    elif kind == 1:
        members[name] = bytes_of(members[name], state)
    elif kind == 2:
        members[name] = _headed(members[name], state)
    elif kind == 3:
        return _flagged(_packed(members), state)
    elif kind == 4:
        members[state.choice(("extra.npy", name))] = BOMB
    elif kind == 5:
        other = state.choice(list(members))
        members[name], members[other] = members[other], members[name]
    else:
        members[name] = _reshaped(members[name], state)
    return _packed(members)


def _packed(members: dict[str, bytes]) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, value in members.items():
            if value is BOMB:
                _add_bomb(archive, name)
            else:
                archive.writestr(name, value)
    return stream.getvalue()


def _add_bomb(archive: zipfile.ZipFile, name: str) -> None:
    """Adds an array of zeros that unpacks to 320 MB; packing it anew each time takes a second."""
    packed, size, crc = _packed_bomb()
    info = zipfile.ZipInfo(name)
    info.compress_type, info.header_offset = zipfile.ZIP_DEFLATED, archive.fp.tell()
    info.file_size, info.compress_size, info.CRC = size, len(packed), crc
    archive.fp.write(info.FileHeader() + packed)
    archive.filelist.append(info)
    archive.NameToInfo[name] = info
    archive.start_dir = archive.fp.tell()


@functools.cache
def _packed_bomb() -> tuple[bytes, int, int]:
    """The array as one deflated stream, its length unpacked, and its checksum."""
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        head, {"descr": "<f8", "fortran_order": False, "shape": (40_000_000,)}
    )
    packer = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS)
    pieces = [head.getvalue(), *[bytes(8_000_000)] * 40]
    packed = b"".join([packer.compress(piece) for piece in pieces]) + packer.flush()
    crc = functools.reduce(lambda crc, piece: zlib.crc32(piece, crc), pieces, 0)
    return packed, sum(map(len, pieces)), crc


def _flagged(data: bytes, state: random.Random) -> bytes:
    """An archive that calls itself encrypted, or packed in another way."""
    changed = bytearray(data)
    at = changed.rfind(b"PK\x01\x02")
    field = state.choice((8, 10, 20, 24, 42))
    other = state.choice((b"\1\0", b"\x0e\0", b"\x0c\0", b"\xff\xff"))
    changed[at + field : at + field + 2] = other
    return bytes(changed)


def _headed(data: bytes, state: random.Random) -> bytes:
    """An array with another header."""
    swaps = (
        (rb"'shape': \([^)]*\)", b"'shape': (3000000000,)"),
        (rb"'shape': \([^)]*\)", b"'shape': (-1, 3)"),
        (rb"'shape': \([^)]*\)", b"'shape': (2, 'a')"),
        (rb"'descr': '[^']*'", b"'descr': '|O'"),
        (rb"'descr': '[^']*'", b"'descr': '<c16'"),
        (rb"'descr': '[^']*'", b"'descr': [('a', '<f4')]"),
        (rb"'fortran_order': False", b"'fortran_order': True "),
        (rb"\{", b"("),
        (rb"\}", b"} \\\n"),
    )
    pattern, other = state.choice(swaps)
    end = 10 + int.from_bytes(data[8:10], "little")
    head = re.sub(pattern, lambda _: other, data[10:end], count=1)
    head = head.rstrip(b" \n").ljust(end - 11) + b"\n"
    return data[:8] + len(head).to_bytes(2, "little") + head + data[end:]


def _reshaped(data: bytes, state: random.Random) -> bytes:
    """An array of another type, another length, or with strange values."""
    value = np.load(io.BytesIO(data), allow_pickle=False)
    kind = state.randrange(6)
    if kind == 0:
        kinds = ("U3", "S2") if value.dtype.kind == "U" else ("c16", "f2", "i1", "U3", "?", ">f4")
        value = value.astype(state.choice(kinds))
    elif kind == 1 and value.ndim:
        value = np.concatenate([value, value[:1]])
    elif kind == 2 and value.ndim:
        value = value[:-1]
    elif kind == 3:
        value = value[None]
    elif value.dtype.kind == "f" and value.size:
        value = value.copy()
        value.ravel()[state.randrange(value.size)] = state.choice((np.nan, np.inf, 1e30, -1.0))
    elif value.dtype.kind == "i" and value.size:
        value = value.copy()
        value.ravel()[state.randrange(value.size)] = state.choice((-1, 2**31 - 1, 10**6))
    stream = io.BytesIO()
    with np.errstate(all="ignore"):
        np.save(stream, value)
    return stream.getvalue()
