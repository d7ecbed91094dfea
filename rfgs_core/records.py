# SPDX-License-Identifier: Apache-2.0
"""Values out of JSON and YAML as the types that they should have: the one place that checks them.

A mistake is one line: the file, the place in it, what is expected there, and what was found.
"""

from __future__ import annotations

import functools
import math
import re
from pathlib import Path
from typing import Any, TypeVar

import msgspec
from msgspec import inspect

from rfgs_core.errors import RfgsFormatError
from rfgs_core.files import read_json

T = TypeVar("T")

_WORDS = {
    "int": "a whole number",
    "float": "a number",
    "str": "text",
    "bool": "true or false",
    "array": "a list",
    "object": "an object",
}
#: Longest value that a message shows.
_SHOWN = 60


def read_record(path: Path, kind: type[T], remedy: str = "") -> T:
    """Reads a JSON file as a type; fields that the type does not name are left out.

    Raises:
        RfgsError: There is no such file.
        RfgsFormatError: It is no JSON, or not of that type.
    """
    return record(path, read_json(path), kind, remedy)


def record(
    source: Path | str, value: object, kind: Any, remedy: str = "", *, lax: bool = False
) -> Any:
    """A value out of JSON or YAML as a type.

    Args:
        source: Where it comes from, for the message.
        value: Objects, lists, numbers, texts, truths and null.
        kind: Any type that msgspec converts to, such as a dataclass.
        remedy: What to do about a mistake; empty for nothing.
        lax: Take numbers in quotes, too, as long as they are finite.

    Raises:
        RfgsFormatError: The value is not of that type.
    """
    try:
        found = msgspec.convert(value, kind, strict=not lax)
        # JSON has finite numbers alone; texts may spell others.
        problem = _strange(msgspec.to_builtins(found)) if lax else ""
        if not problem:
            return found
    except (msgspec.ValidationError, OverflowError) as error:
        problem = _problem(str(error), value, kind)
    raise RfgsFormatError(f"{source}: {problem}{f'; {remedy}' if remedy else ''}")


def unknown_fields(value: object, kind: Any) -> list[str]:
    """Names in a JSON object that a dataclass or struct has no field of."""
    known = _names(kind)
    return (
        sorted(str(name) for name in value if name not in known) if isinstance(value, dict) else []
    )


@functools.cache
def _names(kind: Any) -> frozenset[str]:
    return frozenset(field.encode_name for field in _fields(inspect.type_info(kind)))


def _problem(said: str, value: object, kind: Any) -> str:
    """What msgspec says of a value, as place, expected and found."""
    text, _, place = said.partition(" - at ")
    missing = re.fullmatch(r"Object (missing required|contains unknown) field `(.*)`", text)
    parts = re.findall(r"\.([^.\[]+)|\[(\d+|\.\.\.)\]", place.strip("`").removeprefix("$"))
    steps = [name or index for name, index in parts]
    where = "".join(f".{name}" if name else f"[{index}]" for name, index in parts).lstrip(".")
    before = f"{where}: " if where else ""
    if missing:
        what = "is missing" if missing[1].startswith("missing") else "is unknown"
        return f"{before}field {missing[2]!r} {what}"
    found = _found(value, steps)
    wanted = re.fullmatch(r"Expected (.*?)(?:, got (.*))?", text)
    expected = _spelt(wanted[1]) if wanted else _choices(kind, steps) or text
    told = _spelt(wanted[2]) if wanted and wanted[2] else "something else"
    shown = _shown(found) if found is not _UNKNOWN else told
    return f"{before}expected {expected}, found {shown}"


def _strange(value: object, place: str = "") -> str:
    """Where a number is not finite, in words; empty if all are."""
    if isinstance(value, float) and not math.isfinite(value):
        return f"{place}: expected a finite number, found {value}"
    rows = value.items() if isinstance(value, dict) else ()
    rows = enumerate(value) if isinstance(value, list | tuple) else rows
    return next(filter(None, (_strange(part, place or str(key)) for key, part in rows)), "")


_UNKNOWN = object()


def _found(value: Any, steps: list[str]) -> Any:
    """The value at a place."""
    for step in steps:
        if isinstance(value, dict) and step in value:
            value = value[step]
        elif isinstance(value, list | tuple) and step.isdigit() and int(step) < len(value):
            value = value[int(step)]
        else:
            return _UNKNOWN
    return value


def _spelt(expected: str) -> str:
    """The words that msgspec has for a type in ours."""
    kinds, _, more = expected.lstrip("`").partition("`")
    return " or ".join(_WORDS.get(kind, kind) for kind in kinds.split(" | ")) + more


def _shown(value: object) -> str:
    if isinstance(value, dict):
        return "an object"
    if isinstance(value, list | tuple) and len(value) > 6:
        return f"a list of {len(value)}"
    plain = value is None or isinstance(value, bool)
    text = msgspec.json.encode(value).decode() if plain else repr(value)
    return text if len(text) <= _SHOWN else text[:_SHOWN] + "…"


def _choices(kind: Any, steps: list[str]) -> str:
    """The values that a place of a type may have, in words; empty where it is no choice."""
    info = inspect.type_info(kind)
    for step in steps:
        info = _within(info, step)
    kinds = info.types if isinstance(info, inspect.UnionType) else (info,)
    values = [
        value for one in kinds if isinstance(one, inspect.LiteralType) for value in one.values
    ]
    return " or ".join(map(str, values))


def _within(info: Any, step: str) -> Any:
    """The type of one part of a type."""
    for field in _fields(info):
        if field.encode_name == step:
            return field.type
    if isinstance(info, inspect.TupleType) and step.isdigit():
        return info.item_types[int(step)]
    return getattr(info, "item_type", getattr(info, "value_type", None))


def _fields(info: Any) -> tuple[Any, ...]:
    return getattr(info, "fields", ())
