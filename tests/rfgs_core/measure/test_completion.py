# SPDX-License-Identifier: Apache-2.0
"""What is hidden of a device pair is told from what it shows, and nothing else is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rfgs_core.measure.completion import complete
from rfgs_core.measure.observations import Observations
from rfgs_core.radio import layout
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.placement import place_devices
from rfgs_core.radio.presets import preset

BOUNDS_M = np.array([[-2.5, -2.5, 0.0], [2.5, 2.5, 2.6]])


def heard(radio_name: str) -> Observations:
    """Five points of a body in the middle of a room, by distances alone; nothing is hidden."""
    radio = preset(radio_name)
    placed = layout(radio, place_devices(radio, BOUNDS_M))
    rng = np.random.default_rng(3)
    points = np.array([0.3, -0.2, 1.0]) + rng.uniform(-1.0, 1.0, (5, 3)) * [0.2, 0.2, 0.6]
    wavenumber = 2.0 * np.pi * radio.freq_hz / SPEED_OF_LIGHT
    csi = np.zeros((len(placed.tx_xyz), len(placed.rx_xyz), len(wavenumber)), complex)
    for point in points:
        way_m = np.linalg.norm(placed.tx_xyz - point, axis=1)[:, None] + np.linalg.norm(
            placed.rx_xyz - point, axis=1
        )
        csi += np.exp(-1j * way_m[..., None] * wavenumber)
    csi[~placed.measured] = 0.0
    return Observations(
        delta=csi.astype(np.complex64),
        static=np.zeros_like(csi, dtype=np.complex64),
        links=placed.measured.copy(),
        subcarriers=np.ones(len(wavenumber), dtype=bool),
        layout=placed,
        freq_hz=np.asarray(radio.freq_hz, dtype=np.float64),
        bounds_m=BOUNDS_M,
    )


def less(whole: Observations, links: np.ndarray, subcarriers: np.ndarray) -> Observations:
    """The same with entries hidden."""
    delta = np.where(links[..., None] & subcarriers, whole.delta, 0.0).astype(np.complex64)
    return replace(whole, delta=delta, links=links, subcarriers=subcarriers)


def held_out(whole: Observations) -> Observations:
    """Less a quarter of each array, an eighth of the band and the first pair, both ways."""
    placed, count = whole.layout, len(whole.subcarriers)
    columns = placed.rx_column.max() + 1
    links = whole.links & (placed.rx_column < columns - columns // 4)
    a, b = placed.device_pairs[0]
    links &= ~placed.links_between(a, b) & ~placed.links_between(b, a)
    subcarriers = np.ones(count, dtype=bool)
    subcarriers[count * 5 // 8 : count * 3 // 4] = False
    return less(whole, links, subcarriers)


def error_db(said: Observations, whole: Observations, where: np.ndarray) -> float:
    """Power of the error over that of the channel."""
    error = np.linalg.norm((said.delta - whole.delta)[where])
    return float(20.0 * np.log10(error / np.linalg.norm(whole.delta[where])))


@pytest.mark.parametrize(("radio", "columns_db"), [("mmwave", -45.0), ("wifi", -25.0)])
def test_hidden_columns_and_subcarriers_are_told(radio: str, columns_db: float) -> None:
    whole = heard(radio)
    seen = held_out(whole)
    said = complete(seen)
    visible = seen.links[..., None] & seen.subcarriers
    np.testing.assert_array_equal(said.delta[visible], whole.delta[visible])
    assert said.subcarriers.all()
    assert error_db(said, whole, seen.links[..., None] & ~seen.subcarriers) < -80.0
    assert error_db(said, whole, said.links & ~seen.links) < columns_db
    # A pair that shows nothing stays hidden, and so does what is no link at all.
    assert said.pairs[1] == seen.pairs[1]
    assert not (said.links & ~whole.layout.measured).any()
    assert (said.delta[~said.links] == 0.0).all()


def test_nothing_is_told_where_nothing_is_hidden() -> None:
    whole = heard("wifi")
    said = complete(whole)
    np.testing.assert_array_equal(said.delta, whole.delta)
    np.testing.assert_array_equal(said.links, whole.links)


@pytest.mark.parametrize("lost", ["an element", "a link", "all columns but one"])
def test_arrays_with_other_gaps_stay_as_they_are(lost: str) -> None:
    """Elements in odd places are no columns; subcarriers are told of the links that are there."""
    whole = heard("wifi")
    links, placed = whole.links.copy(), whole.layout
    first = placed.rx_device == 0
    if lost == "an element":
        links[:, np.flatnonzero(first)[3]] = False
    elif lost == "a link":
        links[0, np.flatnonzero(placed.rx_device == 1)[0]] = False
    else:
        links[:, first & (placed.rx_column > 0)] = False
    said = complete(less(whole, links, held_out(whole).subcarriers))
    np.testing.assert_array_equal(said.links, links)
    assert error_db(said, whole, links) < -80.0
    assert (said.delta[~links] == 0.0).all()


def test_noise_is_not_carried_on() -> None:
    """What no spectrum tells is left at nothing, as before."""
    whole = heard("mmwave")
    rng = np.random.default_rng(5)
    noise = rng.standard_normal(whole.delta.shape) + 1j * rng.standard_normal(whole.delta.shape)
    whole = replace(whole, delta=np.where(whole.links[..., None], noise, 0.0).astype(np.complex64))
    seen = held_out(whole)
    said = complete(seen)
    hidden = (said.links[..., None] & said.subcarriers) & ~(
        seen.links[..., None] & seen.subcarriers
    )
    assert np.mean(np.abs(said.delta[hidden]) ** 2) < 0.1 * np.mean(
        np.abs(whole.delta[hidden]) ** 2
    )
