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
from rfgs_core.real.bedroom import CELLS, Bedroom, folds, snr_db
from rfgs_core.threads import one_torch_thread


def judge_bedroom_fields(path: Path) -> dict[str, float | str]:
    """Complex SNR at held-out blocks of receivers, pooled over five folds [dB].

    Returns:
        `direct_sum_snr_db` and its worst fold.

    Raises:
        RfgsFormatError: The file holds no places.
    """
    room = Bedroom.read(path)
    fold = folds(room.rx)
    answer = np.zeros_like(room.csi)
    with one_torch_thread():
        for number in range(CELLS):
            hidden = fold == number
            answer[hidden] = direct_sum(room, ~hidden)[hidden]
    each = [snr_db(room.csi[fold == n], answer[fold == n]) for n in range(CELLS)]
    return {
        "direct_sum_snr_db": snr_db(room.csi, answer),
        "direct_sum_worst_fold_db": min(each),
    }


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


def _links(room: Bedroom, chosen: Bool[np.ndarray, "receiver"]) -> Links:
    rx = torch.from_numpy(room.rx[chosen])
    wavenumber = torch.tensor([room.wavenumber], dtype=torch.float64)
    return Links(rx, None, torch.zeros(len(rx), dtype=torch.int64), wavenumber)
