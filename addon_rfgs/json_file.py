# SPDX-License-Identifier: GPL-3.0-or-later
"""JSON from anywhere, checked before it is used: a twin of `rfgs_core.records`.

Blender's Python has no msgspec. A mistake is one line: the file, the place in it, what is expected
there and what was found.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

from .errors import AddonError
from .files import refuse_pipe

#: Whole numbers have no more than 64 bits, as NumPy's.
_MOST = 2**63
_WORDS = {
    int: "a whole number",
    float: "a number",
    str: "text",
    bool: "true or false",
    list: "a list",
    dict: "an object",
}

#: What a value should be: a type, any value (`object`), a list of one form as `[form]`, an object
#: of any names as `{str: form}`, or `Fields`.
Form = Any


@dataclass(frozen=True)
class Fields:
    """An object with these fields; others are left alone."""

    needed: dict[str, Form]
    optional: dict[str, Form] = field(default_factory=dict)


def read_json(file: Path, form: Form, remedy: str, most_bytes: int) -> Any:
    """Reads a JSON file.

    Args:
        file: The file.
        form: What it should hold.
        remedy: What to do about a mistake.
        most_bytes: Larger files are refused.

    Raises:
        AddonError: It is missing, a pipe, too large, no JSON, or holds something else.
    """
    try:
        refuse_pipe(file)
        if file.stat().st_size > most_bytes:
            raise AddonError(f"{file}: larger than any file of this kind; {remedy}")
        value = decoded(file.read_bytes())
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or " ".join(str(error).split())[:80]
        raise AddonError(f"{file}: cannot be read as JSON ({reason}); {remedy}") from error
    problem = misfit(value, form)
    if problem:
        raise AddonError(f"{file}: {problem}; {remedy}")
    return value


def decoded(text: bytes) -> Any:
    """A JSON text.

    Raises:
        ValueError: It is none, or not one that every reader takes alike.
    """
    try:
        return json.loads(text.decode(), parse_constant=_constant, object_pairs_hook=_object)
    except RecursionError as error:
        raise ValueError("nested too deeply") from error


def misfit(value: Any, form: Form, place: str = "") -> str:
    """Where a value is not as it should be, in words; empty if it is."""
    if isinstance(form, Fields):
        return _kind(value, dict, place) or _fields(value, form, place)
    if isinstance(form, list):
        rows = ((item, form[0], f"{place}[{row}]") for row, item in enumerate(_of(value, list)))
        return _kind(value, list, place) or _first(rows)
    if isinstance(form, dict):
        rows = ((item, form[str], f"{place}.{name}"[:80]) for name, item in _of(value, dict))
        return _kind(value, dict, place) or _first(rows)
    return "" if form is object else _kind(value, form, place)


def _of(value: Any, kind: type) -> Iterable[Any]:
    """What a list or an object holds; nothing if it is something else."""
    if not isinstance(value, kind):
        return ()
    return value.items() if isinstance(value, dict) else value


def _first(rows: Iterable[tuple[Any, Form, str]]) -> str:
    return next((found for row in rows if (found := misfit(*row))), "")


def _fields(value: dict[str, Any], form: Fields, place: str) -> str:
    before = f"{place.lstrip('.')}: " if place else ""
    missing = next((name for name in form.needed if name not in value), None)
    if missing:
        return f"{before}field {missing!r} is missing"
    known = {**form.optional, **form.needed}
    return _first((value[name], known[name], f"{place}.{name}") for name in known if name in value)


def _kind(value: Any, kind: type, place: str) -> str:
    # Of Python's own, a truth is a number, too; and whole numbers may have any length.
    fits = type(value) is kind or (kind is float and type(value) is int)
    if fits and kind in (int, float):
        fits = abs(value) < _MOST if type(value) is int else math.isfinite(value)
    if fits:
        return ""
    before = f"{place.lstrip('.')}: " if place else ""
    shown = f"{_WORDS[type(value)]}" if isinstance(value, (list, dict)) else f"{value!r:.60}"
    return f"{before}expected {_WORDS[kind]}, found {shown}"


def _constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is no JSON")


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    value = dict(pairs)
    if len(value) != len(pairs):
        raise ValueError("a name stands twice in an object")
    return value
