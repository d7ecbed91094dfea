# SPDX-License-Identifier: Apache-2.0
"""Gaussian radio fields on NeWRF's bedroom: the folds and the knowledge of `bedroom`.

Known are places of antennas and the channels of training receivers. nGRF claims 10.9 dB more than
the neural fields before it at random receivers of rooms of its own; here whole blocks are hidden.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from jaxtyping import Bool, Complex128, Float64

from rfgs_core.neural.direct_sum import Links, SumSettings, fit_direct_sum
from rfgs_core.neural.signal_fit import fit_channel
from rfgs_core.neural.signal_splat import SignalSplat, SplatSettings
from rfgs_core.real.bedroom import CELLS, Bedroom, folds, snr_db
from rfgs_core.threads import one_torch_thread

#: The splat of one antenna, which looks everywhere: pixels need not be finer than its Gaussians.
_SPLAT = SplatSettings(
    gaussians=100, pixel_deg=12.0, reach_deg=180.0, scale_m=0.4, steps=150, transmitters=32,
    rate=5e-3, place_rate_m=3e-3,
)  # fmt: skip


def judge_bedroom_fields(path: Path) -> dict[str, float | str]:
    """Complex SNR at held-out blocks of receivers, pooled over five folds [dB].

    Returns:
        `direct_sum_snr_db` and `splat_snr_db`, and how each is worst; how well the splat says what
        it was fitted to, `splat_fitted_snr_db`.

    Raises:
        RfgsFormatError: The file holds no places.
    """
    room = Bedroom.read(path)
    fold = folds(room.rx)
    fields = {"direct_sum": direct_sum, "splat": splat}
    hidden = {name: np.zeros_like(room.csi) for name in fields}
    fitted = []
    with one_torch_thread():
        for number in range(CELLS):
            train = fold != number
            for name, field in fields.items():
                answer = field(room, train)
                hidden[name][~train] = answer[~train]
                if name == "splat":
                    fitted.append(snr_db(room.csi[train], answer[train]))
    result: dict[str, float | str] = {}
    for name, answer in hidden.items():
        each = [snr_db(room.csi[fold == n], answer[fold == n]) for n in range(CELLS)]
        result[f"{name}_snr_db"] = snr_db(room.csi, answer)
        result[f"{name}_worst_fold_db"] = min(each)
    return {**result, "splat_fitted_snr_db": float(np.mean(fitted))}


def direct_sum(
    room: Bedroom, train: Bool[np.ndarray, "receiver"]
) -> Complex128[np.ndarray, "receiver"]:
    """Channel everywhere: sources anywhere within three rooms along each axis, one at the sender.

    How large the room is, is taken from where its receivers are.
    """
    low, high = room.rx[train].min(axis=0), room.rx[train].max(axis=0)

    def draw(count: int, rng: np.random.Generator) -> Float64[np.ndarray, "N 3"]:
        return rng.uniform(2 * low - high, 2 * high - low, (count, 3))

    links = _links(room, train)
    csi = torch.from_numpy(room.csi[train])[:, None]
    rng = np.random.default_rng(0)
    fitted = fit_direct_sum(links, csi, draw, SumSettings(), rng, room.tx[None])
    return fitted.at(_links(room, np.ones(len(train), dtype=bool))).numpy()[:, 0]


def splat(room: Bedroom, train: Bool[np.ndarray, "receiver"]) -> Complex128[np.ndarray, "receiver"]:
    """Channel everywhere: line of sight with one gain, and the rest by splatted signals.

    A field has one receiver and transmitters at many places, so the two are exchanged: channels
    are the same both ways.
    """
    distance = np.linalg.norm(room.rx - room.tx, axis=1)
    sight = np.exp(-1j * room.wavenumber * distance) / distance
    sight = sight * np.vdot(sight[train], room.csi[train]) / np.linalg.norm(sight[train]) ** 2
    rng = np.random.default_rng(0)
    bounds_m = np.array([room.rx[train].min(axis=0), room.rx[train].max(axis=0)])
    means = rng.uniform(bounds_m[0], bounds_m[1], (_SPLAT.gaussians, 3))
    field = SignalSplat(means, room.tx, bounds_m, _SPLAT, 0)
    wavenumber = torch.tensor([room.wavenumber], dtype=torch.float64)
    antenna, places = torch.from_numpy(room.tx[None]), torch.from_numpy(room.rx)
    rest = torch.from_numpy((room.csi - sight).astype(np.complex64))[:, None, None]
    fit_channel(field, places[train], antenna, wavenumber, rest[train], rng)
    with torch.no_grad():
        found = field.channel(places, antenna, wavenumber, room.wavenumber)
    return sight + found.numpy()[:, 0, 0]


def _links(room: Bedroom, chosen: Bool[np.ndarray, "receiver"]) -> Links:
    rx = torch.from_numpy(room.rx[chosen])
    wavenumber = torch.tensor([room.wavenumber], dtype=torch.float64)
    return Links(rx, None, torch.zeros(len(rx), dtype=torch.int64), wavenumber)
