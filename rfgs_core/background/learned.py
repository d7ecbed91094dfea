# SPDX-License-Identifier: Apache-2.0
"""The empty room of a sequence in which nobody recorded it: the median over its frames.

What moves passes through an entry of the channel in some frames only, so that the median over
the frames, of real and imaginary part or of the amplitude that is reported, is that of the room
once it has moved on. A body that stands still for half of the sequence stays in the background,
and phases that turn from frame to frame (carrier offsets) leave nothing of a complex median:
use `--observe power`, `csi_ratio` or `conjugate` there.

`without_movers` goes on from there, in turn: Gaussians of what moves are fitted to each frame
against the background so far, and the median is taken of what they leave.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Complex64
from tqdm import tqdm

from rfgs_core.dataset.aperture import whole_layout
from rfgs_core.dataset.observed import Observed
from rfgs_core.errors import RfgsError
from rfgs_core.fit.frame import explained_change, solved_frame
from rfgs_core.measure.kinds import KINDS, Reported, Visible
from rfgs_core.measure.observations import observe, visible_channel
from rfgs_core.seeds import sub_seed
from rfgs_core.settings import Observe, Packets, TrainConfig
from rfgs_core.threads import one_torch_thread

if TYPE_CHECKING:
    from rfgs_core.dataset import Sequence

#: The median of fewer frames still holds whoever moves.
LEAST_FRAMES = 3
#: Times that moving Gaussians and background are fitted in turn …
TURNS = 2
#: … on at most so many frames, spread over the sequence, with at most so many Gaussians.
MOST_FRAMES, TURN_GAUSSIANS = 24, 1500


def need_enough_frames(sequence: Sequence) -> None:
    """Refuses sequences from which no background can be learned.

    Raises:
        RfgsError: There are fewer than `LEAST_FRAMES` frames.
    """
    if len(sequence.frames) < LEAST_FRAMES:
        raise RfgsError(
            f"{sequence.path}: holds {len(sequence.frames)} frames; expected at least "
            f"{LEAST_FRAMES} to learn the background from; use --background empty_room"
        )


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
    need_enough_frames(sequence)
    spec = sequence.radio_spec(radio)
    measured = sequence.coordinates(radio)["measured"].values
    if spec.antennas_move:
        measured = whole_layout(sequence, radio).measured
    freq_hz = np.array(sequence.coordinates(radio)["freq_hz"].values, dtype=np.float64)
    ever, rows, shape = np.zeros_like(measured), [], ()
    for frame in sequence.frames:
        elements, links, subcarriers, csi = visible_channel(
            sequence, radio, frame, channel, packets
        )
        mean = csi[0] if len(csi) == 1 else _mean(np.where(subcarriers, csi, 0))
        seen = Visible(links, subcarriers, elements, freq_hz)
        values = KINDS[kind].report(np.where(subcarriers, mean, 0), seen)
        rows.append(np.where(links[..., None], values, np.nan)[measured])
        ever |= links
        shape = values.shape
    stack = np.stack(rows)[:, ever[measured]]
    median = np.nanmedian(stack.real, axis=0)
    if np.iscomplexobj(stack):
        median = median + 1j * np.nanmedian(stack.imag, axis=0)
    background = np.zeros(shape, np.complex64 if np.iscomplexobj(stack) else np.float32)
    background[ever] = median
    return background


def without_movers(
    sequence: Sequence,
    radio: str,
    background: Complex64[np.ndarray, "tx rx subcarrier"],
    config: TrainConfig,
) -> Complex64[np.ndarray, "tx rx subcarrier"]:
    """The background of the frames without what Gaussians of the moving bodies explain of them.

    Args:
        sequence: The data; its empty-room capture is not read.
        radio: Which radio.
        background: As `learned_background` finds it in complex channels.
        config: How moving Gaussians are fitted; they are not refined here.

    Returns:
        As `background`, with less of the bodies in it.
    """
    chosen = np.unique(np.linspace(0, len(sequence.frames) - 1, MOST_FRAMES).round().astype(int))
    frames = [sequence.frames[index] for index in chosen]
    config = replace(config, num_gaussians=min(config.num_gaussians, TURN_GAUSSIANS))
    for turn in tqdm(range(TURNS), desc="background", unit="turn"):
        before, rows = None, []
        for frame in frames:
            seen = observe(
                sequence,
                radio,
                frame,
                channel=config.channel,
                empty=background,
                packets=config.packets,
            )
            still = seen.delta + seen.static
            if seen.changed:
                seed = sub_seed(config.seed, sequence.name, radio, frame, turn, "background")
                with one_torch_thread():
                    # What is left of movers in the room known by then leads evidence astray.
                    before = solved_frame(seen, config, seed, before, settle=False)
                    still = still - explained_change(seen, before)
            rows.append(
                np.where(seen.links[..., None] & seen.subcarriers, still, complex(np.nan, np.nan))
            )
        background = _median(np.stack(rows))
    return background


def _median(rows: np.ndarray) -> Complex64[np.ndarray, "tx rx subcarrier"]:
    """Median over frames of real and imaginary part, zero where no frame is visible."""
    known = ~np.isnan(rows).all(axis=0)
    background = np.zeros(rows.shape[1:], dtype=np.complex64)
    seen = rows[:, known]
    background[known] = np.nanmedian(seen.real, axis=0) + 1j * np.nanmedian(seen.imag, axis=0)
    return background


def _mean(csi: Complex64[np.ndarray, "packet tx rx subcarrier"]) -> np.ndarray:
    """Mean over the packets that a link received; zero where there are none."""
    received = np.isfinite(csi)
    total = np.where(received, csi, 0).sum(axis=0)
    return total / np.maximum(received.sum(axis=0), 1)
