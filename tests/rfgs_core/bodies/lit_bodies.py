# SPDX-License-Identifier: Apache-2.0
"""Channels of bodies whose surface is random scatterers, lit from one side."""

from __future__ import annotations

import numpy as np

from rfgs_core.bodies.body_prior import Bodies, outward_normals
from rfgs_core.bodies.localise import PairMaps
from rfgs_core.bodies.start import StartDensity
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


def echoing(empty: Observations, bodies: Bodies, seed: int) -> Observations:
    """Random scatterers drawn from the prior, an antenna behind the tangent plane sees nothing."""
    rng = np.random.default_rng(seed)
    flat = PairMaps(np.ones((1, 4, 4, 4), np.float32), np.zeros(3), 1.0, *np.zeros((2, 1, 3)))
    points = StartDensity.of(flat, bodies, empty.bounds_m).draw(400, rng)
    normals = outward_normals(points, bodies)
    gamma = rng.standard_normal(400) + 1j * rng.standard_normal(400)
    k = 2 * np.pi * empty.freq_hz / SPEED_OF_LIGHT
    legs = []
    for xyz in (empty.layout.tx_xyz, empty.layout.rx_xyz):
        towards = xyz - points[:, None]
        distance = np.linalg.norm(towards, axis=2)
        seen = (np.einsum("mac,mc->ma", towards, normals) > 0) / distance
        legs.append(seen[..., None] * np.exp(-1j * k * distance[..., None]))
    delta = np.einsum("m,mtf,mrf->trf", gamma, *legs)
    noise = 0.03 * np.abs(delta).mean()
    delta += noise * (rng.standard_normal(delta.shape) + 1j * rng.standard_normal(delta.shape))
    return empty.with_delta(delta * empty.links[..., None])
