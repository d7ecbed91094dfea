# SPDX-License-Identifier: Apache-2.0
"""`rfgs-factory radios`."""

from __future__ import annotations

import sys
from dataclasses import dataclass

import tyro


@dataclass(frozen=True)
class RadiosArgs:
    """Lists the radio presets, or prints one as a file to start one's own from.

    rfgs-factory radios wifi > my_radio.yaml; change its name and fields; then
    rfgs-factory generate … --radio my_radio.yaml
    """

    name: tyro.conf.Positional[str] = ""
    """Preset to print as YAML; default: a table of all."""


def run(args: RadiosArgs) -> int:
    """Prints a table of presets or one of them as YAML."""
    from rfgs_core.radio import PRESETS, preset
    from rfgs_core.radio.files import radio_text
    from rfgs_core.sync import describe

    if args.name:
        sys.stdout.write(radio_text(preset(args.name)))
        return 0
    for radio in PRESETS.values():
        sys.stdout.write(
            f"{radio.name:<15} {describe(radio)}; {radio.num_devices} devices, {radio.placement}\n"
        )
    return 0
