# SPDX-License-Identifier: Apache-2.0
"""The walls of a room from radio alone: six upright or level planes that mirror its devices.

A wall across an axis at c sends to each device pair what the mirror image of its transmitter
would: H(f) = g λ/(4πd) e^{−jkd}, d from the image to the receiver. With the line of sight taken
out, the share ρ of a pair's power that such a channel explains at the best g is its matched
filter; − Σ ln(1 − ρ) over the pairs is the log-likelihood gain per entry of a Gaussian channel
whose level is not known. Walls are found one at a time, the strongest first, and each is taken
out before the next is looked for (CLEAN); then each is looked for once more with all others taken
out (RELAX; Li and Stoica 1996). Phases between devices are not needed.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
from jaxtyping import Complex, Float64

from rfgs_core.errors import RfgsError
from rfgs_core.radio import Layout, Radio
from rfgs_core.radio.antennas import field
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.layout import rotation
from rfgs_core.radio.levels import amplitude_of
from rfgs_core.radio.materials import MATERIALS
from rfgs_core.radio.reflection import slab
from rfgs_core.simulate.geometry.room import Room, SlabMaterial, box_room

#: Log-likelihood gain per pair and entry from which a wall counts as heard. Noise alone has
#: 1/entries, a wall that most pairs hear has 0.1 and more.
LEAST_GAIN = 0.03
#: What reflects less of the amplitude is what the model misses of stronger paths.
LEAST_REFLECTION = 0.03
#: Share of what the line of sight leaves that counts as unexplained whatever is taken out.
_MISSED = 1e-2
#: How often all walls are looked for anew.
_ROUNDS = 3
#: Links of a device pair that are looked at, evenly chosen.
_LINKS = 16
#: Walls stand at least this far beyond the outermost antennas [m].
_NEAREST_M = 0.02
#: Steps of the search, as a share of the range resolution c/B, and no more than this [m].
_STEP, _STEP_M = 0.125, 0.02
#: Least product of the patterns of two ends whose levels are read.
_LEAST_PATTERN = 0.03
#: Materials that walls may be made of.
_MATERIALS = ("plasterboard", "wood", "glass", "concrete", "metal")
#: Cosines of the angles of incidence over which their reflection is averaged.
_COSINES = np.linspace(0.3, 1.0, 15)


class Wall(NamedTuple):
    """A plane across one of the world's axes, as the radio hears it."""

    axis: int
    """Axis that it stands across, 0 to 2."""
    high: bool
    """Whether it bounds the room above, in the sense of the axis."""
    at_m: float
    """Where it stands on the axis [m]."""
    gain: float
    """Log-likelihood gain per device pair and entry."""
    reflection: float
    """Median over the pairs of what it reflects, as an amplitude relative to free space."""

    @property
    def name(self) -> str:
        """x-, x+, y-, y+, z- (floor) or z+ (ceiling)."""
        return "xyz"[self.axis] + ("+" if self.high else "-")


class _Pair(NamedTuple):
    """What one device pair hears of an empty room, the line of sight taken out."""

    tx: np.ndarray
    """Transmitting element of each link [m], shape (link, 3)."""
    rx: np.ndarray
    """Receiving element of each [m], shape (link, 3)."""
    residual: np.ndarray
    """What is not explained yet, complex128, shape (link, subcarrier)."""
    line: complex
    """Gain of the line of sight that is taken out."""
    isolation: float
    """Amplitude that is left of it."""
    axes: tuple[np.ndarray, np.ndarray]
    """World from device of the transmitting and of the receiving one."""
    floor: float
    """Power that counts as unexplained whatever is left."""


def find_walls(
    csi_static: Complex[np.ndarray, "tx rx subcarrier"],
    layout: Layout,
    radio: Radio,
    farthest_m: float = 3.0,
) -> list[Wall]:
    """Walls around the devices, the strongest first.

    Args:
        csi_static: Channel of the empty room.
        layout: Antenna elements; unmeasured links are left out.
        radio: Its equally spaced subcarriers are read.
        farthest_m: How far beyond the outermost antennas walls are looked for [m].

    Raises:
        RfgsError: Nothing is heard at all, or of one subcarrier only.
    """
    if len(radio.freq_hz) < 2:
        raise RfgsError("walls are told by delays: expected two subcarriers or more, got 1")
    wavenumber = 2.0 * np.pi * radio.freq_hz / SPEED_OF_LIGHT
    band = float(wavenumber[0]), float(wavenumber[1] - wavenumber[0])
    pairs = _pairs(csi_static, layout, radio, band)
    every = np.concatenate([layout.tx_xyz, layout.rx_xyz])
    hull = np.stack([every.min(axis=0), every.max(axis=0)])
    step_m = min(_STEP_M, _STEP * SPEED_OF_LIGHT / radio.bandwidth_hz)
    away = np.arange(_NEAREST_M, farthest_m, step_m)
    open_sides = [(axis, high) for axis in range(3) for high in (False, True)]
    found: list[tuple[Wall, list[complex]]] = []
    while open_sides:
        walls = [_best(pairs, band, axis, high, hull, away) for axis, high in open_sides]
        wall, gains = _taken(pairs, max(walls, key=lambda wall: wall.gain), radio, band)
        if wall.gain < LEAST_GAIN or wall.reflection < LEAST_REFLECTION:
            break
        found.append((wall, gains))
        open_sides.remove((wall.axis, wall.high))
    for _ in range(_ROUNDS):
        pairs = [_without_line_of_sight(pair, band) for pair in pairs]
        for n, (wall, gains) in enumerate(found):
            for pair, gain in zip(pairs, gains, strict=True):
                pair.residual[:] += gain * _channel(pair, wall.axis, wall.at_m, band)
            again = _best(pairs, band, wall.axis, wall.high, hull, away)
            found[n] = _taken(pairs, again, radio, band)
    return sorted((wall for wall, _ in found), key=lambda wall: -wall.gain)


def room_of_walls(
    walls: list[Wall], radio: Radio, bounds_m: Float64[np.ndarray, "2 3"] | None = None
) -> Room:
    """A room of the walls that a radio hears, of the material that reflects most alike.

    Args:
        walls: From `find_walls`.
        radio: Gives the band of the materials.
        bounds_m: Box whose sides stand in for walls that are not heard, of plasterboard; None
            leaves these open.

    Raises:
        RfgsError: No wall is heard and there are no bounds.
    """
    if not walls and bounds_m is None:
        raise RfgsError("room: the radio hears no wall, and there are no bounds to take instead")
    heard = {(wall.axis, int(wall.high)): wall for wall in walls}
    # Open sides end where they are out of the way.
    box = np.array([[-1e3] * 3, [1e3] * 3]) if bounds_m is None else np.array(bounds_m, float)
    for (axis, side), wall in heard.items():
        box[side, axis] = wall.at_m
    names = ", ".join(wall.name for wall in walls) or "nothing"
    plain = box_room(box[0], box[1], SlabMaterial("plasterboard", 0.0125), f"radio alone: {names}")
    # `box_room` has the sides of x, then y, then z, the lower one first, two triangles each.
    sides = [(axis, side) for axis in range(3) for side in range(2)]
    kept = [side for side in sides if side in heard or bounds_m is not None]
    materials = tuple(
        _material(heard[side].reflection, radio) if side in heard else plain.materials[0]
        for side in kept
    )
    triangles = np.concatenate([plain.triangles.reshape(6, 2, 3, 3)[sides.index(s)] for s in kept])
    number = np.repeat(np.arange(len(kept)), 2)
    return Room(triangles, number, number, materials, plain.source)


def _pairs(
    csi_static: np.ndarray, layout: Layout, radio: Radio, band: tuple[float, float]
) -> list[_Pair]:
    """Device pairs without their lines of sight."""
    pairs = []
    for a, b in layout.device_pairs:
        tx, rx = np.nonzero(layout.links_between(a, b) & layout.measured)
        some = np.unique(np.linspace(0, len(tx) - 1, _LINKS).round().astype(int))
        tx, rx = tx[some], rx[some]
        residual = csi_static[tx, rx].astype(np.complex128)
        if not np.abs(residual).any():
            continue
        quats = layout.tx_quat_wxyz[tx[0]], layout.rx_quat_wxyz[rx[0]]
        axes = rotation(tuple(quats[0].tolist())), rotation(tuple(quats[1].tolist()))
        # What weakens the path within a device, beside the patterns of its antennas.
        own = amplitude_of(-radio.isolation_db) if a == b else 1.0
        pair = _Pair(layout.tx_xyz[tx], layout.rx_xyz[rx], residual, 0.0j, own, axes, 0.0)
        pair = _without_line_of_sight(pair, band)
        pairs.append(pair._replace(floor=_MISSED * _power(residual)))
    if not pairs:
        raise RfgsError("walls: csi_static is zero for every measured link")
    return pairs


def _without_line_of_sight(pair: _Pair, band: tuple[float, float]) -> _Pair:
    """The line of sight taken out anew, beside all else that is."""
    wave = _waves(pair.tx, pair.rx, *band, pair.residual.shape[1])
    pair.residual[:] += pair.line * wave
    return pair._replace(line=_take(pair, wave))


def _isotropic_gain(pair: _Pair, radio: Radio) -> float:
    """Gain of the line of sight between isotropic antennas without isolation."""
    way = pair.rx.mean(axis=0) - pair.tx.mean(axis=0)
    return max(abs(pair.line) / (pair.isolation * _pattern_gain(pair, radio, way, -way)), 1e-30)


def _power(values: np.ndarray) -> float:
    return float(np.sum(np.abs(values) ** 2))


def _take(pair: _Pair, wave: np.ndarray) -> complex:
    """Takes a wave out of what is left, at the gain that explains most of it, and returns that."""
    gain = complex(np.vdot(wave, pair.residual) / np.vdot(wave, wave).real)
    pair.residual[:] -= gain * wave
    return gain


def _pattern_gain(pair: _Pair, radio: Radio, out: np.ndarray, back: np.ndarray) -> float:
    """Product of the patterns of both ends, out of the transmitter and back from the receiver."""
    both = [
        np.linalg.norm(field(radio.pattern, 0.0, way[None], axes))
        for way, axes in zip((out, back), pair.axes, strict=True)
    ]
    # In a null of a pattern nothing is told of its level.
    return max(float(both[0] * both[1]), _LEAST_PATTERN)


def _taken(
    pairs: list[_Pair], wall: Wall, radio: Radio, band: tuple[float, float]
) -> tuple[Wall, list[complex]]:
    """Takes a wall out of all pairs; the wall with what it reflects, and its gain in each pair."""
    gains, ratios = [], []
    for pair in pairs:
        gains.append(_take(pair, _channel(pair, wall.axis, wall.at_m, band)))
        ends = pair.tx.mean(axis=0), pair.rx.mean(axis=0)
        # To the wall and on is as to the image of the other end.
        out, back = ends[1] - ends[0], ends[0] - ends[1]
        for way, end, other in ((out, *ends), (back, *ends[::-1])):
            way[wall.axis] = 2.0 * wall.at_m - other[wall.axis] - end[wall.axis]
        ratios.append(
            abs(gains[-1]) / _isotropic_gain(pair, radio) / _pattern_gain(pair, radio, out, back)
        )
    return wall._replace(reflection=float(np.median(ratios))), gains


def _channel(pair: _Pair, axis: int, at_m: float, band: tuple[float, float]) -> np.ndarray:
    """Channel of the transmitters' images in a plane, of unit gain, (link, subcarrier)."""
    image = pair.tx.copy()
    image[:, axis] = 2.0 * at_m - image[:, axis]
    return _waves(image, pair.rx, *band, pair.residual.shape[1])


def _best(
    pairs: list[_Pair],
    band: tuple[float, float],
    axis: int,
    high: bool,
    hull: np.ndarray,
    away: np.ndarray,
) -> Wall:
    """The likeliest place of one wall, between steps by the parabola through three of them."""
    at = hull[int(high), axis] + (away if high else -away)
    gain = np.zeros(len(at))
    for pair in pairs:
        power = _power(pair.residual) + pair.floor
        gain -= np.log1p(-_explains(pair.tx, pair.rx, axis, at, *band, pair.residual) / power)
    i = int(np.argmax(gain))
    place = at[i]
    if 0 < i < len(at) - 1:
        below, peak, above = gain[i - 1 : i + 2]
        curve = below - 2.0 * peak + above
        place += 0.5 * (below - above) / curve * (at[1] - at[0]) if curve < 0.0 else 0.0
    return Wall(axis, high, float(place), float(gain[i]) / len(pairs), 0.0)


@numba.njit(cache=True)
def _waves(tx: np.ndarray, rx: np.ndarray, first_k: float, step_k: float, count: int) -> np.ndarray:
    """e^{−jkd}/d of each link at equally spaced wavenumbers, complex128, (link, subcarrier)."""
    out = np.zeros((len(tx), count), dtype=np.complex128)
    for link in range(len(tx)):
        d = np.sqrt(((tx[link] - rx[link]) ** 2).sum())
        wave, turn = np.exp(-1j * first_k * d) / d, np.exp(-1j * step_k * d)
        for f in range(count):
            out[link, f] = wave
            wave *= turn
    return out


@numba.njit(cache=True)
def _explains(
    tx: np.ndarray,
    rx: np.ndarray,
    axis: int,
    at_m: np.ndarray,
    first_k: float,
    step_k: float,
    residual: np.ndarray,
) -> np.ndarray:
    """Power of a pair that a wall at each place explains, shape (place,)."""
    explained = np.zeros(len(at_m))
    for i in range(len(at_m)):
        sum_of, weight = 0.0j, 0.0
        for link in range(len(tx)):
            squared = 0.0
            for x in range(3):
                away = tx[link, x] - rx[link, x]
                if x == axis:
                    away = 2.0 * at_m[i] - tx[link, x] - rx[link, x]
                squared += away * away
            d = np.sqrt(squared)
            wave, turn = np.exp(1j * first_k * d) / d, np.exp(1j * step_k * d)
            for f in range(residual.shape[1]):
                sum_of += wave * residual[link, f]
                wave *= turn
            weight += residual.shape[1] / squared
        explained[i] = np.abs(sum_of) ** 2 / weight
    return explained


def _material(reflection: float, radio: Radio) -> SlabMaterial:
    """The material, of its usual thickness, whose reflection is most like this one."""

    def reflects(name: str) -> float:
        factors = slab(name, MATERIALS[name].thickness_m, radio.freq_hz, _COSINES)
        power = np.abs(factors.reflected_te) ** 2 + np.abs(factors.reflected_tm) ** 2
        return float(np.sqrt(0.5 * power.mean()))

    known = [name for name in _MATERIALS if MATERIALS[name].covers(radio)]
    name = min(known, key=lambda name: abs(np.log(reflects(name) / max(reflection, 1e-6))))
    return SlabMaterial(name, MATERIALS[name].thickness_m)
