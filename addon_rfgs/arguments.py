# SPDX-License-Identifier: GPL-3.0-or-later
"""Commands out of operators: their properties and settings become options of a parser."""

from __future__ import annotations

import argparse
import math
import os
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, TextIO

import bpy

from .command import Command
from .errors import AddonError
from .reporting import call
from .saving import save_copy
from .scene.frames import named, unit_scale

_UNITS = {"LENGTH": " [m]", "ROTATION": " [°]"}


@dataclass(frozen=True)
class Option:
    """One option of a command, and the properties that it sets."""

    word: str
    """`--range LOW HIGH`, `--out`, or `device` for what has a fixed place."""
    group: str
    """Settings of the scene that the properties belong to; empty: the operator's own."""
    specs: tuple[Any, ...]

    @property
    def flag(self) -> str:
        """The option without the names of its values."""
        return self.word.split()[0]

    @property
    def key(self) -> str:
        """Where argparse puts the value."""
        return "+".join(spec.identifier for spec in self.specs)


def operator_properties(kind: type | None) -> list[Any]:
    """Properties of an operator that a user sees."""
    if kind is None:
        return []
    called = getattr(bpy.ops.rfgs, kind.bl_idname.removeprefix("rfgs."))
    specs = called.get_rna_type().properties
    return [spec for spec in specs if spec.identifier != "rna_type" and not spec.is_hidden]


def options_of(command: Command, kind: type | None) -> Iterator[Option]:
    """Every option that sets properties: those of the operator, then those of settings."""
    rows = {spec.identifier: ("", spec) for spec in operator_properties(kind)}
    for group, names in command.reads.items():
        specs = type(_settings(group)).bl_rna.properties
        rows |= {name: (group, specs[name]) for name in names}
    for word, names in command.together.items():
        found = [rows.pop(name) for name in names]
        yield Option(word, found[0][0], tuple(spec for _, spec in found))
    implied = {name for values in command.means.values() for name in values}
    for name, (group, spec) in rows.items():
        if name not in implied:
            word = command.words.get(name, f"--{name.replace('_', '-')}")
            yield Option(word, group, (spec,))


def _settings(group: str) -> Any:
    return getattr(bpy.context.scene.rfgs, group)


def add_command(tasks: Any, command: Command, kind: type | None) -> None:
    """Adds a command to a parser.

    Args:
        tasks: What argparse calls subparsers.
        command: What is to be added.
        kind: Its operator; None if it has none.
    """
    text = (command.help or kind.bl_description).replace("%", "%%")
    line, _, more = text.partition("\n")
    first = line.removesuffix(".")
    # One paragraph to argparse: the first line ends like a sentence.
    parser = tasks.add_parser(
        command.name.split()[-1],
        help=f"{first[0].lower()}{first[1:]}",
        description=f"{first}. {more}".rstrip(),
    )
    options = list(options_of(command, kind))
    for option in options:
        place, how = _argument(command, option)
        parser.add_argument(*place, **how)
    for flag, values in command.means.items():
        if all(flag != option.flag for option in options) and flag != "--frame":
            parser.add_argument(flag, action="store_true", help=_meaning(kind, values))
    for flag, name in command.instead.items():
        told = getattr(bpy.ops.rfgs, name).get_rna_type().description
        parser.add_argument(flag, action="store_true", help=f"instead: {told}")
    if command.frame:
        parser.add_argument("--frame", type=int, metavar="N", help="go to this frame first")
    if command.saves:
        parser.add_argument(
            "--out", dest="saved", type=Path, required=True, metavar="BLEND", help=".blend to save"
        )
    if command.add:
        command.add(parser)
    parser.set_defaults(run=partial(_run, command, kind))


def _meaning(kind: type | None, values: Any) -> str:
    """What a switch does, in the words of the property that it sets."""
    specs = {spec.identifier: spec for spec in operator_properties(kind)}
    name, value = next(iter(values.items()))
    if specs[name].type == "ENUM":
        return specs[name].enum_items[value].description
    return f"{'' if value else 'not: '}{specs[name].description}"


def _argument(command: Command, option: Option) -> tuple[list[str], dict[str, Any]]:
    """What argparse is told about an option."""
    spec, count = option.specs[0], len(option.specs)
    told = " … ".join(dict.fromkeys(row.description for row in option.specs))
    how: dict[str, Any] = {"default": None, "help": told + _UNITS.get(_unit(spec), "")}
    if option.flag.startswith("-"):
        place = [option.flag]
        how |= {"dest": option.key, "required": spec.identifier in command.needs}
    else:
        place = [option.key]
        how["metavar"] = option.word.upper()
    size = getattr(spec, "array_length", 0)
    names = option.word.split()[1:]
    if spec.type == "BOOLEAN":
        on = command.unsaid.get(spec.identifier, spec.default)
        both = on or (option.group and not command.anew)
        how["action"] = argparse.BooleanOptionalAction if both else "store_true"
        return place, how
    if spec.type == "ENUM":
        how["choices"] = list(_choices(spec))
        if "metavar" in how:
            how["help"] += f": one of {', '.join(how['choices'])}"
    else:
        how["type"] = {"INT": int, "FLOAT": float}.get(spec.type, str)
        how.setdefault("metavar", {"INT": "N", "FLOAT": "X"}.get(spec.type, _what(spec)))
    if len(names) == 1:
        how["metavar"] = names[0]
    if len(names) == count > 1:
        how |= {"nargs": count, "metavar": tuple(names)}
    elif count > 1:
        how["type"] = str
    elif size:
        how |= {"nargs": size, "metavar": tuple("XYZW"[:size])}
    elif spec.type == "COLLECTION" or spec.identifier in command.repeated:
        how |= {"action": "append"} if option.flag.startswith("-") else {"nargs": "+"}
    return place, how


def _what(spec: Any) -> str:
    if spec.identifier.endswith("frames"):
        return "A:B[:STEP]"
    return "PATH" if getattr(spec, "subtype", "") in ("FILE_PATH", "DIR_PATH") else "NAME"


def _unit(spec: Any) -> str:
    return getattr(spec, "unit", "NONE")


def _choices(spec: Any) -> dict[str, str]:
    """Identifiers of an enum by the words of the command line."""
    names = [item.identifier for item in spec.enum_items]
    if all(name.isupper() for name in names):
        return {name.lower().replace("_", "-"): name for name in names}
    return {name: name for name in names}


def _run(command: Command, kind: type | None, options: argparse.Namespace, out: TextIO) -> str:
    """Sets what was said, calls the operator and saves; returns what was done."""
    given, keys = vars(options), {}
    if command.frame and options.frame is not None:
        bpy.context.scene.frame_set(options.frame)
    own = {spec.identifier for spec in operator_properties(kind)}
    values = {name: value for name, value in command.unsaid.items() if name in own}
    for option in options_of(command, kind):
        said, keys[option.flag] = _said(option, given[option.key]), option.key
        if option.group:
            _set(option, said, command)
        else:
            values |= said
    for flag in command.means:
        if given[keys.get(flag, flag.removeprefix("--"))] not in (None, False):
            values |= _meant(command, flag)
    if command.prepare:
        command.prepare(values)
    told = _call(command, kind, options, values, out)
    if command.saves:
        save_copy(options.saved)
        told += ("\n" if "\n" in told else "; ") + f"wrote {options.saved}"
    return told


def _meant(command: Command, flag: str) -> dict[str, Any]:
    """Sets the settings that a flag means besides; returns properties of the operator."""
    groups = {name: group for group, names in command.reads.items() for name in names}
    values = {}
    for name, value in command.means[flag].items():
        if name in groups:
            setattr(_settings(groups[name]), name, value)
        else:
            values[name] = value
    return values


def _call(
    command: Command,
    kind: type | None,
    options: argparse.Namespace,
    values: dict[str, Any],
    out: TextIO,
) -> str:
    """Does the work; returns what was done."""
    given = vars(options)
    others = [name for flag, name in command.instead.items() if given[flag.removeprefix("--")]]
    if others:
        return call(others[0], out)
    if command.work:
        return command.work(options)
    return call(kind.bl_idname.removeprefix("rfgs."), out, **values)


def _set(option: Option, said: dict[str, Any], command: Command) -> None:
    """Sets settings, or puts those that were not given back to a new file's."""
    settings = _settings(option.group)
    for spec in option.specs:
        name = spec.identifier
        if name in said:
            setattr(settings, name, said[name])
        elif name in command.unsaid:
            setattr(settings, name, command.unsaid[name])
        elif command.anew:
            settings.property_unset(name)


def _said(option: Option, value: Any) -> dict[str, Any]:
    """Values of the properties of an option, as Blender wants them.

    Raises:
        AddonError: One is out of range, which Blender would cut off silently.
    """
    if value is None:
        # What is a length by default is so in metres, whatever the scene's unit is.
        spec = option.specs[0]
        if _unit(spec) != "LENGTH" or not any(spec.default_array):
            return {}
        value = list(spec.default_array)
    values = [value]
    if len(option.specs) > 1:
        values = value if isinstance(value, list) else _split(option, value)
    rows = zip(option.specs, values, strict=True)
    return {spec.identifier: _value(option, spec, value) for spec, value in rows}


def _split(option: Option, text: str) -> list[int]:
    """Numbers of one word.

    Raises:
        AddonError: It is something else.
    """
    parts = text.split("x")
    if len(parts) != len(option.specs) or not all(part.isdecimal() for part in parts):
        expected = option.word.split()[1]
        raise AddonError(f"{option.flag}: expected {expected}, as 8x8, got {text!r}")
    return [int(part) for part in parts]


def _number(option: Option, spec: Any, value: Any) -> Any:
    for number in value if isinstance(value, list) else [value]:
        if not spec.hard_min <= number <= spec.hard_max:
            limits = f"{spec.hard_min:g} to {spec.hard_max:g}"
            raise AddonError(f"{option.flag} {number:g}: expected {limits}")
    if _unit(spec) == "ROTATION":
        return [math.radians(number) for number in value]
    if _unit(spec) == "LENGTH":
        return [number / unit_scale(bpy.context.scene) for number in value]
    return value


def _value(option: Option, spec: Any, value: Any) -> Any:
    if spec.type in ("INT", "FLOAT"):
        return _number(option, spec, value)
    if spec.type == "ENUM":
        return _choices(spec)[value]
    if spec.type == "COLLECTION":
        return [{"name": name} for name in value]
    if spec.type == "POINTER":
        return named(bpy.context.scene.objects, value, "object")
    if isinstance(value, list) and spec.type == "STRING":
        return ",".join(value)
    if _what(spec) == "PATH" and value and not value.startswith("//"):
        return os.path.abspath(value)
    return value
