# SPDX-License-Identifier: Apache-2.0
"""Colours by mode: ends, the circle of phases, what is not known, and the legend."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from matplotlib import colormaps

from rfgs_core.view.colors import (
    LEAST_SPAN_DB,
    UNKNOWN,
    Scale,
    colors_of,
    legend_html,
    scales_of,
)
from rfgs_core.view.frame import ShownFrame


def frame_of(**values: np.ndarray) -> ShownFrame:
    count = len(next(iter(values.values())))
    unknown = np.full(count, np.nan, np.float32)
    frame = ShownFrame(
        frame=1,
        means=np.zeros((count, 3), np.float32),
        covariances=np.tile(np.eye(3, dtype=np.float32), (count, 1, 1)),
        opacities=np.full(count, 0.5, np.float32),
        rgb=np.linspace(0, 1, 3 * count, dtype=np.float32).reshape(count, 3),
        power_db=unknown,
        phase_rad=unknown,
        error_m=unknown,
        truth=None,
    )
    return replace(frame, **{name: np.float32(value) for name, value in values.items()})


def test_display_shows_the_shader() -> None:
    frame = frame_of(power_db=np.arange(4.0))
    np.testing.assert_array_equal(colors_of(frame, "display", Scale(0, 1)), frame.rgb)


@pytest.mark.parametrize(
    ("mode", "field", "colours"),
    [
        ("power", "power_db", "viridis"),
        ("error", "error_m", "turbo"),
        ("sigma", "sigma_m", "turbo"),
    ],
)
def test_ends_of_the_scale_are_ends_of_the_map(mode, field: str, colours: str) -> None:
    frame = frame_of(**{field: np.array([-9.0, 2.0, 3.0, 4.0, 99.0, np.nan])})
    rgb = colors_of(frame, mode, Scale(2.0, 4.0))
    ends = colormaps[colours]([0.0, 0.5, 1.0])[:, :3]
    np.testing.assert_allclose(rgb[:5], ends[[0, 0, 1, 2, 2]], atol=1e-6)
    np.testing.assert_allclose(rgb[5], UNKNOWN)


def test_phases_close_the_circle() -> None:
    frame = frame_of(phase_rad=np.array([-np.pi + 1e-4, np.pi - 1e-4, 0.0, np.pi / 2]))
    rgb = colors_of(frame, "phase", scales_of([frame])["phase"])
    np.testing.assert_allclose(rgb[0], rgb[1], atol=0.02)
    assert min(np.abs(rgb[0] - rgb[2]).max(), np.abs(rgb[2] - rgb[3]).max()) > 0.2


def test_only_modes_with_values_are_offered() -> None:
    assert list(scales_of([frame_of(power_db=np.full(3, np.nan))])) == ["display"]
    known = frame_of(power_db=np.zeros(3), error_m=np.ones(3))
    assert list(scales_of([known])) == ["display", "power", "error"]
    sure = replace(known, sigma_m=np.full(3, 0.05, np.float32))
    assert list(scales_of([sure])) == ["display", "power", "error", "sigma"]


def test_one_scale_of_power_for_all_frames() -> None:
    frames = [frame_of(power_db=np.full(50, level)) for level in (-80.0, -40.0)]
    scale = scales_of(frames)["power"]
    assert (scale.low, scale.high) == (-80.0, -40.0)


def test_equal_powers_are_no_rainbow() -> None:
    scale = scales_of([frame_of(power_db=np.full(9, -30.0))])["power"]
    assert (scale.low, scale.high) == (-30.0 - LEAST_SPAN_DB, -30.0)


def test_legends_name_the_ends() -> None:
    assert "fitted to pictures" in legend_html("display", Scale(0, 1))
    assert all(text in legend_html("power", Scale(-80, -40)) for text in ("-80 dB", "-40 dB"))
    assert "≥ 30 cm" in legend_html("error", Scale(0.0, 0.3))
    first = (np.array(colormaps["viridis"](0.0)[:3]) * 255 + 0.5).astype(int)
    assert "#{:02x}{:02x}{:02x}".format(*first) in legend_html("power", Scale(-80, -40))
