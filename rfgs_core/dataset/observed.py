# SPDX-License-Identifier: Apache-2.0
"""The channel that a receiver reports: the clean one, or what imperfect radios make of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np
from jaxtyping import Complex64

from rfgs_core.radio.impairments import amplitude

if TYPE_CHECKING:
    from rfgs_core.dataset.sequence import Sequence

#: clean: as traced; impaired: as stored by `rfgs-factory impair`.
Observed = Literal["clean", "impaired"]


def observed_packets(
    sequence: Sequence, radio: str, frame: int, channel: Observed, count: int | None = None
) -> Complex64[np.ndarray, "sample tx rx subcarrier"]:
    """Channels of the first `count` packets of a frame, or of all, as a method may see them.

    NaN where a packet was lost. Receivers report the gain they chose, so it is taken out; noise,
    phases and steps stay.

    Raises:
        RfgsError: The radio's channels were never impaired.
    """
    csi = sequence.csi_samples(radio, frame, impaired=channel == "impaired")[:count]
    if channel == "clean":
        return csi
    index = sequence.frames.index(frame) * sequence.radio_spec(radio).samples_per_frame
    gain_db = sequence.impairments(radio).gain_db[index : index + len(csi)]
    level = amplitude(gain_db, sequence.layout(radio))
    return (csi / level).astype(np.complex64)
