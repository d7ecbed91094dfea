# SPDX-License-Identifier: Apache-2.0
"""Limbs of a stream: a network proposes joints in every window, posed skins carry the Gaussians.

Joints around a body's axis are averaged exponentially over windows: the network's errors in
neighbouring windows are alike, but not the same.
"""

from __future__ import annotations

import numpy as np

from rfgs_core.articulated import Pose, fit_pose, people
from rfgs_core.bodies.tracks import Tracks
from rfgs_core.limbs.network import LimbNetwork
from rfgs_core.limbs.propose import glimpse
from rfgs_core.limbs.skins import OnSkin, PosedPeople, pulls
from rfgs_core.measure.observations import Observations

#: Time over which joints are averaged [s].
SMOOTH_S = 0.12


class LiveLimbs:
    """Bodies of the mean shape, posed anew in each window."""

    def __init__(self, network: LimbNetwork, gaussians: int, seed: int = 0) -> None:
        """Nobody was seen yet.

        Args:
            network: The network of the stream's radio.
            gaussians: How many lie on all skins together.
            seed: Seed of their places on the skins.
        """
        self._network, self._gaussians, self._seed = network, gaussians, seed
        self._body = people().body(np.zeros(0))
        self._around: np.ndarray | None = None
        self._poses: list[Pose | None] = []
        self._time_s = 0.0

    @property
    def joints(self) -> np.ndarray | None:
        """Averaged joints less their body's place on the ground, (body, 17, 3) [m]."""
        return self._around

    def on_skins(self, observations: Observations, tracks: Tracks) -> OnSkin:
        """Gaussians on the skins of the bodies as a window says that they hold themselves.

        Args:
            observations: The window.
            tracks: Where the bodies are in it.
        """
        said = glimpse(self._network, observations, tracks.axes_xy)
        ground = np.zeros((len(tracks.axes_xy), 1, 3))
        ground[:, 0, :2] = tracks.axes_xy
        around = said.xyz - ground
        if self._around is None or len(self._around) != len(around):
            self._poses = [None] * len(around)
        else:
            elapsed_s = max(tracks.time_s - self._time_s, 1e-3)
            share = 1.0 - np.exp(-elapsed_s / SMOOTH_S)
            around = self._around + share * (around - self._around)
        self._around, self._time_s = around, tracks.time_s
        weight = pulls(said)
        poses = [
            fit_pose(self._body, joints, one, before)
            for joints, one, before in zip(around + ground, weight, self._poses, strict=True)
        ]
        self._poses = list(poses)
        posed = PosedPeople(
            np.zeros((len(poses), 0)),
            np.array([[pose.root for pose in poses]]),
            np.array([[pose.turns for pose in poses]], np.float32),
        )
        return posed.gaussians(0, self._gaussians, self._seed)
