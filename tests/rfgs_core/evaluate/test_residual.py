# SPDX-License-Identifier: Apache-2.0
"""What a prediction leaves is carried on, what it knows stays, and what nobody knows is nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rfgs_core.evaluate.controls import CONTROLS
from rfgs_core.evaluate.residual import with_residual

ONE = np.array([[2.0, 1.7, 1.2]])


def always(prediction: np.ndarray):
    """A method that says the same whatever it was fitted to."""
    return lambda links, tones: prediction


def error(found: np.ndarray, made) -> float:
    """Relative error on held-out elements and tones."""
    hidden = made.held_out.element | made.held_out.subcarrier
    left = np.linalg.norm(found[hidden] - made.delta[hidden])
    return float(left / np.linalg.norm(made.delta[hidden]))


def test_a_perfect_prediction_stays(scatterers) -> None:
    made = scatterers(ONE)
    exact = np.where(made.evidence.layout.measured[..., None], made.delta, 0).astype(np.complex64)
    found = with_residual(exact, made.evidence, always(exact))
    np.testing.assert_allclose(found, exact, rtol=1e-4, atol=1e-6)


def test_of_an_empty_prediction_a_part_of_the_spectrum_is_left(scatterers) -> None:
    made = scatterers(ONE)
    layout, nothing = made.evidence.layout, np.zeros_like(made.delta)
    carried = CONTROLS["spectrum"](made.evidence).delta
    assert carried is not None
    found = with_residual(nothing, made.evidence, always(nothing))
    for a, b in layout.device_pairs:
        block = (layout.tx_device[:, None] == a) & (layout.rx_device == b)
        if not made.evidence.link_visible[block].any():
            # Nothing near it was heard: the prediction stands alone.
            assert not found[block].any()
            continue
        hidden = made.held_out.element & block[..., None]
        share = np.vdot(carried[hidden], found[hidden]) / np.vdot(carried[hidden], carried[hidden])
        np.testing.assert_allclose(found[hidden], share * carried[hidden], atol=1e-6)
        assert 0.0 < share.real <= 1.0 + 1e-6
    visible = made.held_out.visible
    np.testing.assert_array_equal(found[visible], made.evidence.delta[visible])


def test_half_a_model_beats_none(scatterers) -> None:
    """Two scatterers, one of them known: the residual is smoother than the whole."""
    two = scatterers(np.array([[1.4, 1.3, 1.0], [2.6, 2.2, 1.4]]))
    known = scatterers(np.array([[1.4, 1.3, 1.0]])).delta.astype(np.complex64)
    nothing = np.zeros_like(known)
    alone = error(with_residual(nothing, two.evidence, always(nothing)), two)
    assert error(with_residual(known, two.evidence, always(known)), two) < alone


def test_what_does_not_hold_on_left_out_entries_is_not_believed(scatterers) -> None:
    """A method that repeats what it saw and says noise of ten times the level elsewhere."""
    made = scatterers(ONE)
    rng = np.random.default_rng(0)
    noise = rng.standard_normal(made.delta.shape) + 1j * rng.standard_normal(made.delta.shape)
    noise = (10 * np.abs(made.delta).mean() * noise).astype(np.complex64)

    def repeats(links: np.ndarray, tones: np.ndarray) -> np.ndarray:
        return np.where(links[..., None] & tones, made.delta, noise).astype(np.complex64)

    seen = made.evidence.link_visible, made.evidence.tone_visible
    found = with_residual(repeats(*seen), made.evidence, repeats)
    carried = CONTROLS["spectrum"](made.evidence).delta
    assert carried is not None
    assert error(found, made) < 1.5 * error(carried, made)


def test_noise_is_predicted_as_nothing(scatterers) -> None:
    made = scatterers(ONE)
    rng = np.random.default_rng(0)
    noise = rng.standard_normal(made.delta.shape) + 1j * rng.standard_normal(made.delta.shape)
    drowned = replace(
        made.evidence,
        delta=(made.evidence.delta + 30 * np.abs(made.delta).max() * noise).astype(np.complex64),
    )
    guess = (30 * np.abs(made.delta).max() * noise[::-1]).astype(np.complex64)
    found = with_residual(guess, drowned, always(guess))
    # Silence has an error of one.
    assert error(guess, made) > 40.0
    assert error(found, made) < 8.0


def test_hidden_entries_are_not_looked_at(scatterers) -> None:
    """What the prediction says of hidden entries changes those by a share of it, nothing else."""
    made = scatterers(ONE)
    hidden = ~made.held_out.visible
    guess = np.where(hidden, 0.3 + 0.1j, 0.0).astype(np.complex64)
    guess[~made.evidence.layout.measured] = 0.0
    nothing = np.zeros_like(guess)
    found = with_residual(guess, made.evidence, always(nothing))
    assert np.isfinite(found).all()
    pure = with_residual(nothing, made.evidence, always(nothing))
    np.testing.assert_allclose(found[~hidden], pure[~hidden])
    assert np.abs(found - pure).max() <= np.abs(guess).max() + 1e-6
