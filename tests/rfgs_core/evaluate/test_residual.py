# SPDX-License-Identifier: Apache-2.0
"""What a prediction leaves is kriged; what it knows stays."""

from __future__ import annotations

import numpy as np

from rfgs_core.evaluate.controls import CONTROLS
from rfgs_core.evaluate.residual import with_residual

ONE = np.array([[2.0, 1.7, 1.2]])


def test_a_perfect_prediction_stays_and_an_empty_one_is_the_gaussian_process(scatterers) -> None:
    made = scatterers(ONE)
    layout = made.evidence.layout
    exact = np.where(layout.measured[..., None], made.delta, 0).astype(np.complex64)
    np.testing.assert_allclose(with_residual(exact, made.evidence), exact, rtol=1e-5)
    kriged = CONTROLS["gaussian_process"](made.evidence).delta
    assert kriged is not None
    found = with_residual(np.zeros_like(exact), made.evidence)
    for a, b in layout.device_pairs:
        block = np.ix_(layout.tx_device == a, layout.rx_device == b)
        if made.evidence.link_visible[block].any():
            np.testing.assert_array_equal(found[block], kriged[block])
        else:
            # Nothing near it was heard: the prediction stands alone.
            assert not found[block].any()


def test_half_a_model_beats_none(scatterers) -> None:
    """Two scatterers, one of them known: the residual is smoother than the whole."""
    two = scatterers(np.array([[1.4, 1.3, 1.0], [2.6, 2.2, 1.4]]))
    known = scatterers(np.array([[1.4, 1.3, 1.0]])).delta
    hidden = two.held_out.element
    share = np.abs(np.vdot(known[hidden], two.delta[hidden])) / np.vdot(known, known).real
    assert share > 0.01, "expected the first scatterer to be part of both"
    error = {}
    for name, start in (("alone", np.zeros_like(known)), ("half", known)):
        left = with_residual(start.astype(np.complex64), two.evidence) - two.delta
        error[name] = float(np.sum(np.abs(left[hidden]) ** 2))
    assert error["half"] < error["alone"]


def test_hidden_entries_are_not_looked_at(scatterers) -> None:
    made = scatterers(ONE)
    hidden = ~made.held_out.visible
    guess = np.where(hidden, 0.3 + 0.1j, 0.0).astype(np.complex64)
    guess[~made.evidence.layout.measured] = 0.0
    found = with_residual(guess, made.evidence)
    assert np.isfinite(found).all()
    np.testing.assert_allclose(
        (found - guess)[hidden], with_residual(0 * guess, made.evidence)[hidden], atol=1e-7
    )
