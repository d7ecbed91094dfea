# SPDX-License-Identifier: Apache-2.0
"""A prediction as named arrays for a file, units beside them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rfgs_core.arrays import save_arrays
from rfgs_core.predict.echoes import Echoes, Reflectors
from rfgs_core.predict.prediction import Prediction
from rfgs_core.predict.spectra import arrival_power, beam_power, profile_over_delay, sky_cells

#: What a prediction holds and what it does not; printed and stored with every one.
NOTE = (
    "person's scattering + shadowed free-space direct path (isotropic antennas); reflections from "
    "walls are known along recorded links only and are not predicted"
)

#: The same where a static set stands in for the walls.
ROOM_NOTE = (
    "person's scattering + shadowed free-space direct path (isotropic antennas) + what the static "
    "Gaussians scatter, which explain the empty room along recorded links and guess it elsewhere"
)

#: Array → unit and axes.
UNITS: dict[str, tuple[str, str]] = {
    "tx_xyz": ("m", "xyz"),
    "rx_xyz": ("m", "rx, xyz"),
    "element_xyz": ("m", "rx, element, xyz"),
    "freq_hz": ("Hz", "subcarrier"),
    "csi": ("1", "rx, element, subcarrier: csi_scatter + csi_direct, + csi_room if there is one"),
    "csi_room": ("1", "rx, element, subcarrier: what the static Gaussians scatter"),
    "csi_scatter": ("1", "rx, element, subcarrier: what the Gaussians scatter"),
    "csi_direct": ("1", "rx, element, subcarrier: straight way with the person's shadow"),
    "csi_free": ("1", "rx, element, subcarrier: straight way without a person"),
    "delay_s": ("s", "delay"),
    "profile": ("1", "rx, delay: amplitude of csi over delay, RMS over elements"),
    "profile_scatter": ("1", "rx, delay: amplitude of csi_scatter over delay, RMS over elements"),
    "azimuth_deg": ("degree", "azimuth: centres of cells, from +x towards +y"),
    "elevation_deg": ("degree", "elevation: centres of cells, above the horizon"),
    "arrival_power": ("1", "rx, elevation, azimuth: scattered power by direction of arrival"),
    "beam_power": ("1", "rx, elevation, azimuth: csi_scatter through the array's beams"),
    "gaussian_xyz": ("m", "gaussian, xyz"),
    "gaussian_power": ("1", "rx, gaussian: received over transmitted power of its echo"),
    "gaussian_delay_s": ("s", "rx, gaussian"),
    "gaussian_rcs_m2": ("m2", "gaussian: |gamma|^2, mean over the band"),
    "gaussian_phase_rad": ("rad", "gaussian: phase of gamma at the band's centre"),
    "gaussian_slope": ("1", "gaussian: d ln|gamma|^2 / d ln f, NaN where gamma is one value"),
}


def prediction_arrays(
    prediction: Prediction,
    boresight_rad: list[float],
    gaussian_xyz: np.ndarray,
    echoes: Echoes,
    own: Reflectors,
) -> dict[str, np.ndarray]:
    """Everything that was predicted, named as in `UNITS`.

    Args:
        prediction: Channels.
        boresight_rad: Azimuth of each array's boresight; empty for single antennas.
        gaussian_xyz: Centres of the Gaussians [m].
        echoes: Their echoes at the receivers.
        own: What they reflect by themselves.
    """
    profiles = {}
    for name, csi in (("profile", prediction.csi), ("profile_scatter", prediction.csi_scatter)):
        magnitude, delay_s = profile_over_delay(csi, prediction.freq_hz)
        profiles[name] = np.sqrt(np.mean(magnitude**2, axis=1))
        profiles["delay_s"] = delay_s
    elevation_deg, azimuth_deg = sky_cells()
    arrays = {
        "tx_xyz": prediction.tx_xyz,
        "rx_xyz": prediction.rx_xyz,
        "element_xyz": prediction.element_xyz,
        "freq_hz": prediction.freq_hz,
        "csi": prediction.csi,
        "csi_scatter": prediction.csi_scatter,
        "csi_direct": prediction.csi_direct,
        "csi_free": prediction.csi_free,
        **({} if prediction.csi_room is None else {"csi_room": prediction.csi_room}),
        **profiles,
        "azimuth_deg": azimuth_deg,
        "elevation_deg": elevation_deg,
        "arrival_power": arrival_power(echoes),
        "gaussian_xyz": gaussian_xyz,
        "gaussian_power": echoes.power,
        "gaussian_delay_s": echoes.delay_s,
        "gaussian_rcs_m2": own.rcs_m2,
        "gaussian_phase_rad": own.phase_rad,
        "gaussian_slope": own.slope,
    }
    if boresight_rad:
        rows = zip(prediction.csi_scatter, prediction.element_xyz, boresight_rad, strict=True)
        arrays["beam_power"] = np.stack(
            [beam_power(csi, xyz, prediction.freq_hz, yaw) for csi, xyz, yaw in rows]
        )
    return arrays


def write_prediction(path: Path, arrays: dict[str, np.ndarray]) -> None:
    """Writes arrays to an .npz file, with `units` (name, unit, axes per row) and `note`."""
    units = np.array([(name, *UNITS[name]) for name in arrays])
    save_arrays(path, {**arrays, "units": units, "note": np.array(note_of(arrays))})


def note_of(arrays: dict[str, np.ndarray]) -> str:
    """What a prediction holds, in words."""
    return ROOM_NOTE if "csi_room" in arrays else NOTE
