# SPDX-License-Identifier: Apache-2.0
"""DeepMIMO version 4: one scenario folder per radio, one scene per frame.

Transmitting sites are the base stations of TX set 0, receiving sites the users of RX set 1. A
matrix file holds users × paths, strongest first, NaN where there is none: power [dB] and phase
[°] at the carrier, delay [s], angles [°] (zenith as `el`, azimuth, world axes), interactions as
decimal digits from the transmitter on, and their places [m]. Of several polarisation ports the
first pair is written; a user without a measured link has no paths.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from rfgs_core.dataset import Sequence
from rfgs_core.dataset.writer import write_arrays
from rfgs_core.files import write_json
from rfgs_core.radio import Layout, Radio
from rfgs_core.radio.images import DIFFRACTION, DIFFUSE, REFRACTION, SCATTERING, SPECULAR
from rfgs_core.radio.levels import amplitude_decibels
from rfgs_core.radio.path_table import PathTable

#: Version of the format.
VERSION = "4.0.5"
#: DeepMIMO's digit of each interaction.
_DIGITS = {SPECULAR: 1, DIFFRACTION: 2, DIFFUSE: 3, SCATTERING: 3, REFRACTION: 4}


def write(sequence: Sequence, out: Path) -> None:
    """Writes `RADIO/params.json` and the matrices, in folders by frame if there are several."""
    for radio in sequence.radios:
        layout, spec = sequence.layout(radio), sequence.radio_spec(radio)
        write_json(out / radio / "params.json", _parameters(sequence, layout, spec))
        for frame in tqdm(sequence.frames, desc=radio, unit="frame"):
            single = len(sequence.frames) == 1
            folder = out / radio if single else out / radio / f"scene_{frame:06d}"
            _write_scene(sequence.paths(radio, frame), layout, spec, folder)


def _write_scene(table: PathTable, layout: Layout, spec: Radio, folder: Path) -> None:
    tx_places, rx_places = (
        np.stack([xyz[site == i].mean(axis=0) for i in range(site.max() + 1)])
        for xyz, site in ((layout.tx_xyz, layout.tx_site), (layout.rx_xyz, layout.rx_site))
    )
    write_arrays(folder / "vertices.npz", vertices=np.zeros((0, 3), np.float32))
    write_json(folder / "objects.json", [])
    for tx, place in enumerate(tx_places):
        rows = table.select(table.tx_site == tx)
        values = {**matrices(rows, len(rx_places), spec.centre_hz), "rx_pos": rx_places}
        for name, value in {**values, "tx_pos": place[None]}.items():
            file = folder / f"{name}_t000_tx{tx:03d}_r001.npz"
            write_arrays(file, **{name: value.astype(np.float32)})


def matrices(rows: PathTable, users: int, carrier_hz: float) -> dict[str, np.ndarray]:
    """DeepMIMO's matrices of one transmitter.

    Args:
        rows: Its paths.
        users: Receiving sites.
        carrier_hz: Frequency of power and phase [Hz].

    Returns:
        By name, each of shape (user, path, …).
    """
    gain = rows.amplitude_at(np.array([carrier_hz]))[:, 0, 0]
    order = np.lexsort((-np.abs(gain), rows.rx_site))
    rows, gain = rows.select(order), gain[order]
    rows, gain = rows.select(np.abs(gain) > 0.0), gain[np.abs(gain) > 0.0]
    count = np.bincount(rows.rx_site, minlength=users)
    rank = np.arange(len(rows)) - (np.cumsum(count) - count)[rows.rx_site]
    phase = gain * np.exp(-2j * np.pi * carrier_hz * rows.delay_s)
    corners = np.where((rows.kind != 0)[..., None], rows.vertices[:, 1:-1], np.nan)
    columns = {
        "power": amplitude_decibels(np.abs(gain), least=0.0),
        "phase": np.angle(phase, deg=True),
        "delay": rows.delay_s,
        "aoa_az": np.rad2deg(rows.arrival_azimuth_rad),
        "aoa_el": np.rad2deg(rows.arrival_zenith_rad),
        "aod_az": np.rad2deg(rows.departure_azimuth_rad),
        "aod_el": np.rad2deg(rows.departure_zenith_rad),
        "inter": interactions(rows.kind),
        "inter_pos": corners,
    }
    found = {}
    for name, column in columns.items():
        found[name] = np.full((users, max(int(count.max(initial=0)), 1), *column.shape[1:]), np.nan)
        found[name][rows.rx_site, rank] = column
    return found


def interactions(kind: np.ndarray) -> np.ndarray:
    """Interactions of each path as decimal digits, the transmitter's first; 0 is line of sight."""
    code = np.zeros(len(kind))
    for column in kind.T:
        digit = sum((column == known) * value for known, value in _DIGITS.items())
        code = np.where(column != 0, 10 * code + digit, code)
    return code


def _parameters(sequence: Sequence, layout: Layout, spec: Radio) -> dict[str, Any]:
    depth = max(3, sequence.trace_depth(spec.name))
    common = {"num_ant": 1, "dual_pol": False, "ant_rel_positions": [[0, 0, 0]]}
    common |= {"array_orientation": [0, 0, 0], "grid_spacing": None}
    sets = {}
    for number, (name, site) in enumerate((("tx", layout.tx_site), ("rx", layout.rx_site))):
        points = int(site.max()) + 1
        role = {"is_tx": name == "tx", "is_rx": name == "rx", "id": number, "id_orig": number}
        size = {"num_points": points, "num_active_points": points}
        sets[f"txrx_set_{number}"] = {"name": f"{spec.name}_{name}", **role, **size, **common}
    return {
        "version": VERSION,
        "rt_params": {
            "raytracer_name": "Sionna Ray Tracing",
            "raytracer_version": "2.2.0",
            "frequency": spec.centre_hz,
            "max_path_depth": depth,
            "max_reflections": depth,
            "max_diffractions": 0,
            "max_scattering": 1,
            "max_transmissions": depth,
            "synthetic_array": True,
            "gps_bbox": [0, 0, 0, 0],
            "raw_params": {},
        },
        "txrx_sets": sets,
        "materials": {},
        "scene": {
            "num_scenes": len(sequence.frames),
            "n_objects": 0,
            "n_vertices": 0,
            "n_faces": 0,
            "n_triangular_faces": 0,
        },
    }
