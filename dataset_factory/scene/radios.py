# SPDX-License-Identifier: Apache-2.0
"""What `--radio` names: a preset, a file, or the radio that the scene's Empties describe."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from dataset_factory.scene.bundle import Bundle
from rfgs_core.errors import RfgsError
from rfgs_core.radio import PRESETS, Radio, preset
from rfgs_core.radio.check import material_problems, too_deep
from rfgs_core.radio.files import SUFFIXES, checked_radio, read_radio

#: The radio whose every property stands in the scene.
SCENE_RADIO = "scene"


def chosen_radios(names: tuple[str, ...]) -> dict[str, Radio]:
    """The radios that `--radio` names, by their own names.

    The scene's radio is not known before the scene is; until `scene_radio` replaces it, the
    Wi-Fi preset holds its place.

    Raises:
        RfgsError: A name is unknown, a file is unusable, or two radios have one name.
    """
    radios: dict[str, Radio] = {}
    for name in names:
        if name == SCENE_RADIO:
            radio = replace(preset("wifi"), name=SCENE_RADIO)
        elif name in PRESETS:
            radio = preset(name)
        elif Path(name).suffix.lower() in SUFFIXES:
            radio = read_radio(Path(name))
        else:
            raise RfgsError(
                f"unknown radio {name!r}; expected one of {', '.join(PRESETS)}, a file like "
                f"my_radio.yaml, or {SCENE_RADIO!r} for the one the scene's Empties describe"
            )
        if radio.name in radios:
            raise RfgsError(f"a radio is named twice: {radio.name}")
        if radio.name == SCENE_RADIO and name != SCENE_RADIO:
            raise RfgsError(f"{name}: name: {SCENE_RADIO!r} is kept for the scene's own radio")
        radios[radio.name] = radio
    return radios


def scene_radio(bundle: Bundle) -> Radio:
    """The radio that the scene's Empties describe, all of them alike.

    Raises:
        RfgsError: No Empty is a device of it, two differ, or a property is impossible.
    """
    rows = [
        row
        for row in bundle.devices
        if row["role"] != "NONE" and row["radio"] in ("any", SCENE_RADIO)
    ]
    if not rows:
        raise RfgsError(
            f"{bundle.info['blend_name']}: --radio {SCENE_RADIO}: no Empty has a role in the "
            f"radio {SCENE_RADIO!r} or 'any'; add Empties and set their radio properties"
        )
    if "rf" not in rows[0]:
        raise RfgsError(
            f"{bundle.info['blend_name']}: --radio {SCENE_RADIO}: devices of the scene's "
            "configuration hold no radio properties; describe the radio in a file and name that"
        )
    first: dict[str, Any] = rows[0]["rf"]
    for row in rows[1:]:
        for name, value in first.items():
            if row.get("rf", {}).get(name) != value:
                raise RfgsError(
                    f"{bundle.info['blend_name']}: --radio {SCENE_RADIO}: {name} is {value!r} at "
                    f"{rows[0]['name']!r} but {row.get('rf', {}).get(name)!r} at {row['name']!r}; "
                    "all devices of one radio are alike"
                )
    values = {**asdict(preset("wifi")), **first, "name": SCENE_RADIO, "num_devices": len(rows)}
    return checked_radio(f"{bundle.info['blend_name']}: Empty {rows[0]['name']!r}", values)


def refuse_trace(bundle: Bundle, radio: Radio, depth: int) -> None:
    """Refuses what no tracer can do with a radio in a scene.

    Args:
        bundle: The scene.
        radio: The radio.
        depth: Interactions of people's paths.

    Raises:
        RfgsError: The depth is not 1, 2 or 3, or more than the radio can have, or a material does
            not hold in the radio's band.
    """
    if depth not in (1, 2, 3):
        raise RfgsError(f"trace depth {depth}: expected 1, 2 or 3")
    if depth > radio.deepest:
        raise RfgsError(too_deep(radio, depth))
    for problem in material_problems(radio, bundle.materials):
        raise RfgsError(f"{bundle.path}: {problem}")
