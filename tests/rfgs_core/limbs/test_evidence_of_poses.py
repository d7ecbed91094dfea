# SPDX-License-Identifier: Apache-2.0
"""Evidence of a posed surface: its kernel against plain sums, and what must not change it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from rfgs_core.articulated import people
from rfgs_core.limbs.evidence.body import (
    LOBE_RAD,
    by_bounces,
    direct,
    figure_of,
    images_of,
    posed,
)
from rfgs_core.limbs.evidence.entries import End, Pair, pairs_of
from rfgs_core.limbs.evidence.kernel import (
    NOISE_SHARES,
    STRAIGHT,
    Facets,
    Images,
    covariance,
    log_evidence,
)
from rfgs_core.limbs.evidence.library import PHASES, Stride, strides, upright
from rfgs_core.limbs.evidence.table import evidence_table, stacked
from rfgs_core.measure.observations import Observations
from rfgs_core.worlds.figure import Figure

PLACE, HEADING, PHASE = np.array([0.3, -0.2, 0.0]), 0.7, 2
CENTRE = np.array([0.3, -0.2, 0.95])


@pytest.fixture(scope="module")
def frame(heard, stride) -> Observations:
    return heard(stride.poses[PHASE], HEADING, PLACE)


@pytest.fixture(scope="module")
def facets() -> Facets:
    rng = np.random.default_rng(0)
    normals = rng.normal(size=(30, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    points = CENTRE + rng.uniform(-0.4, 0.4, (30, 3))
    return Facets(points, normals, rng.uniform(0.02, 0.1, 30))


def test_facets_hide_each_other_nearly_as_the_skin_hides_them(frame, stride) -> None:
    figure, pairs = figure_of(people().body(np.zeros(0)), 0.14), pairs_of(frame, CENTRE)
    pose = stride.poses[PHASE].moved(PLACE)
    by_skin, by_facets = (posed(figure, pose, pairs, by_skin=skin) for skin in (True, False))
    np.testing.assert_array_equal(by_skin.facets.points, by_facets.facets.points)
    for devices, ends in by_skin.seen.items():
        for one, other in zip(ends, by_facets.seen[devices], strict=True):
            assert 0.2 < one.mean() < 0.5
            # Half of all facets face a place: what only did so would be seen too often.
            assert (one & ~other).mean() < 0.07 and (other & ~one).mean() < 0.07, devices


def unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v)


def plain(pair: Pair, facets: Facets, tx: End, rx: End) -> np.ndarray:
    """The covariance by its formula, one facet after the other, with exact phases."""
    k = pair.bands.first_k + pair.bands.step_k * np.arange(len(pair.bands.block))
    shape = len(tx.share), len(rx.share), len(pair.bands.share)
    rows, weights = [], []
    for x, n, root in zip(*facets, strict=True):
        to_t, to_r = tx.centre - x, rx.centre - x
        c_t, c_r = unit(to_t) @ n, unit(to_r) @ n
        if c_t <= 0.0:
            continue
        forward = -unit(to_t) @ unit(to_r)
        half = unit(to_t) + unit(to_r)
        lobe = np.exp(-(1.0 - (unit(half) @ n) ** 2) / (4.0 * LOBE_RAD**2))
        echo = 0.5 * (c_t + c_r) * lobe if c_r > 0.0 else 0.0
        shadow = c_t * np.clip((forward - 0.45) / 0.3, 0.0, 1.0)
        weights.append(root * (echo + shadow) / np.linalg.norm(to_t) / np.linalg.norm(to_r))
        sent = np.linalg.norm(tx.xyz - x, axis=1) - tx.steered_m
        heard = np.linalg.norm(rx.xyz - x, axis=1) - rx.steered_m
        full = np.exp(-1j * k * (sent[:, None, None] + heard[:, None]))
        blocks = np.zeros(shape, complex)
        for t, a in enumerate(tx.block):
            for r, b in enumerate(rx.block):
                for f, c in enumerate(pair.bands.block):
                    if c >= 0:
                        share = tx.share[a] * rx.share[b] * pair.bands.share[c]
                        blocks[a, b, c] += share * full[t, r, f]
        rows.append(weights[-1] * blocks.ravel())
    kept = np.array(rows)[np.array(weights) > 0.05 * max(weights)]
    return kept.T @ kept.conj()


def mirrored(end: End, axis: int, at_m: float) -> End:
    """Its image in a wall across one of the world's axes; it stays steered as it is."""
    xyz = end.xyz.copy()
    xyz[:, axis] = 2.0 * at_m - xyz[:, axis]
    return end._replace(xyz=xyz, centre=xyz.mean(axis=0))


@pytest.mark.parametrize("pair", [0, 1, 6])
@pytest.mark.parametrize("mirror", [False, True])
def test_the_kernel_is_its_formula(frame, facets, pair: int, mirror: bool) -> None:
    one = pairs_of(frame, CENTRE)[pair]
    rx = mirrored(one.rx, 1, 2.5) if mirror else one.rx
    every = np.ones(len(facets.points), bool)
    images = Images.of([(1, 1, 2.5)]) if mirror else STRAIGHT
    got = np.triu(covariance(one, facets, every, every, LOBE_RAD, images))
    wanted = np.triu(plain(one, facets, one.tx, rx))
    # Arrays are steered at the middle of the band, so echoes from far aside are a little off.
    tolerance = 0.2 if mirror else 0.01
    assert np.abs(got - wanted).max() < tolerance * np.abs(wanted).max()


@pytest.mark.parametrize("least", [0.0, 0.1])
@pytest.mark.parametrize("loud", [0.1, 9.0])
def test_evidence_is_the_density_of_a_normal_vector(loud: float, least: float) -> None:
    rng = np.random.default_rng(1)
    root = rng.normal(size=(12, 5)) + 1j * rng.normal(size=(12, 5))
    y = root @ rng.normal(size=5) + loud * rng.normal(size=12) + 0j
    matrix = root @ root.conj().T
    level = np.trace(matrix).real / 12
    best = -np.inf
    for noise in NOISE_SHARES[NOISE_SHARES > 0.999 * least]:
        shape = matrix / level + noise * np.eye(12)
        scale = (y.conj() @ np.linalg.solve(shape, y)).real / 12
        full = scale * shape
        fit = (y.conj() @ np.linalg.solve(full, y)).real
        best = max(best, -np.linalg.slogdet(full)[1] - fit)
    assert log_evidence(y, np.triu(matrix), least) == pytest.approx(best, rel=1e-6)


def test_silent_pairs_and_unseen_bodies_say_nothing(frame) -> None:
    pair = pairs_of(frame, CENTRE)[0]
    size = len(pair.change)
    assert log_evidence(np.zeros(size, complex), np.eye(size)) == 0.0
    assert log_evidence(pair.change, np.zeros((size, size), np.complex64)) == 0.0
    delta = frame.delta.copy()
    tx, rx = np.nonzero(frame.layout.links_between(*pair.devices))
    delta[tx, rx] = 0.0
    silent = table(replace(frame, delta=delta), [0])
    loud = table(frame, [0])
    names = list(silent)
    assert silent[names[0]].max() == 0.0 != loud[names[0]].max()
    np.testing.assert_array_equal(silent[names[1]], loud[names[1]])


def table(frame: Observations, phases: list[int], heading: float = HEADING) -> dict:
    """Evidence of the mean body at phases of a stride of its own, −1 for standing."""
    figure, walk = explained_by()
    poses = [upright(figure.body) if phase < 0 else walk.poses[phase] for phase in phases]
    return evidence_table(frame, figure, poses, (PLACE[:2], heading), np.zeros((1, 3)), (0.0,))


@cache
def explained_by() -> tuple[Figure, Stride]:
    """The mean body and another stride than the one that is heard."""
    body = people().body(np.zeros(0))
    return figure_of(body), strides(body, 0.9, 1, seed=1)[0]


def test_the_true_phase_and_heading_of_another_body_stand_out(frame) -> None:
    half, quarter = (PHASE + PHASES // 2) % PHASES, (PHASE + PHASES // 4) % PHASES
    log = stacked([table(frame, [PHASE, half, quarter, -1])])[0, :, 0, 0].sum(axis=1)
    assert log[0] > max(log[1:]) + 50.0
    for off in (0.5 * np.pi, np.pi, -0.5 * np.pi):
        turned = stacked([table(frame, [PHASE], HEADING + off)])[0, 0, 0, 0].sum()
        assert log[0] > turned + 50.0


def test_a_common_phase_of_a_pair_changes_nothing(frame) -> None:
    rng = np.random.default_rng(2)
    delta = frame.delta.astype(np.complex128)
    for a, b in frame.pairs[1]:
        own = frame.layout.links_between(a, b)
        delta[own] *= np.exp(2j * np.pi * rng.random()) * rng.uniform(0.1, 10.0)
    turned = replace(frame, delta=delta.astype(np.complex64))
    one, two = (stacked([table(some, [PHASE, -1])]) for some in (frame, turned))
    # A level is no evidence either: entries are taken in units of their root mean square.
    np.testing.assert_allclose(one, two, atol=0.02)


def test_what_is_hidden_has_no_influence(frame) -> None:
    links, subcarriers = frame.links.copy(), frame.subcarriers.copy()
    links[:, frame.layout.rx_column >= 3] = False
    subcarriers[40:48] = False
    hidden = replace(frame, links=links, subcarriers=subcarriers)
    rng = np.random.default_rng(3)
    entries = links[..., None] & subcarriers
    noise = rng.normal(size=frame.delta.shape).astype(np.complex64)
    spoilt = replace(hidden, delta=np.where(entries, frame.delta, noise))
    one, two = (stacked([table(some, [PHASE])]) for some in (hidden, spoilt))
    np.testing.assert_array_equal(one, two)
    assert np.isfinite(one).all() and (one != stacked([table(frame, [PHASE])])).any()


def test_images_count_that_lead_no_more_than_six_metres_astray(frame) -> None:
    middle = np.array([1.2, 2.1, 1.0])
    for pair in pairs_of(frame, CENTRE):
        wanted = []
        for axis, at_m in ((0, -2.0), (0, 9.0), (1, -7.5), (1, 4.5), (2, 0.0), (2, 2.4)):
            for which, end in enumerate((pair.tx, pair.rx)):
                there = mirrored(end, axis, at_m).centre
                longer_m = np.linalg.norm(there - middle) - np.linalg.norm(end.centre - middle)
                wanted += [(which, axis, at_m)] if longer_m <= 6.0 else []
        assert 0 < len(wanted) < 12
        got = images_of(pair, np.array([[-2.0, -7.5, 0.0], [9.0, 4.5, 2.4]]), middle)
        assert list(zip(*got, strict=True)) == wanted


def test_a_wall_sends_what_images_of_the_ends_send(frame) -> None:
    pair = pairs_of(frame, CENTRE)[1]
    body = people().body(np.zeros(0))
    there = posed(figure_of(body), upright(body).moved(PLACE), [pair])
    # One wall is near; what the others send comes too late to count.
    bounds_m = np.array([[-60.0] * 3, [60.0, 2.5, 60.0]])
    few = there.facets.thinned(8)
    every = np.ones(len(few.points), bool)
    images = (
        pair._replace(tx=mirrored(pair.tx, 1, 2.5)),
        pair._replace(rx=mirrored(pair.rx, 1, 2.5)),
    )
    wanted = sum(covariance(image, few, every, every, LOBE_RAD) for image in images)
    got = by_bounces(there.facets, pair, images_of(pair, bounds_m, CENTRE))
    assert np.abs(got).max() > 0.0
    np.testing.assert_allclose(got, wanted, atol=1e-6 * np.abs(wanted).max())
    assert np.trace(direct(there, pair, np.zeros(3))).real > 0.0
