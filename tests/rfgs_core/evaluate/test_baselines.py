# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from rfgs_core.bodies.body_prior import Bodies
from rfgs_core.encode.peaks import separated_peaks
from rfgs_core.evaluate.baselines import BASELINES
from rfgs_core.evaluate.baselines.clean import SEPARATION_M
from rfgs_core.evaluate.baselines.gaussian_process import krige
from rfgs_core.evaluate.baselines.plain import linear, nearest
from rfgs_core.evaluate.evidence import Evidence
from rfgs_core.evaluate.geometry import best_voxels
from rfgs_core.evaluate.rf import frame_rf, rf_values
from rfgs_core.evaluate.verdicts import leak
from rfgs_core.measure.spectrum import _like, _likeliest, spectral

Make = Callable[..., object]
ONE = np.array([[2.0, 1.7, 1.2]])
TWO = np.array([[1.4, 1.3, 1.0], [2.6, 2.2, 1.4]])


def rf_of(made, name: str) -> dict:
    result = BASELINES[name](made.evidence)
    elements = made.evidence.layout
    return rf_values(frame_rf(made.delta, result.delta, made.held_out, elements))


def test_held_out_entries_are_hidden(scatterers) -> None:
    made = scatterers(ONE)
    for field in (made.evidence.delta, made.evidence.static):
        np.testing.assert_array_equal(np.isnan(field), ~made.held_out.visible)


@pytest.mark.parametrize("name", BASELINES)
def test_no_baseline_depends_on_held_out_entries(scatterers, name: str) -> None:
    made = scatterers(ONE)
    evidence: Evidence = made.evidence.with_method(ONE[0])
    poison = np.where(made.held_out.visible, made.delta + made.static, np.nan)
    static = np.where(made.held_out.visible, made.static, np.nan)
    poisoned = Evidence.hide(
        poison,
        static,
        made.held_out,
        evidence.layout,
        evidence.freq_hz,
        evidence.grid,
        evidence.voxels,
    ).with_method(ONE[0])
    plain, blind = BASELINES[name](evidence), BASELINES[name](poisoned)
    for key in ("score", "delta", "static"):
        first, second = getattr(plain, key), getattr(blind, key)
        assert (first is None) == (second is None)
        if first is not None:
            assert np.isfinite(first).all()
            np.testing.assert_array_equal(first, second)


@pytest.mark.parametrize("name", BASELINES)
def test_every_baseline_says_why_it_leaves_something_out(scatterers, name: str) -> None:
    made = scatterers(ONE, own_device_links="only")
    result = BASELINES[name](made.evidence.with_method(ONE[0]))
    if result.score is None or result.delta is None:
        assert result.reason
    if result.score is not None:
        assert result.score.shape == made.evidence.grid.shape
    if result.delta is not None:
        assert result.delta.shape == made.delta.shape


@pytest.mark.parametrize("name", ["matched_filter", "matched_filter_all_sum", "clean", "omp"])
def test_one_scatterer_is_found_where_it_is(scatterers, name: str) -> None:
    made = scatterers(ONE)
    score = BASELINES[name](made.evidence).score
    found = made.evidence.grid.centres(best_voxels(score, 20)).mean(axis=0)
    assert np.linalg.norm(found - ONE[0]) < 0.1


@pytest.mark.parametrize("name", ["clean", "omp"])
def test_two_separated_scatterers_are_recovered(scatterers, name: str) -> None:
    # The search covers both: the matched filter's blobs are wider than the points.
    made = scatterers(TWO, voxels=2000)
    score = BASELINES[name](made.evidence).score
    points, power = made.evidence.grid.centres(), score.ravel()
    peaks = points[separated_peaks(points, power, 2, SEPARATION_M)]
    for truth in TWO:
        assert np.linalg.norm(peaks - truth, axis=1).min() < 0.12


def test_omp_predicts_held_out_elements_of_point_scatterers(scatterers) -> None:
    made = scatterers(TWO, voxels=2000)
    assert rf_of(made, "omp")["element_snr_db"] > 10.0


def test_zero_and_empty_room_are_zero_decibels(scatterers) -> None:
    made = scatterers(ONE)
    for name in ("zero", "empty_room"):
        assert rf_of(made, name)["element_snr_db"] == pytest.approx(0.0)


def test_empty_room_predicts_hidden_static_entries(scatterers) -> None:
    # Within a device the direct path is 30 cm long and too curved for any interpolation.
    made = scatterers(ONE, own_device_links="excluded")
    static = BASELINES["empty_room"](made.evidence).static
    error = np.abs(static - made.static)[made.held_out.element]
    assert np.sqrt(np.mean(error**2) / np.mean(np.abs(made.static) ** 2)) < 0.2


def test_interpolators_keep_visible_entries_and_unmeasured_links(scatterers) -> None:
    made = scatterers(ONE, own_device_links="excluded")
    for name in ("nearest_element", "linear", "gaussian_process", "spectrum"):
        delta = BASELINES[name](made.evidence).delta
        visible = made.held_out.visible
        np.testing.assert_array_equal(delta[visible], made.evidence.delta[visible])
        assert not delta[~made.evidence.layout.measured].any()


def ramp(x: np.ndarray) -> np.ndarray:
    """Two waves of neighbouring directions over array columns."""
    return np.exp(0.35j * x) + 0.4 * np.exp(0.25j * x + 1j)


def test_a_split_that_leaks_is_told_by_the_nearest_neighbour(scatterers) -> None:
    """As it is made, a neighbour tells nothing; elements that are shown after all are noticed."""
    made = scatterers(TWO)
    hidden = rf_of(made, "nearest_element")
    assert leak(hidden["element_snr_db"], "elements") == ""
    assert leak(hidden["subcarrier_snr_db"], "subcarriers") == ""
    links = made.evidence.layout.measured
    shown = replace(made.evidence, delta=made.delta, static=made.static, link_visible=links)
    leaked = BASELINES["nearest_element"](shown).delta
    assert leaked is not None
    values = rf_values(frame_rf(made.delta, leaked, made.held_out, shown.layout))
    line = leak(values["element_snr_db"], "elements")
    assert line.startswith("Not decided: copying the nearest visible entry explains")


def test_kriging_and_lines_beat_the_nearest_value_on_a_phase_ramp() -> None:
    x = np.arange(8.0)[:, None]
    values = ramp(x)
    error = {
        f.__name__: np.abs(f(values[:6], x[:6], x[6:]) - values[6:]).max()
        for f in (nearest, linear, krige)
    }
    assert error["krige"] < 0.1
    assert error["krige"] < error["linear"] < error["nearest"]


def test_kriging_bridges_a_gap_of_subcarriers() -> None:
    x = np.arange(32.0)[:, None]
    values = ramp(x)
    seen = (x[:, 0] < 16) | (x[:, 0] >= 20)
    filled = krige(values[seen], x[seen], x[~seen])
    assert np.abs(filled - values[~seen]).max() < 0.05


def test_a_spectrum_carries_on_waves_that_kriging_confuses() -> None:
    """Two echoes far apart in direction or delay: one phase slope fits neither of them."""
    x = np.arange(64.0)[:, None]
    rng = np.random.default_rng(0)
    # Samples of one spectrum, as links of a device pair are: the same waves, other amplitudes.
    amplitude = rng.standard_normal((2, 12)) + 1j * rng.standard_normal((2, 12))
    values = np.exp(1j * x * np.array([0.4, -1.3])) @ amplitude
    seen = (x[:, 0] < 40) | (x[:, 0] >= 48)
    error = {
        f.__name__: np.linalg.norm(f(values[seen], x[seen], x[~seen]) - values[~seen])
        / np.linalg.norm(values[~seen])
        for f in (krige, spectral)
    }
    assert error["spectral"] < 0.01 < 0.5 < error["krige"]


def test_noise_is_predicted_as_nothing() -> None:
    """Hidden values of white noise: whatever is said about them only adds to the error."""
    x = np.arange(48.0)[:, None]
    rng = np.random.default_rng(1)
    values = rng.standard_normal((48, 200)) + 1j * rng.standard_normal((48, 200))
    seen = (x[:, 0] < 30) | (x[:, 0] >= 36)
    for carry_on in (krige, spectral):
        said = carry_on(values[seen], x[seen], x[~seen])
        assert np.mean(np.abs(said) ** 2) < 0.1 * np.mean(np.abs(values) ** 2), carry_on.__name__


def test_a_spectrum_has_the_power_of_wave_and_noise() -> None:
    """The power of a single wave, and that of the noise around it."""
    x = np.arange(16)
    rng = np.random.default_rng(2)
    noise = 0.1 * (rng.standard_normal((16, 400)) + 1j * rng.standard_normal((16, 400)))
    wave = np.exp(2j * np.pi * 0.25 * x)[:, None] * np.exp(2j * np.pi * rng.random(400))
    values = _like((wave + noise).astype(np.complex128))
    power, level = _likeliest(values, x, 64)
    assert int(np.argmax(power)) == 16
    wide = np.zeros(64, dtype=bool)
    wide[12:21] = True
    assert power[wide].sum() == pytest.approx(1.0, rel=0.05)
    # An even spectrum is noise too, so only their sum is known.
    assert power[~wide].sum() + level == pytest.approx(0.02, rel=0.3)


def test_lines_extend_beyond_the_last_value_and_nearest_does_not() -> None:
    x = np.array([[0.0], [1.0], [2.0]])
    values = np.array([[0.0], [1.0], [2.0 + 1j]])
    np.testing.assert_allclose(linear(values, x, np.array([[3.0], [0.5]])), [[3 + 2j], [0.5]])
    np.testing.assert_allclose(nearest(values, x, np.array([[9.0]])), [[2 + 1j]])


def test_hidden_device_pair_takes_the_level_of_its_neighbours(scatterers) -> None:
    made = scatterers(ONE)
    assert rf_of(made, "nearest_element")["device_gain_mae_db"] < 6.0
    assert rf_of(made, "gaussian_process")["device_gain_mae_db"] < 6.0


def test_template_stands_on_the_floor_at_the_methods_centroid(scatterers) -> None:
    made = scatterers(ONE, voxels=1500)
    score = BASELINES["template"](made.evidence.with_method(np.array([2.0, 1.6, 0.4]))).score
    voxels = made.evidence.grid.centres(best_voxels(score, 1500))
    np.testing.assert_allclose(voxels.mean(axis=0), [2.0, 1.6, 0.85], atol=0.05)
    assert np.ptp(voxels[:, 2]) == pytest.approx(1.7, abs=0.1)
    assert np.ptp(voxels[:, 0]) == pytest.approx(0.5, abs=0.1)


def test_filled_template_stays_inside_the_ellipsoid(scatterers) -> None:
    made = scatterers(ONE, voxels=1500)
    evidence = made.evidence.with_method(np.array([2.0, 1.6, 0.4]))
    score = BASELINES["template_filled"](evidence).score
    voxels = made.evidence.grid.centres(best_voxels(score, 1500))
    radius = np.linalg.norm((voxels - [2.0, 1.6, 0.85]) / [0.25, 0.20, 0.85], axis=1)
    assert radius.max() < 0.85


@pytest.mark.parametrize("name", ["template", "template_filled"])
def test_several_people_have_a_template_each(scatterers, name: str) -> None:
    """Between two people, where their common centroid is, nobody stands."""
    made = scatterers(ONE, voxels=3000)
    places = np.array([[1.4, 1.6], [2.6, 1.6]])
    evidence = made.evidence.with_method(np.array([2.0, 1.6, 0.9]), Bodies.standing(places))
    score = BASELINES[name](evidence).score
    voxels = made.evidence.grid.centres(best_voxels(score, 3000))
    away = np.linalg.norm(voxels[:, None, :2] - places, axis=2)
    nearest = away.argmin(axis=1)
    assert away.min(axis=1).max() < 0.32
    # Each has half of the voxels, around its own place.
    assert np.bincount(nearest) == pytest.approx([1500, 1500], abs=60)
    for body, place in enumerate(places):
        middle = voxels[nearest == body].mean(axis=0)
        np.testing.assert_allclose(middle[:2], place, atol=0.05)


def test_the_prior_alone_is_that_of_the_methods_bodies(scatterers) -> None:
    made = scatterers(ONE, voxels=1500)
    sitting = Bodies(np.array([[2.0, 1.6]]), np.array([0.0]))
    heights, widths = [], []
    for bodies in (Bodies.standing(sitting.axes_xy), sitting):
        evidence = made.evidence.with_method(None, bodies)
        score = BASELINES["body_prior"](evidence).score
        voxels = made.evidence.grid.centres(best_voxels(score, 1500))
        heights.append(np.ptp(voxels[:, 2]))
        widths.append(voxels[:, 0].max() - 2.0)
    assert heights == pytest.approx([1.65, 1.35], abs=0.1)
    # Knees and the shins before them.
    assert widths == pytest.approx([0.17, 0.5], abs=0.08)
    assert "does not tell" in BASELINES["body_prior"](made.evidence).reason


def test_template_without_a_centroid_says_so(scatterers) -> None:
    assert "centroid" in BASELINES["template"](scatterers(ONE).evidence).reason


def test_different_device_variants_need_different_devices(scatterers) -> None:
    made = scatterers(ONE, own_device_links="only")
    assert BASELINES["matched_filter_different_sum"](made.evidence).score is None
    same = BASELINES["matched_filter"](made.evidence).score
    np.testing.assert_array_equal(same, BASELINES["matched_filter_all_sum"](made.evidence).score)


def test_a_silent_frame_gives_no_points(scatterers) -> None:
    made = scatterers(ONE)
    silent = replace(made.evidence, delta=made.evidence.delta * 0)
    for name in ("clean", "omp"):
        assert BASELINES[name](silent).score is None or not BASELINES[name](silent).score.any()
