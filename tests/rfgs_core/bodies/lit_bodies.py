# SPDX-License-Identifier: Apache-2.0
"""Channels of upright bodies whose surface is random scatterers, lit from one side."""

from __future__ import annotations

import numpy as np

from rfgs_core.measure.observations import Observations
from rfgs_core.radio.constants import SPEED_OF_LIGHT


def cylinder(xy: tuple[float, float], count: int, rng: np.random.Generator) -> tuple:
    """Points on a body's surface and their normals."""
    angle = rng.uniform(0, 2 * np.pi, count)
    normals = np.stack([np.cos(angle), np.sin(angle), np.zeros(count)], axis=1)
    points = 0.13 * normals
    points[:, :2] += xy
    points[:, 2] = rng.uniform(0.1, 1.7, count)
    return points, normals


def lit(observations: Observations, bodies: list[tuple[float, float]], seed: int) -> Observations:
    """Random scatterers on each body; an antenna behind the tangent plane sees nothing."""
    rng = np.random.default_rng(seed)
    delta = np.zeros(observations.delta.shape, np.complex128)
    k = 2 * np.pi * observations.freq_hz / SPEED_OF_LIGHT
    for xy in bodies:
        points, normals = cylinder(xy, 150, rng)
        strength = rng.standard_normal(150) + 1j * rng.standard_normal(150)
        for point, normal, gamma in zip(points, normals, strength, strict=True):
            ends = []
            for xyz in (observations.layout.tx_xyz, observations.layout.rx_xyz):
                away = xyz - point
                distance = np.linalg.norm(away, axis=1)
                seen = (away @ normal > 0) / distance
                ends.append(seen[:, None] * np.exp(-1j * k * distance[:, None]))
            delta += gamma * ends[0][:, None] * ends[1][None]
    return observations.with_delta(delta * observations.layout.measured[..., None])
