# SPDX-License-Identifier: Apache-2.0
"""The fast tracer over scene bundles: the twin of `Tracer`, without Sionna RT."""

from __future__ import annotations

import numpy as np

from dataset_factory.scene.bundle import Bundle, BundleFrame
from dataset_factory.scene.motion import read_motion
from dataset_factory.scene.movers import split_movers
from dataset_factory.scene.radios import refuse_trace
from dataset_factory.scene.surroundings import room_of
from rfgs_core.errors import RfgsError
from rfgs_core.radio import Radio, frame_samples, pose_span_s
from rfgs_core.radio.layout import DevicePose
from rfgs_core.simulate.packets import sampled
from rfgs_core.simulate.shadow.kirchhoff import Shadow
from rfgs_core.simulate.tracer import FastTracer


class FastBundleTracer(FastTracer):
    """Traces one radio through one bundle.

    Example:
        tracer = FastBundleTracer(bundle, preset("wifi"), devices)
        csi = tracer.frame(bundle.frame(1))
    """

    def __init__(
        self,
        bundle: Bundle,
        radio: Radio,
        devices: list[DevicePose],
        *,
        depth: int = 2,
        shadow: Shadow = "kirchhoff",
        seed: int = 0,
    ) -> None:
        """Looks around, see `FastTracer`.

        Raises:
            RfgsError: A material does not hold in the radio's band, the depth is more than the
                radio can have, or the radio's antennas move.
        """
        if radio.antennas_move:
            raise RfgsError(
                "the fast tracer has antennas that stand still, this radio's move; "
                "use --tracer sionna"
            )
        refuse_trace(bundle, radio, depth)
        people, vehicles = split_movers(bundle)
        room = room_of(bundle)
        super().__init__(
            room, people, vehicles, radio, devices, depth=depth, shadow=shadow, seed=seed
        )
        self._bundle, self._samples = bundle, frame_samples(radio, bundle.fps)

    def frame(self, frame: BundleFrame) -> np.ndarray:
        """Channel at one frame, complex64, shape (tx, rx, subcarrier)."""
        return self.frame_at(frame.vertices)

    def samples(self, frame: BundleFrame) -> np.ndarray:
        """Channels at every sample of a frame, complex64, shape (sample, tx, rx, subcarrier).

        Raises:
            RfgsFormatError: The bundle holds no poses between frames.
        """
        first = self.trace_at(frame.vertices)
        channels = [self.mixture(frame.vertices, (first,), (1.0,))]
        span_s = pose_span_s(self._radio)
        if span_s is not None:
            motion = read_motion(self._bundle, frame.frame, span_s)
            channels += sampled(self, first, self._samples.offset_s, motion.at)
        return np.stack(channels).astype(np.complex64)
