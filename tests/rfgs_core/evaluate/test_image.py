# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import numpy as np
import pytest

from rfgs_core.evaluate.baselines.silhouette import empty_picture, silhouette_picture
from rfgs_core.evaluate.image import (
    LPIPS_WEIGHTS,
    Lpips,
    Picture,
    image_metrics,
    mean_person_colour,
    psnr_db,
    psnr_person_db,
    ssim,
)


def square(low: int, high: int, colour: float) -> Picture:
    person = np.zeros((32, 32), bool)
    person[low:high, low:high] = True
    return Picture.cut(np.full((32, 32, 3), colour), person)


def test_psnr_of_a_constant_error() -> None:
    assert psnr_db(np.zeros((4, 4, 3)), np.full((4, 4, 3), 0.01)) == pytest.approx(40.0)
    assert psnr_db(np.ones(3), np.ones(3)) == 100.0


def test_person_is_compared_over_the_union_of_both_masks_on_grey() -> None:
    true, predicted = square(0, 16, 0.9), square(16, 32, 0.9)
    # Disjoint squares: |0.9 − 0.5| wherever one of them is.
    assert psnr_person_db(true, predicted) == pytest.approx(-20 * np.log10(0.4), abs=1e-4)


def test_background_does_not_enter_the_person() -> None:
    true = square(0, 16, 0.9)
    other = Picture(np.zeros((32, 32, 3)), true.person, true.on_grey)
    assert psnr_person_db(true, other) == 100.0


def test_person_metric_is_unknown_without_a_person() -> None:
    assert psnr_person_db(square(0, 0, 0.3), square(0, 0, 0.4)) is None


def test_ssim_of_equal_pictures_is_one_and_falls_with_noise() -> None:
    rng = np.random.default_rng(0)
    rgb = rng.random((32, 32, 3))
    assert ssim(rgb, rgb) == pytest.approx(1.0)
    assert ssim(rgb, rng.random((32, 32, 3))) < 0.2


def test_silhouette_is_flat_inside_the_outline_and_empty_outside() -> None:
    true, empty = square(4, 12, 0.9), np.full((32, 32, 3), 0.2)
    picture = silhouette_picture(empty, true.person, np.array([0.1, 0.6, 0.3]))
    np.testing.assert_allclose(picture.rgb[5, 5], [0.1, 0.6, 0.3])
    np.testing.assert_allclose(picture.rgb[20, 20], 0.2)
    assert not empty_picture(empty).person.any()


def test_mean_colour_is_that_of_the_masked_pixels() -> None:
    np.testing.assert_allclose(mean_person_colour([square(0, 8, 0.8), square(0, 0, 0.1)]), 0.8)
    np.testing.assert_allclose(mean_person_colour([square(0, 0, 0.1)]), 0.5)


def test_lpips_says_why_it_is_missing_or_computes() -> None:
    lpips = Lpips()
    value = image_metrics(square(0, 8, 0.2), square(0, 8, 0.4), lpips)["lpips"]
    if lpips.reason:
        assert value is None
        assert "not installed" in lpips.reason or LPIPS_WEIGHTS in lpips.reason
    else:
        assert value is not None and value >= 0.0
