# SPDX-License-Identifier: Apache-2.0
"""What a prediction leaves is carried on, what it knows stays, and what nobody knows is nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rfgs_core.evaluate.baselines import BASELINES
from rfgs_core.evaluate.evidence import Evidence
from rfgs_core.evaluate.residual import Answer, with_residual
from rfgs_core.measure.observations import Kept

ONE = np.array([[2.0, 1.7, 1.2]])


def always(prediction: np.ndarray, evidence: Evidence):
    """A method that says the same whatever it was fitted to."""

    def from_less(kept: Kept) -> Answer:
        links, subcarriers = kept
        seen = np.where(links[..., None] & subcarriers, evidence.delta, np.nan)
        return Answer(seen.astype(np.complex64), prediction)

    return from_less


def error(found: np.ndarray, made) -> float:
    """Relative error on held-out elements and subcarriers."""
    hidden = made.held_out.element | made.held_out.subcarrier
    left = np.linalg.norm(found[hidden] - made.delta[hidden])
    return float(left / np.linalg.norm(made.delta[hidden]))


def test_a_perfect_prediction_stays(scatterers) -> None:
    made = scatterers(ONE)
    exact = np.where(made.evidence.layout.measured[..., None], made.delta, 0).astype(np.complex64)
    found = with_residual(exact, made.evidence, always(exact, made.evidence))
    np.testing.assert_allclose(found, exact, rtol=1e-4, atol=1e-6)


def test_of_an_empty_prediction_a_part_of_the_spectrum_is_left(scatterers) -> None:
    made = scatterers(ONE)
    layout, nothing = made.evidence.layout, np.zeros_like(made.delta)
    carried = BASELINES["spectrum"](made.evidence).delta
    assert carried is not None
    found = with_residual(nothing, made.evidence, always(nothing, made.evidence))
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
    alone = error(with_residual(nothing, two.evidence, always(nothing, two.evidence)), two)
    assert error(with_residual(known, two.evidence, always(known, two.evidence)), two) < alone


def test_what_does_not_hold_on_left_out_entries_is_not_believed(scatterers) -> None:
    """A method that repeats what it saw and says noise of ten times the level elsewhere."""
    made = scatterers(ONE)
    rng = np.random.default_rng(0)
    noise = rng.standard_normal(made.delta.shape) + 1j * rng.standard_normal(made.delta.shape)
    noise = (10 * np.abs(made.delta).mean() * noise).astype(np.complex64)

    def repeats(kept: Kept) -> Answer:
        seen = kept[0][..., None] & kept[1]
        said = np.where(seen, made.delta, noise).astype(np.complex64)
        return Answer(np.where(seen, made.delta, np.nan).astype(np.complex64), said)

    seen = made.evidence.link_visible, made.evidence.subcarrier_visible
    found = with_residual(repeats(seen).predicted, made.evidence, repeats)
    carried = BASELINES["spectrum"](made.evidence).delta
    assert carried is not None
    assert error(found, made) < 1.5 * error(carried, made)


def test_as_much_is_left_out_as_is_held_out(scatterers) -> None:
    """Two of eight columns, and an eighth of the subcarriers amid others."""
    made, asked = scatterers(ONE), []

    def remembers(kept: Kept) -> Answer:
        asked.append(kept)
        return always(np.zeros_like(made.delta), made.evidence)(kept)

    with_residual(np.zeros_like(made.delta), made.evidence, remembers)
    ((links, subcarriers),) = asked
    column, seen = made.evidence.layout.rx_column, made.evidence.link_visible
    np.testing.assert_array_equal(links, seen & (column < 4))
    assert seen[:, column == 5].any() and not seen[:, column >= 6].any()
    assert np.flatnonzero(~made.evidence.subcarrier_visible).tolist() == [20, 21, 22, 23]
    assert np.flatnonzero(~subcarriers).tolist() == [8, 9, 10, 11, 20, 21, 22, 23]


def test_without_columns_to_leave_out_the_residual_is_carried_on(scatterers) -> None:
    """Two columns, one of them hidden: nothing can be tried on the other."""
    made = scatterers(ONE, rx_cols=2)
    nothing = np.zeros_like(made.delta)
    one = replace(
        made.evidence,
        delta=np.where(made.evidence.layout.rx_column[:, None] == 0, made.evidence.delta, np.nan),
        link_visible=made.evidence.link_visible & (made.evidence.layout.rx_column == 0),
    )
    found = with_residual(nothing, one, always(nothing, one))
    carried = BASELINES["spectrum"](one).delta
    assert carried is not None
    pair = made.evidence.layout.measured & ~made.held_out.pair_links
    hidden = pair & (made.evidence.layout.rx_column == 1)
    np.testing.assert_allclose(found[hidden], carried[hidden], rtol=1e-5, atol=1e-9)


def test_where_nothing_changes_nothing_is_predicted(scatterers) -> None:
    made = scatterers(ONE)
    silent = replace(made.evidence, delta=made.evidence.delta * np.complex64(0))
    guess = np.full_like(made.delta, 0.1 + 0.2j) * made.evidence.layout.measured[..., None]
    found = with_residual(guess, silent, always(guess, silent))
    heard = made.evidence.layout.measured & ~made.held_out.pair_links
    assert not found[heard].any()


def test_noise_is_predicted_as_nothing(scatterers) -> None:
    made = scatterers(ONE)
    rng = np.random.default_rng(0)
    noise = rng.standard_normal(made.delta.shape) + 1j * rng.standard_normal(made.delta.shape)
    drowned = replace(
        made.evidence,
        delta=(made.evidence.delta + 30 * np.abs(made.delta).max() * noise).astype(np.complex64),
    )
    guess = (30 * np.abs(made.delta).max() * noise[::-1]).astype(np.complex64)
    found = with_residual(guess, drowned, always(guess, drowned))
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
    found = with_residual(guess, made.evidence, always(nothing, made.evidence))
    assert np.isfinite(found).all()
    pure = with_residual(nothing, made.evidence, always(nothing, made.evidence))
    np.testing.assert_allclose(found[~hidden], pure[~hidden])
    assert np.abs(found - pure).max() <= np.abs(guess).max() + 1e-6
