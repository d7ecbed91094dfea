# SPDX-License-Identifier: Apache-2.0
"""Radio presets: band, subcarriers, antennas and where devices stand by default."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float64

from rfgs_core.errors import RfgsError
from rfgs_core.radio.antennas import POLARIZATIONS
from rfgs_core.radio.constants import SPEED_OF_LIGHT

OwnLinks = Literal["included", "only", "excluded"]
Placement = Literal["corners", "walls", "circle"]

#: Above this fractional bandwidth a radio is ultra-wide band (ITU-R SM.1755).
ULTRA_WIDE_BAND = 0.2


@dataclass(frozen=True)
class Radio:
    """One kind of radio, identical in every device of a scene."""

    name: str
    """Name used on the command line and in file paths."""
    freq_min_hz: float
    """Lower band edge [Hz]."""
    freq_max_hz: float
    """Upper band edge [Hz]."""
    num_subcarriers: int
    """Number of subcarriers; they sit at the centres of equal slices of the band."""
    tx_rows: int
    """Transmitting elements of a device along its local z."""
    tx_cols: int
    """Transmitting elements of a device along its local y."""
    rx_rows: int
    """Receiving elements of a device along its local z."""
    rx_cols: int
    """Receiving elements of a device along its local y."""
    tx_offset_m: tuple[float, float, float]
    """Centre of the TX array in the device's own axes [m]; the RX array is at the origin."""
    tx_spacing_m: float = 0.0
    """Distance of neighbouring TX elements [m]; 0 takes half a wavelength at the centre."""
    rx_spacing_m: float = 0.0
    """Distance of neighbouring RX elements [m]; 0 takes half a wavelength at the centre."""
    own_device_links: OwnLinks = "included"
    """Whether a device hears its own transmitter: included, only (a radar) or excluded."""
    isolation_db: float = 0.0
    """Attenuation of the straight way from a device's transmitter to its own receiver [dB]."""
    placement: Placement = "corners"
    """Where devices are placed when the scene brings none."""
    num_devices: int = 4
    """Devices placed by the preset's own rule when the scene brings none."""
    heights_m: tuple[float, ...] = (1.2, 2.2)
    """Heights above the floor that placed devices alternate between [m]."""
    inset_m: float = 0.2
    """Distance of placed devices from the scene's bounds [m]."""
    power_dbm: float = 20.0
    """Transmit power over the whole band [dBm]; CSI itself is a ratio and does not hold it."""
    noise_figure_db: float = 7.0
    """Receiver noise figure [dB]."""
    pattern: str = "iso"
    """Antenna pattern: iso, dipole, hw_dipole or tr38901."""
    polarization: str = "V"
    """Polarisation: V, H, or two ports per element, VH or cross (±45°)."""
    samples_per_frame: int = 1
    """Packets, chirps or pulses of every frame; the first is taken at the frame's own time."""
    sample_interval_s: float = 0.0
    """Time between a frame's samples [s]; 0 spreads them evenly until the next frame."""
    antennas_move: bool = False
    """Whether one device goes from place to place within a frame and takes a sample, a pulse, at
    each, while the scene stands still at the frame's own time: a synthetic aperture."""

    @property
    def bandwidth_hz(self) -> float:
        """Width of the band [Hz]."""
        return self.freq_max_hz - self.freq_min_hz

    @property
    def centre_hz(self) -> float:
        """Centre of the band [Hz]."""
        return 0.5 * (self.freq_min_hz + self.freq_max_hz)

    @property
    def subcarrier_spacing_hz(self) -> float:
        """Distance between neighbouring subcarriers [Hz]."""
        return self.bandwidth_hz / self.num_subcarriers

    @property
    def ultra_wide(self) -> bool:
        """Whether the band is too wide for one frequency to stand for it."""
        return self.bandwidth_hz / self.centre_hz > ULTRA_WIDE_BAND

    @property
    def deepest(self) -> int:
        """Most interactions that a path which meets a person is traced with.

        Paths by way of walls are traced at one frequency, which is too few for an ultra-wide
        band, and takes too long at every place of antennas that move.
        """
        return 1 if self.ultra_wide or self.antennas_move else 3

    @property
    def wavelength_m(self) -> float:
        """Wavelength at the band's centre [m]."""
        return SPEED_OF_LIGHT / self.centre_hz

    @property
    def num_places(self) -> int:
        """Places that devices are put at when the scene brings none: of a moving one, its own."""
        return self.samples_per_frame if self.antennas_move else self.num_devices

    @property
    def slants_deg(self) -> tuple[float, ...]:
        """Slant of each port of an antenna [°]; 0 is vertical."""
        return POLARIZATIONS[self.polarization]

    @property
    def freq_hz(self) -> Float64[np.ndarray, "subcarrier"]:
        """Absolute subcarrier frequencies [Hz], ascending, shape (subcarrier,)."""
        return self.freq_min_hz + (np.arange(self.num_subcarriers) + 0.5) * (
            self.subcarrier_spacing_hz
        )

    @property
    def unambiguous_path_m(self) -> float:
        """Path length after which delays alias, c/Δf [m]."""
        return SPEED_OF_LIGHT / self.subcarrier_spacing_hz

    @property
    def range_resolution_m(self) -> float:
        """Range resolution of an out-and-back path, c/(2B) [m]."""
        return SPEED_OF_LIGHT / (2.0 * self.bandwidth_hz)


#: Every radio that can be asked for by name.
PRESETS: dict[str, Radio] = {
    radio.name: radio
    for radio in (
        Radio(
            name="wifi", freq_min_hz=5.72e9, freq_max_hz=5.88e9, num_subcarriers=64,
            tx_rows=1, tx_cols=1, rx_rows=8, rx_cols=8, tx_offset_m=(0.0, 0.0, -0.3),
        ),
        Radio(
            name="wifi_commodity", freq_min_hz=5.72e9, freq_max_hz=5.88e9, num_subcarriers=64,
            tx_rows=1, tx_cols=2, rx_rows=1, rx_cols=2, tx_offset_m=(0.0, 0.0, 0.0),
            own_device_links="excluded",
        ),
        Radio(
            name="wifi24", freq_min_hz=2.417e9, freq_max_hz=2.457e9, num_subcarriers=64,
            tx_rows=1, tx_cols=1, rx_rows=4, rx_cols=4, tx_offset_m=(0.0, 0.0, -0.3),
        ),
        Radio(
            name="mmwave", freq_min_hz=60e9, freq_max_hz=64e9, num_subcarriers=320,
            tx_rows=8, tx_cols=1, rx_rows=1, rx_cols=8, tx_offset_m=(0.0, 0.05, 0.0),
            own_device_links="only", noise_figure_db=12.0, power_dbm=12.0,
            sample_interval_s=0.25e-3,
        ),
        Radio(
            name="uwb", freq_min_hz=3.1e9, freq_max_hz=10.6e9, num_subcarriers=608,
            tx_rows=1, tx_cols=1, rx_rows=1, rx_cols=16, tx_offset_m=(0.0, 0.0, -0.3),
            rx_spacing_m=0.2, placement="walls",
            # The regulatory −41.3 dBm/MHz over the band.
            power_dbm=-2.5,
        ),
        Radio(
            name="sar", freq_min_hz=8e9, freq_max_hz=12e9, num_subcarriers=320,
            tx_rows=1, tx_cols=1, rx_rows=1, rx_cols=1, tx_offset_m=(0.0, 0.1, 0.0),
            own_device_links="only", placement="circle", num_devices=1,
            # Above heads: at 1.2 m the antenna would go through whoever meets the circle.
            heights_m=(2.2,), samples_per_frame=180, antennas_move=True,
        ),
    )
}  # fmt: skip


def preset(name: str) -> Radio:
    """Looks a radio up by name.

    Raises:
        RfgsError: No preset has that name; the message lists those that exist.
    """
    if name not in PRESETS:
        raise RfgsError(f"unknown radio {name!r}; expected one of {', '.join(sorted(PRESETS))}")
    return PRESETS[name]
