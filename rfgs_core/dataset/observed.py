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


def observed_csi(
    sequence: Sequence, radio: str, frame: int, channel: Observed
) -> Complex64[np.ndarray, "tx rx subcarrier"]:
    """Channel of a frame as a method may see it, NaN where a packet was lost.

    Receivers report the gain they chose, so it is taken out; noise, phases and steps stay.

    Raises:
        RfgsError: The radio's channels were never impaired.
    """
    if channel == "clean":
        return sequence.csi(radio, frame)
    csi = sequence.csi(radio, frame, impaired=True)
    index = sequence.frames.index(frame) * sequence.radio_spec(radio).samples_per_frame
    gain_db = sequence.impairments(radio).gain_db[index : index + 1]
    return (csi / amplitude(gain_db, sequence.layout(radio))[0]).astype(np.complex64)
