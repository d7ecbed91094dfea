# SPDX-License-Identifier: Apache-2.0
"""Fields of channels see the entries that every baseline sees, and tell the hidden ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rfgs_core.evaluate.channel_fields import _less, channel_field
from rfgs_core.evaluate.evidence import Evidence
from rfgs_core.evaluate.rf import frame_rf, rf_values
from rfgs_core.neural.direct_sum import SumSettings
from rfgs_core.neural.signal_splat import SplatSettings

ONE = np.array([[2.0, 1.7, 1.2]])
SUM = SumSettings(rounds=1, per_round=1, places=200, tried=4, steps=10, ridge=1e-3)
SPLAT = SplatSettings(gaussians=12, width=16, steps=120, rate=1e-2)


@pytest.mark.parametrize(("settings", "least_db"), [(SUM, 20.0), (SPLAT, 6.0)])
def test_hidden_elements_and_subcarriers_of_one_scatterer(
    scatterers, settings: SumSettings | SplatSettings, least_db: float
) -> None:
    made = scatterers(ONE)
    result = channel_field(settings, 0)(made.evidence)
    assert np.isfinite(result.delta).all()
    values = rf_values(frame_rf(made.delta, result.delta, made.held_out, made.evidence.layout))
    # Measured: 33 and 37 dB by the sum, 9 and 19 dB by the splat.
    assert values["element_snr_db"] > least_db and values["subcarrier_snr_db"] > least_db
    if result.score is None:
        assert result.reason
    else:
        best = made.evidence.grid.centres(np.array([result.score.argmax()]))
        assert np.linalg.norm(best - ONE) < 0.1


@pytest.mark.parametrize("settings", [SUM, SPLAT])
def test_no_field_depends_on_held_out_entries(
    scatterers, settings: SumSettings | SplatSettings
) -> None:
    made = scatterers(ONE)
    evidence: Evidence = made.evidence
    quick = replace(settings, steps=3)
    poison = np.where(made.held_out.visible, made.delta + made.static, np.nan)
    static = np.where(made.held_out.visible, made.static, np.nan)
    poisoned = Evidence.hide(
        poison, static, made.held_out,
        evidence.layout, evidence.freq_hz, evidence.grid, evidence.voxels,
    )  # fmt: skip
    plain, blind = (channel_field(quick, 0)(one).delta for one in (evidence, poisoned))
    np.testing.assert_array_equal(plain, blind)


def test_a_field_of_less_sees_less(scatterers) -> None:
    made = scatterers(ONE)
    links = made.evidence.link_visible.copy()
    links[:, links.any(axis=0).argmax()] = False
    subcarriers = made.evidence.subcarrier_visible.copy()
    subcarriers[subcarriers.argmax()] = False
    seen = []

    def watch(evidence: Evidence):
        seen.append(evidence)
        return channel_field(SUM, 0)(evidence)

    answer = _less(made.evidence, (links, subcarriers), watch)
    visible = links[..., None] & subcarriers
    np.testing.assert_array_equal(np.isfinite(seen[0].delta), visible)
    np.testing.assert_array_equal(np.isfinite(answer.change), visible)
    assert np.isfinite(answer.predicted).all()


def test_a_silent_frame_is_left_out(scatterers) -> None:
    made = scatterers(ONE)
    silent = replace(made.evidence, delta=made.evidence.delta * 0.0)
    result = channel_field(SUM, 0)(silent)
    assert result.delta is None and result.reason
