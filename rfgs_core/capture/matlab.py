# SPDX-License-Identifier: Apache-2.0
"""MATLAB captures, `.mat`: CSI tables of the NeWRF kind and X-band phase history of AFRL.

NeWRF (Lu et al. 2024) keeps an array of structures with `TxPos` and `RxPos` [m], `Frequency`
[GHz] and `CSI`, one complex number for each place of the receiver. AFRL's GOTCHA sets (Casteel et
al. 2007) keep `data` with `fp` (frequency, pulse), `freq` [Hz] and the antenna's place `x, y, z`
[m] at each pulse, `r0` its distance to the scene's centre: fp is referred to that distance, so
that the centre has phase zero, and `af` holds an autofocus correction that is not applied.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rfgs_core.capture.file_bytes import refuse_too_many
from rfgs_core.capture.model import Capture, Reading, reading
from rfgs_core.capture.table_file import read_tables
from rfgs_core.errors import RfgsFormatError

NAME = "matlab"
TITLE = "MATLAB: CSI tables (NeWRF), phase history (AFRL)"
SUFFIXES = (".mat",)

_TABLE = ("TxPos", "RxPos", "Frequency", "CSI")
_HISTORY = ("fp", "freq", "x", "y", "z", "r0")


def looks_like(head: bytes, path: Path) -> bool:
    """Whether a file is one of MATLAB's, version 5 to 7.2."""
    return head.startswith(b"MATLAB 5.0 MAT-file") and path.suffix.lower() in SUFFIXES


def read(path: Path) -> Reading:
    """Reads either kind.

    Returns:
        Of a CSI table (receiver, 1, 1, 1, 1) with a place of transmitter and receiver for each;
        of a phase history (pulse, 1, 1, 1, frequency) with the antenna's place as both. Neither
        tells times: they count packets, and `info["untimed"]` is true.

    Raises:
        RfgsError: The file cannot be read.
        RfgsFormatError: It is damaged, too large, or neither kind.
    """
    tables = read_tables(path, "mat")
    for name in sorted({key.rpartition(".")[0] for key in tables}):
        if all(f"{name}.{field}" in tables for field in _TABLE):
            return _csi_table(path, {f: tables[f"{name}.{f}"] for f in _TABLE})
        if all(f"{name}.{field}" in tables for field in _HISTORY):
            fields = {key: tables[f"{name}.{key}"] for key in _HISTORY}
            for part in ("r_correct", "ph_correct"):
                if f"{name}.af.{part}" in tables:
                    fields[part] = tables[f"{name}.af.{part}"]
            return _phase_history(path, fields)
    found = ", ".join(sorted(tables)) or "nothing that is an array of numbers"
    raise RfgsFormatError(
        f"{path}: expected {', '.join(_TABLE)} or {', '.join(_HISTORY)}, found {found[:200]}"
    )


def _csi_table(path: Path, fields: dict[str, np.ndarray]) -> Reading:
    csi = fields["CSI"].reshape(len(fields["CSI"]), -1)
    count = len(csi)
    places = [fields[name].reshape(len(fields[name]), -1) for name in ("TxPos", "RxPos")]
    each_hz = fields["Frequency"].astype(np.float64) * 1e9
    freq_hz = np.unique(each_hz[np.isfinite(each_hz)])
    shaped = all(place.shape == (count, 3) for place in places) and csi.shape[1] == 1
    if not shaped or len(freq_hz) != 1 or not 1e7 <= freq_hz[0] <= 1e12:
        raise RfgsFormatError(
            f"{path}: expected one channel, place and frequency [GHz] for each receiver, found "
            f"CSI {fields['CSI'].shape}, RxPos {fields['RxPos'].shape}, {len(freq_hz)} frequencies"
        )
    tx_xyz, rx_xyz = (place.astype(np.float64) for place in places)
    whole = np.isfinite(csi).all(axis=1) & np.isfinite(tx_xyz + rx_xyz).all(axis=1)
    capture = Capture(
        source=NAME,
        values=csi.astype(np.complex64)[:, None, None, None],
        valid=np.ones((count, 1, 1, 1, 1), bool),
        time_s=np.arange(count, dtype=np.float64),
        axis="subcarrier",
        bins=np.zeros(1),
        index=np.zeros(1, np.int64),
        centre_hz=float(freq_hz[0]),
        info={"untimed": True, "kind": "table of receivers"},
        tx_xyz=tx_xyz,
        rx_xyz=rx_xyz,
    )
    damage = {"receivers that are empty or not finite": int((~whole).sum())}
    return reading(path, NAME, [capture.select(whole)], damage)


def _phase_history(path: Path, fields: dict[str, np.ndarray]) -> Reading:
    history = fields["fp"]
    freq_hz = fields["freq"].astype(np.float64).ravel()
    places = np.stack([fields[axis].astype(np.float64).ravel() for axis in "xyz"], axis=-1)
    bins, pulses = history.shape if history.ndim == 2 else (0, 0)
    fits = freq_hz.shape == (bins,) and places.shape == (pulses, 3) and bins * pulses > 0
    sound = fits and np.isfinite(freq_hz).all() and (np.diff(freq_hz) > 0).all()
    if not sound or freq_hz[0] <= 0 or fields["r0"].size != pulses:
        raise RfgsFormatError(
            f"{path}: expected fp (frequency, pulse), ascending freq and one place for each pulse, "
            f"found fp {history.shape}, freq {freq_hz.shape}, places {places.shape}"
        )
    refuse_too_many(path, history.size)
    whole = np.isfinite(history).all(axis=0) & np.isfinite(places).all(axis=1)
    centre_hz = float(freq_hz.mean())
    packets = {"centre_distance_m": fields["r0"].astype(np.float64).ravel()}
    for source, name in (("r_correct", "autofocus_m"), ("ph_correct", "autofocus_rad")):
        if fields.get(source, np.zeros(0)).size == pulses:
            packets[name] = fields[source].astype(np.float64).ravel()
    capture = Capture(
        source=NAME,
        values=history.T.astype(np.complex64)[:, None, None, None],
        valid=np.ones((pulses, 1, 1, 1, bins), bool),
        time_s=np.arange(pulses, dtype=np.float64),
        axis="subcarrier",
        bins=freq_hz - centre_hz,
        index=np.arange(bins),
        centre_hz=centre_hz,
        packets=packets,
        info={"untimed": True, "kind": "phase history"},
        tx_xyz=places,
        rx_xyz=places,
    )
    damage = {"pulses with numbers that are not finite": int((~whole).sum())}
    return reading(path, NAME, [capture.select(whole)], damage)
