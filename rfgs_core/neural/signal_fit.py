# SPDX-License-Identifier: Apache-2.0
"""Fits splatted signals: to complex channels of an array, or to spatial spectra as published."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch
from jaxtyping import Complex64, Float, Float32, Float64
from torch import Tensor
from torch.nn.functional import avg_pool2d

from rfgs_core.adam import Adam
from rfgs_core.neural.fit import LAST_RATE
from rfgs_core.neural.signal_splat import SignalSplat

#: Share of structural dissimilarity in the loss of spectra (Wen et al.; Kerbl et al., eq. 7).
DISSIMILARITY = 0.2
#: Side of the windows of structural similarity [pixels], and its constants for levels up to one.
_WINDOW, _LEVEL, _CONTRAST = 7, 1e-4, 9e-4
#: How loud the first signals are beside the measured ones.
_QUIET = 0.3


def fit_channel(
    splat: SignalSplat,
    tx: Float64[Tensor, "tx 3"],
    elements: Float64[Tensor, "rx 3"],
    wavenumber: Float64[Tensor, "subcarrier"],
    csi: Complex64[Tensor, "tx rx subcarrier"],
    rng: np.random.Generator,
) -> None:
    """Fits a splat in place to what elements of its array hear: least squares by Adam.

    Args:
        splat: Gaussians and their network.
        tx: Transmitters [m].
        elements: Elements of the array [m].
        wavenumber: 2πf/c of each subcarrier [rad/m].
        csi: The channel, NaN where a link is not heard.
        rng: Draws what each step looks at.
    """
    settings, middle = splat.settings, float(wavenumber.mean())
    known = torch.isfinite(csi.real)
    csi = torch.where(known, csi, torch.zeros_like(csi))
    level = float((csi.abs() ** 2).sum() / known.sum().clamp(min=1)) ** 0.5 or 1.0
    with torch.no_grad():
        some = splat.channel(tx[: settings.transmitters], elements, wavenumber[:1], middle)
    splat.gain *= _QUIET * level / max(float(some.abs().pow(2).mean()) ** 0.5, 1e-30)

    def loss() -> Float[Tensor, ""]:
        chosen = _drawn(len(tx), settings.transmitters, rng)
        bands = _drawn(len(wavenumber), settings.subcarriers, rng)
        predicted = splat.channel(tx[chosen], elements, wavenumber[bands], middle)
        error = torch.where(known[chosen][:, :, bands], predicted - csi[chosen][:, :, bands], 0)
        return (error.abs() ** 2).mean() / level**2

    _descend(splat, loss)


def fit_spectra(
    splat: SignalSplat,
    tx: Float64[Tensor, "tx 3"],
    spectra: Float32[Tensor, "tx pixel"],
    rng: np.random.Generator,
) -> None:
    """Fits a splat in place to spatial spectra in [0, 1], with the published loss.

    Args:
        splat: Gaussians and their network; it looks at every pixel.
        tx: Transmitters [m].
        spectra: What comes from each direction of `directions`.
        rng: Draws the transmitters of each step.
    """
    columns = round(360.0 / splat.settings.pixel_deg)

    def loss() -> Float[Tensor, ""]:
        chosen = _drawn(len(tx), splat.settings.transmitters, rng)
        found, true = splat.spectra(tx[chosen]), spectra[chosen]
        similar = _similarity(found.unflatten(1, (-1, columns)), true.unflatten(1, (-1, columns)))
        apart = (found - true).abs().mean()
        return (1.0 - DISSIMILARITY) * apart + DISSIMILARITY * (1.0 - similar)

    _descend(splat, loss)


def _drawn(among: int, most: int, rng: np.random.Generator) -> Tensor:
    if among <= most:
        return torch.arange(among)
    return torch.from_numpy(np.sort(rng.choice(among, most, replace=False)))


def _similarity(
    found: Float[Tensor, "picture row column"], true: Float[Tensor, "picture row column"]
) -> Float[Tensor, ""]:
    """Mean structural similarity over windows (Wang et al., IEEE TIP 13(4), 2004, eq. 13)."""

    def mean(picture: Tensor) -> Tensor:
        return avg_pool2d(picture[:, None], _WINDOW, 1)

    a, b = mean(found), mean(true)
    spread = mean(found**2) - a**2 + mean(true**2) - b**2
    together = mean(found * true) - a * b
    above = (2 * a * b + _LEVEL) * (2 * together + _CONTRAST)
    return (above / ((a**2 + b**2 + _LEVEL) * (spread + _CONTRAST))).mean()


def _descend(splat: SignalSplat, loss: Callable[[], Float[Tensor, ""]]) -> None:
    """Adam with one rate for centres and one for everything else, both falling to a tenth."""
    settings = splat.settings
    first: dict[Tensor, float] = dict.fromkeys(splat.parameters(), settings.rate)
    first[splat.means] = settings.place_rate_m
    optimiser = Adam(first)
    for step in range(settings.steps):
        fall = LAST_RATE ** (step / max(settings.steps, 1))
        optimiser.rates = {leaf: fall * rate for leaf, rate in first.items()}
        value = loss()
        optimiser.zero_grad()
        value.backward()
        optimiser.step()
