# SPDX-License-Identifier: Apache-2.0
"""Somebody who walks between four radars of the preset `mmwave`: facets of random phases."""

from __future__ import annotations

import numpy as np

from rfgs_core.articulated import facets_of, people
from rfgs_core.measure.observations import Observations
from rfgs_core.radio import PRESETS, layout, place_devices
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.worlds.motion import random_motion

BOUNDS_M = np.array([[0.0, 0.0, 0.0], [5.0, 5.0, 2.6]])
#: Facets that stand for the skin.
_FACETS = 250


class Walker:
    """A body in motion, as the radars hear it and as it is."""

    def __init__(self, family: str = "walk", seed: int = 0) -> None:
        rng = np.random.default_rng(seed)
        self.body = people().body(np.zeros(0))
        self.motion = random_motion(rng, self.body, family)
        self.layout = layout(PRESETS["mmwave"], place_devices(PRESETS["mmwave"], BOUNDS_M))
        self.freq_hz = np.asarray(PRESETS["mmwave"].freq_hz, np.float64)
        area = facets_of(self.body.vertices, self.body.faces)[2]
        self._chosen = rng.choice(len(area), _FACETS, p=area / area.sum())
        self._phase = np.exp(2j * np.pi * rng.random(_FACETS))
        first = self.body.joints17(self.motion.at(0.0))[0]
        self._shift = np.array([2.3 - first[0], 2.3 - first[1], 0.0])

    def joints(self, time_s: float) -> np.ndarray:
        """True joints [m]."""
        return self.body.joints17(self.motion.at(time_s)) + self._shift

    def skin(self, time_s: float) -> np.ndarray:
        """True vertices [m]."""
        return self.body.skin(self.motion.at(time_s)) + self._shift

    def heard(self, time_s: float) -> Observations:
        """The change of the channel, lit facets alone."""
        centres, normals, _ = facets_of(self.skin(time_s), self.body.faces)
        centres, normals = centres[self._chosen], normals[self._chosen]
        wavenumber = 2.0 * np.pi * self.freq_hz / SPEED_OF_LIGHT
        own = self.layout
        delta = np.zeros((*own.measured.shape, len(self.freq_hz)), np.complex64)
        for device in np.unique(own.tx_device):
            tx, rx = own.block_of(int(device), int(device))
            towards = own.rx_xyz[rx[0]].mean(axis=0) - centres
            distance = np.linalg.norm(towards, axis=1)
            lit = np.maximum(np.sum(towards * normals, axis=1) / distance, 0.0)
            ends = [
                np.exp(-1j * wavenumber[:, None, None] * _apart(xyz, centres))
                for xyz in (own.tx_xyz[tx[:, 0]], own.rx_xyz[rx[0]])
            ]
            echo = (ends[0] * (1e-6 * self._phase * lit / distance**2)) @ ends[1].swapaxes(1, 2)
            delta[tx, rx] = np.moveaxis(echo, 0, -1)
        return Observations(
            delta=delta,
            static=np.zeros_like(delta),
            links=own.measured,
            subcarriers=np.ones(len(self.freq_hz), bool),
            layout=own,
            freq_hz=self.freq_hz,
            bounds_m=BOUNDS_M,
            time_s=time_s,
        )


def _apart(xyz: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Distance of every antenna and point [m]."""
    return np.linalg.norm(xyz[:, None] - points, axis=2)
