# SPDX-License-Identifier: Apache-2.0
"""Back-projection against its defining sum and closed forms."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from antennas import one_device

from rfgs_core.encode import MATCHED_FILTER, PAPER_FILTER, matched_filter_map, unit_rms
from rfgs_core.encode.matched_filter import matched_filter
from rfgs_core.radio import Layout, layout, place_devices, preset
from rfgs_core.radio.constants import SPEED_OF_LIGHT

BOUNDS_M = np.array([[0.0, 0.0, 0.0], [4.0, 3.5, 2.5]])
FREQ_HZ = 5.72e9 + 2.5e6 * np.arange(64)


def waves(elements: Layout, freq_hz: np.ndarray, point: np.ndarray) -> np.ndarray:
    """exp(−j k (d_t + d_r)) of every link and subcarrier."""
    out, back = (np.linalg.norm(xyz - point, axis=1) for xyz in (elements.tx_xyz, elements.rx_xyz))
    path = out[:, None] + back
    return np.exp(-2j * np.pi / SPEED_OF_LIGHT * freq_hz * path[..., None])


def plain(
    csi: np.ndarray, elements: Layout, pair: np.ndarray, freq_hz: np.ndarray, points: np.ndarray
) -> np.ndarray:
    """The module's formula, link by link and subcarrier by subcarrier; (pair, point)."""
    out = np.zeros((pair.max() + 1, len(points)), np.complex128)
    for index, point in enumerate(points):
        turned = (csi * np.conj(waves(elements, freq_hz, point))).mean(axis=2)
        for number in range(len(out)):
            out[number, index] = turned[pair == number].mean()
    return out


@pytest.fixture
def small() -> tuple:
    """Noise on the links of 2 TX and 5 RX elements, in three sums, one link left out."""
    rng = np.random.default_rng(0)
    tx_xyz, rx_xyz = rng.uniform(0, 1, (2, 3)), rng.uniform(2, 4, (5, 3))
    pair = np.array([[0, 0, 1, 1, 2], [0, 2, 1, -1, 2]])
    csi = rng.standard_normal((2, 5, 64)) + 1j * rng.standard_normal((2, 5, 64))
    return csi.astype(np.complex64), one_device(tx_xyz, rx_xyz), pair, FREQ_HZ


def features_of(
    csi: np.ndarray, elements: Layout, pair: np.ndarray, freq_hz: np.ndarray, points: np.ndarray
) -> np.ndarray:
    """What the encoder says of points, scaled as a fit reads it."""
    seen = SimpleNamespace(delta=csi, layout=elements, freq_hz=freq_hz, pairs=(pair, []))
    return unit_rms(MATCHED_FILTER(seen, points))


def test_the_plain_sum_is_its_twin(small: tuple) -> None:
    points = np.random.default_rng(1).uniform(0, 4, (150, 3))
    expected = plain(*small, points)
    got = matched_filter(*small, points)[:, 0]
    # Noise fills the band and has no peak: the error of linear reading, 0.5 % at its worst.
    assert np.abs(got - expected).max() < 0.01 * np.abs(expected).std()


def test_long_paths_alias_as_the_plain_sum_does(small: tuple) -> None:
    """Paths of 60 to 260 m; delays repeat every 120 m."""
    points = np.random.default_rng(8).uniform(-75, 75, (60, 3))
    points = points[np.linalg.norm(points, axis=1) > 35]
    expected = plain(*small, points)
    got = matched_filter(*small, points)[:, 0]
    assert np.abs(got - expected).max() < 0.01 * np.abs(expected).std()


def test_sub_bands_are_the_sums_over_their_subcarriers(small: tuple) -> None:
    csi, elements, pair, freq_hz = small
    points = np.random.default_rng(2).uniform(0, 4, (40, 3))
    got = matched_filter(*small, points, num_bands=5)
    for band, subcarriers in enumerate(np.array_split(np.arange(64), 5)):
        expected = plain(csi[..., subcarriers], elements, pair, freq_hz[subcarriers], points)
        assert np.abs(got[:, band] - expected).max() < 1e-4 * np.abs(expected).std()


def test_sub_bands_average_to_the_full_band(small: tuple) -> None:
    points = np.random.default_rng(3).uniform(0, 4, (40, 3))
    full = matched_filter(*small, points)[:, 0]
    bands = matched_filter(*small, points, num_bands=7)
    width = np.array([len(subcarriers) for subcarriers in np.array_split(np.arange(64), 7)]) / 64
    averaged = np.einsum("pbn,b->pn", bands, width)
    assert np.abs(averaged - full).max() < 0.01 * np.abs(full).std()


@pytest.mark.parametrize("name", ["wifi", "mmwave"])
def test_a_scatterer_is_one_at_its_place(name: str) -> None:
    radio = preset(name)
    elements = layout(radio, place_devices(radio, BOUNDS_M))
    point = np.array([1.9, 2.2, 1.1])
    csi = waves(elements, radio.freq_hz, point).astype(np.complex64)
    pair, names = elements.pairs_of(elements.measured)
    assert len(names) == (16 if name == "wifi" else 4)
    places = point + np.array([[0.0, 0.0, 0.0], [0.0, 0.9, 0.0]])
    got = matched_filter(csi, elements, pair, radio.freq_hz, places)[:, 0]
    assert np.abs(np.abs(got[:, 0]) - 1).max() < 0.006
    assert np.abs(np.angle(got[:, 0])).max() < 0.01
    # 0.9 m aside the links of a pair no longer agree.
    assert np.abs(got[:, 1]).max() < 0.5
    power = matched_filter_map(csi, elements, pair, radio.freq_hz, places)
    np.testing.assert_allclose(power, np.abs(got) ** 2, rtol=1e-6)


@pytest.mark.parametrize("name", ["wifi", "mmwave"])
def test_range_response_of_one_link(name: str) -> None:
    """|sin(π N Δf δ/c) / (N sin(π Δf δ/c))| for a path δ longer; null at c/(2B) of range."""
    radio = preset(name)
    antenna = one_device(np.zeros((1, 3)), np.zeros((1, 3)))
    point = np.array([3.0, 0.0, 0.0])
    csi = waves(antenna, radio.freq_hz, point).astype(np.complex64)
    away = np.linspace(-3.3, 3.3, 400) * radio.range_resolution_m
    away = away[np.abs(away) < 2.9]
    places = point + np.stack([away, 0 * away, 0 * away], axis=1)
    pair = np.zeros((1, 1), np.int64)
    got = np.abs(matched_filter(csi, antenna, pair, radio.freq_hz, places)[0, 0])
    turn = np.pi * radio.subcarrier_spacing_hz * 2 * away / SPEED_OF_LIGHT
    count = radio.num_subcarriers
    expected = np.abs(np.sin(count * turn) / (count * np.sin(turn)))
    np.testing.assert_allclose(got, expected, atol=0.006)
    null = point + np.array([[radio.range_resolution_m, 0.0, 0.0]])
    got = matched_filter(csi, antenna, pair, radio.freq_hz, null)
    assert np.abs(got[0, 0, 0]) < 1e-3


def test_angle_response_of_an_array() -> None:
    """A line of N elements half a wavelength apart: nulls where sin θ = 2 m / N."""
    count, wavelength_m = 16, SPEED_OF_LIGHT / FREQ_HZ.mean()
    rx_xyz = np.zeros((count, 3))
    rx_xyz[:, 1] = (np.arange(count) - 0.5 * (count - 1)) * 0.5 * wavelength_m
    elements = one_device(np.zeros((1, 3)), rx_xyz)
    # Two subcarriers around the centre: practically one frequency, and far away: plane waves.
    freq_hz = FREQ_HZ.mean() + np.array([-10.0, 10.0])
    far_m = 3000.0
    csi = waves(elements, freq_hz, np.array([far_m, 0.0, 0.0])).astype(np.complex64)
    sine = np.linspace(-0.9, 0.9, 181)
    places = far_m * np.stack([np.sqrt(1 - sine**2), sine, 0 * sine], axis=1)
    pair = np.zeros((1, count), np.int64)
    got = np.abs(matched_filter(csi, elements, pair, freq_hz, places)[0, 0])
    turn = 0.5 * np.pi * np.where(np.abs(sine) < 1e-9, 1e-9, sine)
    expected = np.abs(np.sin(count * turn) / (count * np.sin(turn)))
    np.testing.assert_allclose(got, expected, atol=0.005)


def test_features_have_rms_norm_one_and_follow_frequency(small: tuple) -> None:
    csi, elements, _, freq_hz = small
    points = np.random.default_rng(4).uniform(0, 4, (100, 3))
    pair = np.zeros((2, 5), np.int64)
    features = features_of(csi, elements, pair, freq_hz, points)
    assert features.shape == (100, 32)
    assert features.dtype == np.float32
    assert (features >= 0).all()
    assert np.mean(np.sum(features.astype(float) ** 2, axis=1)) == pytest.approx(1.0, rel=1e-5)
    # Only the subcarriers of entry 5 sound: only entry 5 speaks.
    quiet = np.zeros_like(csi)
    quiet[..., 10:12] = csi[..., 10:12]
    features = features_of(quiet, elements, pair, freq_hz, points)
    assert (features[:, 5] > 0).all()
    assert (np.delete(features, 5, axis=1) == 0).all()


def test_features_add_pairs_without_phase(small: tuple) -> None:
    """Turning one pair's clock changes nothing; a sum with phases would."""
    csi, elements, pair, freq_hz = small
    points = np.random.default_rng(5).uniform(0, 4, (30, 3))
    turned = np.where((pair == 1)[..., None], csi * np.exp(2.1j), csi).astype(np.complex64)
    before = features_of(csi, elements, pair, freq_hz, points)
    after = features_of(turned, elements, pair, freq_hz, points)
    np.testing.assert_allclose(after, before, rtol=1e-4, atol=1e-6)
    alone = matched_filter(csi, elements, pair, freq_hz, points, 32)
    expected = np.sqrt((np.abs(alone) ** 2).mean(axis=0)).T
    expected /= np.sqrt((expected**2).sum(axis=1).mean())
    np.testing.assert_allclose(before, expected, rtol=1e-5)


def test_fewer_subcarriers_than_features_repeat_sub_bands(small: tuple) -> None:
    csi, elements, _, freq_hz = small
    points = np.random.default_rng(7).uniform(0, 4, (20, 3))
    pair = np.zeros((2, 5), np.int64)
    rest = (elements, pair, freq_hz[:16], points)
    features = features_of(csi[..., :16], *rest)
    assert features.shape == (20, 32)
    np.testing.assert_array_equal(features[:, ::2], features[:, 1::2])
    subcarriers = np.abs(matched_filter(csi[..., :16], *rest, 16)[0]).T
    ratio = features[:, ::2] / subcarriers
    np.testing.assert_allclose(ratio, ratio[0, 0], rtol=1e-4)


def test_silence_gives_zero_features(small: tuple) -> None:
    csi, *rest = small
    assert (features_of(0 * csi, *rest, np.ones((3, 3))) == 0).all()


def test_left_out_links_are_never_read(small: tuple) -> None:
    csi, elements, pair, freq_hz = small
    points = np.random.default_rng(6).uniform(0, 4, (30, 3))
    poisoned = csi.copy()
    poisoned[pair < 0] = np.nan
    for bands in (1, 32):
        clean = matched_filter(csi, elements, pair, freq_hz, points, bands)
        other = matched_filter(poisoned, elements, pair, freq_hz, points, bands)
        np.testing.assert_array_equal(other, clean)
        assert np.isfinite(clean).all()


def test_the_paper_divides_by_subcarrier_power_and_windows_the_band(small: tuple) -> None:
    csi, elements, pair, freq_hz = small
    links, points = pair >= 0, np.random.default_rng(2).uniform(0, 4, (20, 3))
    uneven = (csi * np.geomspace(1e-3, 1e2, 64)).astype(np.complex64)
    uneven[..., 5] = 0.0

    def seen(delta: np.ndarray) -> SimpleNamespace:
        return SimpleNamespace(
            delta=delta, layout=elements, freq_hz=freq_hz, pairs=(pair, []), links=links
        )

    power = np.mean(np.abs(uneven[links].astype(np.complex128)) ** 2, axis=0)
    level = np.where(power > 0.0, np.sqrt(np.where(power > 0.0, power, 1.0)), np.inf)
    plainly = np.where(links[..., None], uneven / level * np.hamming(64), 0.0)
    expected = MATCHED_FILTER(seen(plainly.astype(np.complex64)), points)
    found = PAPER_FILTER(seen(uneven), points)
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-6 * expected.max())
    # However loud a subcarrier is, it says as much.
    np.testing.assert_allclose(
        found[:, 8:], PAPER_FILTER(seen(csi), points)[:, 8:], rtol=1e-3, atol=1e-6 * found.max()
    )
