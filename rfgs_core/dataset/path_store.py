# SPDX-License-Identifier: Apache-2.0
"""Path tables on disk: one `.npz` file per frame, which NumPy alone can read."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

from rfgs_core.arrays import load_arrays
from rfgs_core.dataset.writer import write_arrays
from rfgs_core.errors import RfgsFormatError
from rfgs_core.radio.path_table import PathTable

_REMEDY = "the paths of this dataset are missing or damaged, make them with generate --paths"
_SHAPES: dict[str, tuple[str | int, ...]] = {
    **dict.fromkeys(("tx_site", "rx_site", "tx_device", "rx_device"), ("path",)),
    **dict.fromkeys(("delay_s", "doppler_hz"), ("path",)),
    **dict.fromkeys(("departure_zenith_rad", "departure_azimuth_rad"), ("path",)),
    **dict.fromkeys(("arrival_zenith_rad", "arrival_azimuth_rad"), ("path",)),
    "amplitude": ("path", "port", "node"),
    "node_hz": ("node",),
    "kind": ("path", "bounce"),
    "object": ("path", "bounce"),
    "vertices": ("path", "corner", 3),
}
_TYPES = {"delay_s": "f8", "node_hz": "f8", "amplitude": "c8", "kind": "u1"}
_TYPES |= dict.fromkeys(("tx_site", "rx_site", "tx_device", "rx_device", "object"), "i4")


def write_paths(path: Path, table: PathTable) -> None:
    """Writes a table in one step; equal tables give equal bytes."""
    write_arrays(path, **{spec.name: getattr(table, spec.name) for spec in fields(table)})


def read_paths(path: Path) -> PathTable:
    """Reads a table.

    Raises:
        RfgsError: There is no such file.
        RfgsFormatError: It is damaged, or an array has another shape or type.
    """
    types = {name: _TYPES.get(name, "f4") for name in _SHAPES}
    arrays = load_arrays(path, _REMEDY, _SHAPES, types=types, seal=False)
    if arrays["vertices"].shape[1] != arrays["kind"].shape[1] + 2:
        raise RfgsFormatError(f"{path}: vertices: expected two more than bounces")
    return PathTable(**arrays)
