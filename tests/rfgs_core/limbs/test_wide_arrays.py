# SPDX-License-Identifier: Apache-2.0
"""Covariances of what a body sends, against sums over all elements and subcarriers, one by one."""

from __future__ import annotations

import numpy as np
import pytest

from rfgs_core.limbs.evidence.entries import Pair, pairs_of
from rfgs_core.limbs.evidence.kernel import STRAIGHT, Facets, Images, covariance
from rfgs_core.limbs.evidence.responses import _weight
from rfgs_core.measure.observations import Observations
from rfgs_core.radio import layout, preset
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.placement import place_devices

BOUNDS_M = np.array([[-2.5, -2.0, 0.0], [2.5, 2.0, 2.6]])
CENTRE = np.array([0.3, 0.2, 0.95])
LOBE_RAD = 0.25


def noise(radio_name: str) -> Observations:
    """A frame of noise without the last columns and some subcarriers."""
    radio, rng = preset(radio_name), np.random.default_rng(0)
    elements = layout(radio, place_devices(radio, BOUNDS_M))
    links = elements.measured & (elements.rx_column < 0.75 * radio.rx_cols)
    subcarriers = np.ones(radio.num_subcarriers, dtype=bool)
    subcarriers[radio.num_subcarriers // 2 : radio.num_subcarriers * 5 // 8] = False
    shape = (*links.shape, radio.num_subcarriers)
    delta = (rng.normal(size=shape) + 1j * rng.normal(size=shape)).astype(np.complex64)
    delta = np.where(links[..., None] & subcarriers, delta, 0)
    return Observations(delta, delta, links, subcarriers, elements, radio.freq_hz, BOUNDS_M)


def summed_up(
    pair: Pair, facets: Facets, k: np.ndarray, image: tuple[int, int, float] | None
) -> np.ndarray:
    """Σ w² a aᴴ, each a by its definition: steered, summed in blocks, no wavenumber in common."""
    ends = [pair.tx.xyz.copy(), pair.rx.xyz.copy()]
    if image is not None:
        end, axis, at_m = image
        ends[end][:, axis] = 2.0 * at_m - ends[end][:, axis]
    middles = [xyz.mean(axis=0) for xyz in ends]
    total = 0.0
    for point, normal, root in zip(*facets, strict=True):
        weight = root * _weight(point, normal, *middles, True, LOBE_RAD)[0]
        waves = [
            np.exp(-1j * k * (np.linalg.norm(xyz - point, axis=1) - end.steered_m)[:, None])
            for xyz, end in zip(ends, (pair.tx, pair.rx), strict=True)
        ]
        heard = weight * waves[0][:, None] * waves[1]
        for axis, part in enumerate((pair.tx, pair.rx, pair.bands)):
            member = (part.block == np.arange(len(part.share))[:, None]) * part.share[:, None]
            heard = np.moveaxis(np.tensordot(member, heard, axes=(1, axis)), 0, axis)
        total = total + np.outer(heard.ravel(), heard.ravel().conj())
    return np.asarray(total)


@pytest.mark.parametrize(
    ("radio_name", "image"), [("wifi", None), ("uwb", None), ("uwb", (1, 1, 2.0))]
)
def test_beams_are_those_of_each_part_of_the_band(
    radio_name: str, image: tuple[int, int, float] | None
) -> None:
    """An array of uwb is 3 m wide: at one wavenumber for all of 7.5 GHz this would be noise."""
    seen, rng = noise(radio_name), np.random.default_rng(1)
    points = CENTRE + rng.normal(size=(30, 3)) * [0.15, 0.15, 0.4]
    normals = rng.normal(size=(30, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    facets, lit = Facets(points, normals, np.full(30, 0.05)), np.ones(30, dtype=bool)
    images = STRAIGHT if image is None else Images.of([image])
    k = 2.0 * np.pi * seen.freq_hz / SPEED_OF_LIGHT
    for pair in pairs_of(seen, CENTRE)[:3]:
        upper = np.triu(covariance(pair, facets, lit, lit, LOBE_RAD, images))
        whole = upper + np.triu(upper, 1).conj().T
        off = np.linalg.norm(whole - summed_up(pair, facets, k, image))
        # Facets below a twentieth of the strongest are left out. What comes by the wall is held
        # against what comes straight: blocks that are steered to the body hear little of it.
        assert off < 0.05 * np.linalg.norm(summed_up(pair, facets, k, None))
