# SPDX-License-Identifier: Apache-2.0
"""Self-calibration: offsets of devices from the empty room first, then from the Gaussians.

Three comparisons of channels with what they should be, all by `offsets.estimate_offsets`:

1. drift: a frame beside the empty room. What stands still rules both, so no model is needed;
2. capture: the empty room beside Friis' direct paths between the devices. Reflections bias it
   by what they bend the sum and is not the same in both directions;
3. the change of the channel beside what Gaussians fitted to it predict, in turn with that fit,
   together with 2: the Gaussians alone would follow wrong offsets, the direct paths alone their
   reflections.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rfgs_core.fit.frame import explained_change, solved_frame
from rfgs_core.measure.direct_path import direct_channel
from rfgs_core.measure.observations import Observations
from rfgs_core.measure.offsets import CrossSpectra, Offsets, estimate_offsets
from rfgs_core.settings import TrainConfig

#: Times that Gaussians and offsets are fitted in turn.
TURNS = 2


@dataclass(frozen=True)
class Calibration:
    """Offsets of a frame's devices."""

    capture: Offsets
    """Those the empty room was captured with, against the geometry."""
    drift: Offsets
    """By how much the frame's differ from these."""

    def undone(self, observations: Observations) -> Observations:
        """Observations of the frame as devices without offsets would have made them."""
        frame = observations.delta + observations.static
        back = np.conj(self.drift.turn(observations.layout, observations.freq_hz))
        aligned = observations.with_delta(frame * back - observations.static)
        return self.capture.undone(aligned)


def calibrate(
    observations: Observations, config: TrainConfig, seed: int, known: Offsets | None = None
) -> Calibration:
    """Offsets of a frame.

    Args:
        observations: The frame as observed.
        config: Which offsets may exist (`calibrate`), and how Gaussians are fitted.
        seed: Seed of that fit.
        known: Offsets of the empty room's capture, found on an earlier frame; None finds them.

    Raises:
        RfgsError: The links do not connect the devices, as in a radio that hears only itself.
    """
    frame = observations.delta + observations.static
    drift = _likeliest(config, CrossSpectra.of(observations, frame, observations.static))
    if known is not None:
        return Calibration(known, drift)
    aligned = Calibration(Offsets.none(observations.layout), drift).undone(observations)
    straight = CrossSpectra.of(observations, observations.static, direct_channel(observations))
    capture = _likeliest(config, straight, pooled=True)
    for _ in range(TURNS):
        undone = capture.undone(aligned)
        change = explained_change(undone, solved_frame(undone, config, seed))
        scattered = CrossSpectra.of(observations, aligned.delta, change)
        capture = _likeliest(config, straight, scattered, pooled=True)
    return Calibration(capture, drift)


def _likeliest(config: TrainConfig, *models: CrossSpectra, pooled: bool = False) -> Offsets:
    phase, timing = config.calibrate != "timing", config.calibrate != "phase"
    return estimate_offsets(*models, phase=phase, timing=timing, pooled=pooled)
