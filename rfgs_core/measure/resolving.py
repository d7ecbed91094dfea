# SPDX-License-Identifier: Apache-2.0
"""What the geometry and the band of a radio can tell apart, before anything is fitted.

Two paths are told apart if they differ by c/B, which out and back is a range of c/(2B); beyond c/Δf
of path, delays repeat. A device whose antennas span D across the line of sight tells directions
apart by λ/D, which at the distance R is λR/D (Born and Wolf, Principles of Optics, 8.5). Within
one device transmitting and receiving antennas add up to a virtual array, whose span is the sum.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from rfgs_core.dataset import Sequence
from rfgs_core.dataset.aperture import whole_layout
from rfgs_core.dataset.splits import HeldOut
from rfgs_core.radio import Layout
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.settings import Observe

#: Numbers per entry of the channel: real and imaginary part, or a power; and how many of them a
#: device pair loses with the phase, or phase and level, that its links share.
_PARTS: dict[Observe, tuple[int, int]] = {
    "complex": (2, 0),
    "power": (1, 0),
    "delay_power": (1, 0),
    "csi_ratio": (2, 2),
    "conjugate": (2, 1),
}
#: A Gaussian's unknowns beside its reflectivity: its place.
_PLACE = 3


@dataclass(frozen=True)
class Across:
    """What one device tells apart across its line of sight to the middle of the scene."""

    device: str
    """Its name."""
    distance_m: float
    """From the device to the middle of the scene [m]."""
    sideways_m: float
    """λR/D along the ground [m]; infinite of a single antenna."""
    upright_m: float
    """λR/D along the height [m]; infinite of a single row."""


@dataclass(frozen=True)
class Resolving:
    """What a radio can tell apart."""

    radio: str
    """Its name."""
    path_m: float
    """Difference of paths that are told apart, c/B [m]."""
    repeats_m: float
    """Path after which delays repeat, c/Δf [m]."""
    across: list[Across]
    """Each device."""
    links: int
    """Links that training sees."""
    pairs: int
    """Device pairs that they connect."""
    subcarriers: int
    """Subcarriers that training sees."""
    observe: Observe
    """What is reported of each."""
    gaussians: int
    """Gaussians that are fitted."""

    @property
    def numbers(self) -> int:
        """Real numbers that are reported of a frame."""
        each, lost = _PARTS[self.observe]
        return (each * self.links - lost * self.pairs) * self.subcarriers

    @property
    def unknowns(self) -> int:
        """Real numbers that a frame's Gaussians have: reflectivity and place."""
        return self.gaussians * (2 + _PLACE)

    def lines(self) -> list[str]:
        """All of it, in lines for people."""
        rows = [
            f"{self.radio}: paths are resolved by {self.path_m:.3g} m (out and back: ranges by "
            f"{self.path_m / 2.0:.3g} m), delays repeat after {self.repeats_m:.4g} m of path"
            if np.isfinite(self.path_m)
            else f"{self.radio}: a single subcarrier resolves no paths"
        ]
        for row in self.across:
            rows.append(
                f"{row.device}: across, at {row.distance_m:.1f} m, by {_metres(row.sideways_m)} "
                f"along the ground and {_metres(row.upright_m)} in height"
            )
        enough = _ENOUGH if self.numbers > self.unknowns else _PRIOR
        rows.append(
            f"{self.links} links x {self.subcarriers} subcarriers, {self.observe}: "
            f"{self.numbers:,} numbers for {self.gaussians:,} Gaussians ({self.unknowns:,} "
            f"unknowns): {enough}"
        )
        return rows


_ENOUGH = "more numbers than unknowns"
_PRIOR = "fewer numbers than unknowns, so where Gaussians start decides the rest"


def resolving(
    sequence: Sequence, radio: str, gaussians: int, observe: Observe = "complex"
) -> Resolving:
    """What a radio of a sequence can tell apart.

    Args:
        sequence: The data.
        radio: Which radio.
        gaussians: Gaussians that are fitted.
        observe: What is reported of the channel.
    """
    elements = whole_layout(sequence, radio)
    freq_hz = np.array(sequence.coordinates(radio)["freq_hz"].values, np.float64)
    split = HeldOut.of(sequence.held_out(radio), elements, len(freq_hz))
    spacing_hz = float(np.diff(freq_hz).mean()) if len(freq_hz) > 1 else float("nan")
    middle = np.asarray(sequence.bounds_m, np.float64).mean(axis=0)
    names = [device.name for device in sequence.devices(radio)]
    used = sorted({*elements.tx_device.tolist(), *elements.rx_device.tolist()})
    wavelength_m = SPEED_OF_LIGHT / float(freq_hz.mean())
    return Resolving(
        radio=radio,
        path_m=SPEED_OF_LIGHT / (spacing_hz * len(freq_hz)),
        repeats_m=SPEED_OF_LIGHT / spacing_hz,
        across=[_across(names[d], elements, d, middle, wavelength_m) for d in used],
        links=int(split.links.sum()),
        pairs=len(elements.pairs_of(split.links)[1]),
        subcarriers=int(split.subcarriers.sum()),
        observe=observe,
        gaussians=gaussians,
    )


def _across(
    name: str,
    elements: Layout,
    device: int,
    middle: Float64[np.ndarray, "3"],
    wavelength_m: float,
) -> Across:
    tx = elements.tx_xyz[elements.tx_device == device]
    rx = elements.rx_xyz[elements.rx_device == device]
    own = elements.measured[np.ix_(elements.tx_device == device, elements.rx_device == device)]
    centre = np.concatenate([tx, rx]).mean(axis=0)
    distance_m = float(np.linalg.norm(middle - centre))
    sight = (middle - centre) / max(distance_m, 1e-9)
    sideways = np.cross([0.0, 0.0, 1.0], sight)
    sideways = sideways / max(float(np.linalg.norm(sideways)), 1e-9)
    spans = []
    for axis in (sideways, np.cross(sight, sideways)):
        both = [float(np.ptp(part @ axis)) if len(part) else 0.0 for part in (tx, rx)]
        # Only a link within the device has the phases of both arrays at once.
        spans.append(sum(both) if own.any() else max(both))
    found = [wavelength_m * distance_m / span if span > 1e-6 else np.inf for span in spans]
    return Across(name, distance_m, *map(float, found))


def _metres(value: float) -> str:
    return f"{value:.2g} m" if np.isfinite(value) else "nothing"
