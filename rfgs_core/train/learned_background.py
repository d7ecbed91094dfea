# SPDX-License-Identifier: Apache-2.0
"""The empty room of a sequence in which nobody recorded it: the median over its frames.

What moves passes through an entry of the channel in some frames only, so that the median over
the frames, of real and imaginary part or of the amplitude that is reported, is that of the room
once it has moved on. A body that stands still for half of the sequence stays in the background,
and phases that turn from frame to frame (carrier offsets) leave nothing of a complex median:
use `--observe power` there.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Complex64

from rfgs_core.dataset.observed import Observed
from rfgs_core.errors import RfgsError
from rfgs_core.train.config import Observe, Packets
from rfgs_core.train.observations import Reported, reported, visible_channel

if TYPE_CHECKING:
    from rfgs_core.dataset import Sequence

#: The median of fewer frames still holds whoever moves.
LEAST_FRAMES = 3


def learned_background(
    sequence: Sequence,
    radio: str,
    channel: Observed,
    kind: Observe,
    packets: Packets = "first",
) -> Reported:
    """What the radio reports of the room, learned from all frames of a sequence.

    Args:
        sequence: The data; its empty-room capture is not read.
        radio: Which radio.
        channel: The traced channel, or what imperfect radios make of it.
        kind: What the radio reports.
        packets: Of all packets the mean counts, in which noise and whoever moves fade.

    Returns:
        As `observe` takes it; zero where something is held out. Frames that lost the packet
        of a link do not count for it.

    Raises:
        RfgsError: There are fewer than `LEAST_FRAMES` frames, or a channel is not finite.
    """
    if len(sequence.frames) < LEAST_FRAMES:
        raise RfgsError(
            f"{sequence.path}: holds {len(sequence.frames)} frames; expected at least "
            f"{LEAST_FRAMES} to learn the background from; use --background empty_room"
        )
    measured = sequence.radio(radio)["measured"].values
    ever, rows, shape = np.zeros_like(measured), [], ()
    for frame in sequence.frames:
        _, links, tones, csi = visible_channel(sequence, radio, frame, channel, packets)
        mean = csi[0] if len(csi) == 1 else _mean(np.where(tones, csi, 0))
        values = reported(np.where(tones, mean, 0), tones, kind)
        rows.append(np.where(links[..., None], values, np.nan)[measured])
        ever |= links
        shape = values.shape
    stack = np.stack(rows)[:, ever[measured]]
    median = np.nanmedian(stack.real, axis=0)
    if kind == "complex":
        median = median + 1j * np.nanmedian(stack.imag, axis=0)
    background = np.zeros(shape, dtype=np.complex64 if kind == "complex" else np.float32)
    background[ever] = median
    return background


def _mean(csi: Complex64[np.ndarray, "packet tx rx subcarrier"]) -> np.ndarray:
    """Mean over the packets that a link received; zero where there are none."""
    received = np.isfinite(csi)
    total = np.where(received, csi, 0).sum(axis=0)
    return total / np.maximum(received.sum(axis=0), 1)
