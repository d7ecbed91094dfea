# SPDX-License-Identifier: Apache-2.0
"""What a radio does wrong: the settings of every impairment, presets, and settings from a file."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Literal

from rfgs_core.errors import RfgsError
from rfgs_core.files import read_json
from rfgs_core.records import record, unknown_fields


@dataclass(frozen=True)
class Impairments:
    """How strong each impairment is; zero or false switches it off.

    Offsets are drawn once per device from a normal distribution of the given standard
    deviation. The receiver meets them in this order: oscillators, noise, antenna order, gain,
    converter, lost packets.
    """

    cfo_std_hz: float = 0.0
    """Carrier frequency offset of each device [Hz]."""
    sfo_std_ppm: float = 0.0
    """Sampling clock offset of each device [parts per million]."""
    sto_std_s: float = 0.0
    """Symbol timing offset of each device, drawn anew for every sample [s]."""
    phase_noise_rms_deg: float = 0.0
    """Integrated phase jitter of each device's locked oscillator [°]."""
    phase_noise_bandwidth_hz: float = 1e5
    """Loop bandwidth of that oscillator: jitter is coherent over 1/(2π bandwidth) [Hz]."""
    thermal_noise: bool = False
    """Thermal noise of the receiver, kTBF at 290 K."""
    noise_figure_db: float | None = None
    """Noise figure [dB]; none takes the radio's own."""
    power_dbm: float | None = None
    """Transmit power over the whole band [dBm]; none takes the radio's own."""
    training_symbols: int = 1
    """Symbols averaged into one channel estimate; noise power falls by this factor."""
    permutation: Literal["none", "fixed", "per_sample"] = "none"
    """Receiving antennas in the wrong order: once per device, or anew for every sample."""
    agc: bool = False
    """Gain control: each link's strongest component is brought to full scale less headroom."""
    agc_step_db: float = 1.0
    """Step of the gain [dB]."""
    headroom_db: float = 3.0
    """Distance kept from full scale [dB]."""
    adc_bits: int = 0
    """Bits of I and of Q over full scale ±1; without `agc` the gain fits the empty scene."""
    loss_rate: float = 0.0
    """Share of packets that are lost, for every pair of devices."""
    loss_burst: float = 1.0
    """Mean number of packets lost in a row, at least 1/(1 - rate), what chance alone gives."""
    timestamp_step_s: float = 0.0
    """Resolution of the receivers' packet clocks [s]."""

    def __post_init__(self) -> None:
        for name, (low, high) in _LIMITS.items():
            value = getattr(self, name)
            if value is not None and not low <= value <= high:
                raise RfgsError(
                    f"impairments: {name}: expected {low:g} to {high:g}, found {value:g}"
                )


_LIMITS: dict[str, tuple[float, float]] = {
    "cfo_std_hz": (0.0, 1e9), "sfo_std_ppm": (0.0, 1e3), "sto_std_s": (0.0, 1.0),
    "phase_noise_rms_deg": (0.0, 1e3), "phase_noise_bandwidth_hz": (1e-3, 1e12),
    "noise_figure_db": (0.0, 60.0), "power_dbm": (-100.0, 100.0),
    "training_symbols": (1, 1_000_000), "agc_step_db": (1e-6, 40.0), "headroom_db": (0.0, 60.0),
    "adc_bits": (0, 24), "loss_rate": (0.0, 0.99), "loss_burst": (1.0, 1e6),
    "timestamp_step_s": (0.0, 1.0),
}  # fmt: skip

#: Settings that can be asked for by name.
IMPAIRMENT_PRESETS: dict[str, Impairments] = {
    "thermal": Impairments(thermal_noise=True),
    # One clock for all devices, calibrated receivers: what a laboratory can build.
    "lab": Impairments(
        thermal_noise=True, phase_noise_rms_deg=1.0, agc=True, adc_bits=10, agc_step_db=0.5
    ),
    # Free-running network cards: residual offsets after the receiver's own correction.
    "commodity": Impairments(
        thermal_noise=True,
        cfo_std_hz=300.0,
        sfo_std_ppm=2.0,
        sto_std_s=20e-9,
        phase_noise_rms_deg=2.0,
        permutation="fixed",
        agc=True,
        adc_bits=8,
        loss_rate=0.02,
        loss_burst=2.0,
        timestamp_step_s=1e-6,
    ),
}


def read_impairments(name: str) -> Impairments:
    """Settings by the name of a preset, or from a JSON file with fields of `Impairments`.

    Raises:
        RfgsError: There is no such preset or file, or a field is unknown or out of range.
    """
    if name in IMPAIRMENT_PRESETS:
        return IMPAIRMENT_PRESETS[name]
    file = Path(name)
    if not file.is_file():
        raise RfgsError(
            f"{name}: expected a JSON file or one of {', '.join(sorted(IMPAIRMENT_PRESETS))}"
        )
    try:
        return impairments_from_json(read_json(file))
    except RfgsError as error:
        text = str(error)
        raise RfgsError(text if text.startswith(name) else f"{name}: {text}") from error


def impairments_from_json(value: Any) -> Impairments:
    """Settings from a JSON object.

    Raises:
        RfgsError: A field is unknown or out of range.
    """
    unknown = unknown_fields(value, Impairments)
    if unknown:
        known = ", ".join(spec.name for spec in fields(Impairments))
        raise RfgsError(f"impairments: unknown setting {unknown[0]!r}; expected some of {known}")
    return record("impairments", value, Impairments)
