# SPDX-License-Identifier: GPL-3.0-or-later
"""Which of the scene's devices take part in the radios that are to be traced."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import bpy

from ..tables import RADIO_PLACEMENTS, RADIOS
from .findings import Finding

#: Radio whose every property stands at the Empties, and those that take part in any radio.
OWN, ANY = "scene", "any"
#: What is traced where nobody says and no device does.
_USUAL = "wifi"


def wanted_radios(scene: bpy.types.Scene) -> list[str]:
    """Radios that a dataset of this scene is made with: the panel's, else those of its devices.

    Devices of the radio `scene` are somebody's own: they are meant where nothing else is said.
    Where no device takes part in the usual radio, the presets that devices name are meant.
    """
    said = [name.strip() for name in scene.rfgs.jobs.radios.split(",") if name.strip()]
    if said:
        return said
    found = {radio_of(item) for item in scene.objects if item.rfgs.role != "NONE"}
    if OWN in found:
        return [OWN]
    named = [name for name in RADIOS if name in found]
    return [_USUAL] if found & {_USUAL, ANY} or not named else named


def radio_of(item: bpy.types.Object) -> str:
    """Name of the radio that a device belongs to."""
    return item.rfgs.radio.strip() or ANY


def left_out(devices: Iterable[tuple[str, str]], radios: list[str]) -> dict[str, list[str]]:
    """Devices that take part in none of some radios.

    Args:
        devices: Name and radio of each.
        radios: Presets, `scene`, or files of radios.

    Returns:
        Names of the devices by their radio. Those of a radio that only a file can describe may
        take part where a file is named.
    """
    of_file = [name for name in radios if name not in RADIOS and name != OWN]
    takes_any = any(
        name not in RADIO_PLACEMENTS or RADIO_PLACEMENTS[name]["placement"] == "corners"
        for name in radios
    )
    found: dict[str, list[str]] = {}
    for device, radio in devices:
        described = radio in RADIOS or radio in (OWN, ANY)
        takes_part = takes_any if radio == ANY else radio in radios
        if not takes_part and (described or not of_file):
            found.setdefault(radio, []).append(device)
    return found


def left_out_findings(scene: bpy.types.Scene, devices: list[dict[str, Any]]) -> list[Finding]:
    """Names devices of the scene that its dataset would do without.

    Args:
        scene: The scene.
        devices: Rows of `cameras.find_devices`.
    """
    radios = wanted_radios(scene)
    asked = ", ".join(radios)
    findings = []
    for radio, names in left_out([(row["name"], row["radio"]) for row in devices], radios).items():
        remedy = f"add {radio!r} to the radios, or give it another radio"
        if radio == ANY:
            remedy = f"give it one of these radios by name: {asked} stands in no corners"
        for name in names:
            message = f"is a device of radio {radio!r}, left out of a dataset with {asked}"
            findings.append(Finding("warning", name, message, remedy, "device_left_out"))
    return findings


def silence_findings(devices: list[dict[str, Any]]) -> list[Finding]:
    """Says when devices of somebody's own cannot make a channel: nobody sends, or nobody hears."""
    meant = [row for row in devices if row["radio"] in (OWN, ANY)]
    if not any(row["radio"] == OWN for row in meant):
        return []
    for other, verb, what in (
        ("RECEIVER", "transmits", "transmitter (TX)"),
        ("TRANSMITTER", "receives", "receiver (RX)"),
    ):
        if all(row["role"] == other for row in meant):
            message = f"no device of radio {OWN!r} {verb}"
            return [
                Finding(
                    "warning",
                    "the scene",
                    message,
                    f"add a {what}, or an access point",
                    "devices_silent",
                )
            ]
    return []
