# SPDX-License-Identifier: Apache-2.0
"""What links of one packet say relative to each other, where packets and devices share no phase.

A packet between two devices is h = g e^{j(φ + 2πfτ)} (e + Δ) on each subcarrier: h, e and Δ are
vectors over the links between the antennas of both, e the empty room, and gain, phase and timing
are drawn anew for each packet. csi − csi_static then says nothing. What is left:

- **CSI ratio** (Zeng et al., FarSense, IMWUT 2019). Ratios h_r/h_s of any two links know no factor
  that both share. Held against one antenna they break down where that antenna fades; here each
  link is held against all of them, weighed by the empty room (a function of the ratios alone):

      δ = h |e|²/(eᴴh) − e = (|e|² Δ − e eᴴΔ)/(|e|² + eᴴΔ) ≈ Δ − e eᴴΔ/|e|².

- **Conjugate products** h_r h_s* (Li et al., IndoTrack, IMWUT 2017) keep the power. Again each link
  against all of them, (h hᴴ) e, at the level of the empty room over the band, since a gain is left:

      δ = q h (eᴴh)*/|e|² − e ≈ Δ + e (eᴴΔ)*/|e|² − e 2 Re Σ_f eᴴΔ / Σ_f |e|²,

  with q = Σ_f |e|²/Σ_f |h|².

So of Δ the ratio loses its part along e, one complex number per subcarrier and device pair, and
products lose the imaginary half of that number. A pair of devices with one link has no ratio: δ is
zero. Both are in units of the empty room, whose own phase and timing are those of the direct path,
computed from where the antennas stand: wrong where that is not the strongest path.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np
import torch
from jaxtyping import Bool, Complex, Float, Int64
from torch import Tensor

from rfgs_core.measure.phase_free import direct_wave
from rfgs_core.radio import Layout

#: A packet that differs from the empty room has at least this cosine with it, so that a fade does
#: not divide by zero.
LEAST_COSINE = 0.1
#: Delays that are tried per subcarrier of the band.
_DELAYS = 64

Relative = Literal["csi_ratio", "conjugate"]
Channels = Complex[Tensor, "link subcarrier"]
Pairs = Int64[Tensor, "link"]


def _over_pairs(values: Tensor, pair: Pairs) -> Tensor:
    """Sums over the links of each device pair, read at each link."""
    total = values.new_zeros(int(pair.max()) + 1 if len(pair) else 0, *values.shape[1:])
    return total.index_add(0, pair, values)[pair]


def _power(values: Channels) -> Float[Tensor, "link subcarrier"]:
    return values.real**2 + values.imag**2


def ratio_change(now: Channels, empty: Channels, pair: Pairs) -> Channels:
    """δ of the CSI ratio; see the module.

    Args:
        now: Channels of one packet.
        empty: Those of the empty room.
        pair: Device pair of each link, counted from zero.
    """
    own = _over_pairs(_power(empty), pair)
    along = _over_pairs(empty.conj() * now, pair)
    least = LEAST_COSINE * (own * _over_pairs(_power(now), pair)).sqrt()
    grow = (least / along.abs().clamp(min=1e-30)).clamp(min=1.0)
    return now * own / (along * grow + 1e-30) - empty


def ratio_linear(change: Channels, empty: Channels, pair: Pairs) -> Channels:
    """The part of `ratio_change` that is linear in the channel's change."""
    own = _over_pairs(_power(empty), pair).clamp(min=1e-30)
    return change - empty * _over_pairs(empty.conj() * change, pair) / own


def product_change(now: Channels, empty: Channels, pair: Pairs) -> Channels:
    """δ of the conjugate products; see the module. Arguments as of `ratio_change`."""
    own = _over_pairs(_power(empty), pair)
    along = _over_pairs(empty.conj() * now, pair)
    level = _over_band(_power(now), pair).clamp(min=1e-30)
    return _over_band(_power(empty), pair) / level * now * along.conj() / (own + 1e-30) - empty


def product_linear(change: Channels, empty: Channels, pair: Pairs) -> Channels:
    """The part of `product_change` that is linear (in real and imaginary part) in the change."""
    own = _over_pairs(_power(empty), pair).clamp(min=1e-30)
    along = _over_pairs(empty.conj() * change, pair)
    level = _over_band(_power(empty), pair).clamp(min=1e-30)
    louder = 2.0 * _over_band((empty.conj() * change).real, pair) / level
    return change + empty * along.conj() / own - empty * louder


def _over_band(power: Float[Tensor, "link subcarrier"], pair: Pairs) -> Float[Tensor, "link 1"]:
    return _over_pairs(power.sum(dim=1, keepdim=True), pair)


Rule = Callable[[Channels, Channels, Pairs], Channels]
#: δ of a packet beside the empty room, and its linear part.
RULES: dict[Relative, tuple[Rule, Rule]] = {
    "csi_ratio": (ratio_change, ratio_linear),
    "conjugate": (product_change, product_linear),
}


def on_direct_paths(
    csi: Complex[np.ndarray, "tx rx subcarrier"],
    links: Bool[np.ndarray, "tx rx"],
    subcarriers: Bool[np.ndarray, "subcarrier"],
    layout: Layout,
    freq_hz: Float[np.ndarray, "subcarrier"],
) -> Complex[np.ndarray, "tx rx subcarrier"]:
    """Channels whose device pairs have the phase and timing of their direct paths.

    The phase and the delay of the strongest path, less those of the direct path, summed over
    the links of a pair: max over τ of |Σ_f e^{j2πfτ} Σ_links h u*|. Links within a device share
    one oscillator and stay as they are.

    Args:
        csi: One packet; entries that may not be read do not count.
        links: Links that may be read.
        subcarriers: Subcarriers that may be read.
        layout: Antenna elements.
        freq_hz: Subcarrier frequencies [Hz], equally spaced.
    """
    seen = np.where(links[..., None] & subcarriers, csi, 0)
    seen = seen * direct_wave(layout, np.asarray(freq_hz, np.float64)).conj()
    pair, names = layout.pairs_of(links)
    turned = csi.astype(np.complex128)
    count = len(freq_hz)
    for index, (a, b) in enumerate(names):
        if a == b:
            continue
        (t, r), size = np.nonzero(pair == index), _DELAYS * count
        profile = np.fft.ifft(seen[t, r].sum(axis=0), size)
        late = int(np.abs(profile).argmax())
        phase = np.angle(profile[late]) - 2 * np.pi * late / size * np.arange(count)
        turned[t, r] *= np.exp(-1j * phase)
    return turned.astype(np.complex64)


def relative_change(
    kind: Relative,
    now: Complex[np.ndarray, "tx rx subcarrier"],
    empty: Complex[np.ndarray, "tx rx subcarrier"],
    links: Bool[np.ndarray, "tx rx"],
    subcarriers: Bool[np.ndarray, "subcarrier"],
    layout: Layout,
) -> Complex[np.ndarray, "tx rx subcarrier"]:
    """δ of one packet on the visible entries, zero elsewhere.

    Args:
        kind: Ratios or products.
        now: The packet.
        empty: The empty room, `on_direct_paths`.
        links: Visible links.
        subcarriers: Visible subcarriers.
        layout: Antenna elements.
    """
    pair, _ = layout.pairs_of(links)
    rows = [
        torch.from_numpy(values[links][:, subcarriers].astype(np.complex128))
        for values in (now, empty)
    ]
    found = RULES[kind][0](rows[0], rows[1], torch.from_numpy(pair[links])).numpy()
    delta = np.zeros(now.shape, np.complex64)
    tx, rx = np.nonzero(links)
    delta[tx[:, None], rx[:, None], np.flatnonzero(subcarriers)] = found
    return delta
