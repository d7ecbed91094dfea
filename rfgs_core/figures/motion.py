# SPDX-License-Identifier: Apache-2.0
"""Number of Gaussians over time, above the speed of who moves (the paper's figure 4)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Float64

from rfgs_core.dataset import Sequence
from rfgs_core.figures.style import INK, METHOD, TRUTH, new_figure, write_picture
from rfgs_core.run.motion import Motion, read_motion, speeds_between

#: Curves of fewer frames show nothing.
LEAST_FRAMES = 3


def write_motion_chart(path: Path, run: Path, sequence: Sequence, frames: list[int]) -> bool:
    """Writes a PNG: Gaussians above speeds, estimated beside true.

    Args:
        path: The picture.
        run: Folder of a run.
        sequence: Its data; true speeds are those of the pelvises over the ground.
        frames: Its frames.

    Returns:
        Whether there was anything to draw: enough frames, and the checkpoints of all.
    """
    motion = read_motion(run, frames) if len(frames) >= LEAST_FRAMES else None
    if motion is None:
        return False
    with new_figure(10.5, 3.6) as figure:
        above, below = figure.subplots(2, 1, sharex=True)
        above.step(motion.time_s, motion.count, where="mid", color=METHOD, lw=2)
        above.set(ylabel="moving Gaussians", ylim=(0, 1.1 * motion.count.max()))
        _draw_speeds(below, motion, _true_speeds(sequence, frames, motion))
        for axis in (above, below):
            axis.grid(axis="y", color=INK, alpha=0.25, lw=0.6)
        write_picture(figure, path)
    return True


def _true_speeds(
    sequence: Sequence, frames: list[int], motion: Motion
) -> Float64[np.ndarray, "frame person"] | None:
    """Speed of each pelvis over the ground; None where the data does not tell."""
    if not all(sequence.files.geometry(frame).is_file() for frame in frames):
        return None
    pelvis = np.stack([sequence.joints(frame)[:, 0, :2] for frame in frames])
    return speeds_between(pelvis.astype(np.float64), motion.time_s)


def _draw_speeds(axis, motion: Motion, true: Float64[np.ndarray, "frame person"] | None) -> None:
    curves = [] if true is None else [(true, TRUTH, "true", "o-")]
    for speeds, colour, label, style in [*curves, (motion.speed_m_s, METHOD, "track", "s--")]:
        for body in range(speeds.shape[1]):
            axis.plot(
                motion.time_s,
                speeds[:, body],
                style,
                color=colour,
                ms=4,
                lw=1.4,
                label=label if body == 0 else None,
            )
    axis.set(xlabel="time [s]", ylabel="speed [m/s]")
    axis.set_ylim(bottom=0)
    axis.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
