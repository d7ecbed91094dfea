# SPDX-License-Identifier: Apache-2.0
"""Radios of one's own: a JSON or YAML file with the fields of `Radio`."""

from __future__ import annotations

import re
from dataclasses import MISSING, Field, asdict, fields
from pathlib import Path
from typing import Any

import yaml

from rfgs_core.errors import RfgsError
from rfgs_core.files import read_json
from rfgs_core.radio.antennas import PATTERNS, POLARIZATIONS
from rfgs_core.radio.layout import NEAREST_ANTENNAS_M, DevicePose, layout, nearest_m
from rfgs_core.radio.presets import PRESETS, Radio, preset
from rfgs_core.records import record
from rfgs_core.yaml_file import read_yaml

SUFFIXES = (".json", ".yaml", ".yml")
#: Elements per device beyond which something else was meant.
MOST_ELEMENTS = 4096
MOST_DEVICES = 1024
#: The same of subcarriers, and of samples per frame.
MOST_SAMPLES = 2**20

_NAME = re.compile(r"[A-Za-z0-9_-]+")


def read_radio(path: Path) -> Radio:
    """Reads a radio from a file; see docs/radios.md.

    Fields are those of `Radio`. `like: NAME` takes everything that is not given from a preset;
    without it, only fields with a default may be left out. `name` defaults to the file's.

    Raises:
        RfgsError: The file is missing, no mapping, or a field is unknown, missing, of another
            type or impossible; one line names the file and the field.
    """
    given = _mapping(path)
    base: dict[str, Any] = {}
    like = given.pop("like", None)
    if like is not None:
        if not isinstance(like, str) or like not in PRESETS:
            raise RfgsError(f"{path}: like: expected one of {', '.join(PRESETS)}, got {like!r}")
        base = asdict(preset(like))
    given.setdefault("name", path.stem)
    return checked_radio(str(path), {**base, **given})


def checked_radio(source: str, values: dict[str, Any]) -> Radio:
    """Builds a radio and refuses impossible ones.

    Args:
        source: Where the values come from, for the message.
        values: Fields of `Radio`.

    Raises:
        RfgsError: A field is unknown, missing, of another type or impossible.
    """
    known = {spec.name: spec for spec in fields(Radio)}
    unknown = sorted(map(str, set(values) - set(known)))
    if unknown:
        raise RfgsError(
            f"{source}: unknown field {unknown[0]!r}; expected some of {', '.join(known)}"
        )
    missing = [name for name, spec in known.items() if name not in values and _needed(spec)]
    if missing:
        raise RfgsError(f"{source}: field {missing[0]!r} is missing; give it, or `like: PRESET`")
    # YAML takes 60e9, without a point, for text.
    radio: Radio = record(source, values, Radio, lax=True)
    if radio.name in PRESETS and radio != preset(radio.name):
        raise RfgsError(f"{source}: name: {radio.name!r} is a preset's name; choose another")
    for problem in radio_problems(radio):
        raise RfgsError(f"{source}: {problem}")
    return radio


def radio_text(radio: Radio) -> str:
    """A radio as YAML that `read_radio` takes."""
    return yaml.safe_dump(radio_values(radio), sort_keys=False, default_flow_style=None)


def radio_values(radio: Radio) -> dict[str, Any]:
    """All fields of a radio in JSON's types, so that they equal what is read back."""
    values = asdict(radio)
    return {name: list(row) if isinstance(row, tuple) else row for name, row in values.items()}


def radio_problems(radio: Radio) -> list[str]:
    """What keeps a radio from being one, each as `field: why`."""
    problems = []
    if not _NAME.fullmatch(radio.name):
        problems.append(f"name: {radio.name!r}: expected letters, digits, '_' and '-'")
    if not 1e7 <= radio.freq_min_hz < radio.freq_max_hz <= 100e9:
        problems.append(
            f"freq_min_hz, freq_max_hz: {radio.freq_min_hz:g} to {radio.freq_max_hz:g} Hz: "
            "expected an ascending band within 10 MHz to 100 GHz"
        )
    lowest = {"num_subcarriers": 2, "num_devices": 1, "samples_per_frame": 1}
    lowest |= {f"{end}_{way}": 1 for end in ("tx", "rx") for way in ("rows", "cols")}
    lowest |= dict.fromkeys(
        ("tx_spacing_m", "rx_spacing_m", "isolation_db", "inset_m", "sample_interval_s"), 0
    )
    for name, low in lowest.items():
        if getattr(radio, name) < low:
            problems.append(f"{name}: {getattr(radio, name):g}: expected at least {low}")
    if not radio.heights_m:
        problems.append("heights_m: expected at least one height")
    for name, table in (("pattern", PATTERNS), ("polarization", POLARIZATIONS)):
        if getattr(radio, name) not in table:
            problems.append(f"{name}: {getattr(radio, name)!r}: expected {' or '.join(table)}")
    if radio.antennas_move:
        problems += _aperture_problems(radio)
    return problems or _antenna_problems(radio)


def _aperture_problems(radio: Radio) -> list[str]:
    """Problems of a device that moves."""
    problems = []
    if radio.own_device_links != "only":
        problems.append(
            f"own_device_links: {radio.own_device_links}: expected only, as a device that moves "
            "(antennas_move) hears nothing but itself"
        )
    if radio.num_devices != 1:
        problems.append(
            f"num_devices: {radio.num_devices}: expected 1 that moves (antennas_move); its places "
            "are samples_per_frame"
        )
    if radio.sample_interval_s:
        problems.append(
            f"sample_interval_s: {radio.sample_interval_s:g}: expected 0, as the scene stands "
            "still while antennas move (antennas_move)"
        )
    return problems


def _antenna_problems(radio: Radio) -> list[str]:
    """Problems of arrays whose fields are fine one by one."""
    most = {"num_devices": MOST_DEVICES, "num_subcarriers": MOST_SAMPLES}
    most["samples_per_frame"] = MOST_SAMPLES
    for name, limit in most.items():
        if getattr(radio, name) > limit:
            return [f"{name}: {getattr(radio, name)}: expected at most {limit}"]
    if max(radio.tx_rows * radio.tx_cols, radio.rx_rows * radio.rx_cols) > MOST_ELEMENTS:
        return [f"tx_rows … rx_cols: more than {MOST_ELEMENTS} elements in one array"]
    if radio.own_device_links == "excluded":
        few = radio.num_devices < 2
        return ["own_device_links: excluded leaves a single device no link"] if few else []
    alone = layout(radio, [DevicePose("", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))])
    if nearest_m(alone.tx_xyz, alone.rx_xyz) < NEAREST_ANTENNAS_M:
        return [
            "tx_offset_m: a transmitting element stands in a receiving one; move it, or set "
            "own_device_links to excluded"
        ]
    return []


def _mapping(path: Path) -> dict[str, Any]:
    """The mapping a file holds."""
    if path.suffix.lower() not in SUFFIXES:
        raise RfgsError(f"{path}: expected a radio in a file ending in {', '.join(SUFFIXES)}")
    value = read_json(path) if path.suffix.lower() == ".json" else read_yaml(path)
    return record(path, value, dict[str, Any])


def _needed(spec: Field) -> bool:
    return spec.default is MISSING and spec.default_factory is MISSING
