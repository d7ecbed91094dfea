# SPDX-License-Identifier: Apache-2.0
"""Limbs of a stream: Gaussians lie on the skin of who walks, and keep their places on it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import KDTree
from walking import Walker

from rfgs_core.cli.live import LiveArgs, _limbs
from rfgs_core.limbs.network import LimbNetwork
from rfgs_core.limbs.weights import own_network
from rfgs_core.live.cloud import Cloud, live_config
from rfgs_core.live.limbs import LiveLimbs
from rfgs_core.live.replay import Replay, recorded_dataset

COUNT = 150
CONFIG = live_config(bodies=1, gaussians=COUNT)


@pytest.fixture(scope="module")
def walker() -> Walker:
    return Walker("walk", seed=1)


@pytest.fixture(scope="module")
def network(walker: Walker) -> LimbNetwork:
    trained = own_network(walker.freq_hz)
    assert trained is not None
    return trained.network


def test_gaussians_lie_nearer_to_the_skin_than_without(walker: Walker, network) -> None:
    away_m = {}
    for words, limbs in (("moved", None), ("posed", LiveLimbs(network, COUNT))):
        cloud = Cloud(CONFIG, limbs=limbs)
        for time_s in np.arange(4) * 0.08:
            state = cloud.update(walker.heard(float(time_s)))
        assert state is not None and len(state.gaussians.means) == COUNT
        assert float(state.gamma.abs().max()) > 0.0
        means = state.gaussians.means.numpy()
        away_m[words] = float(KDTree(walker.skin(0.24)).query(means)[0].mean())
    assert away_m["posed"] < 0.6 * away_m["moved"]
    assert away_m["posed"] < 0.08


def test_joints_are_averaged_over_windows(walker: Walker, network) -> None:
    limbs, cloud = LiveLimbs(network, COUNT), Cloud(CONFIG)
    seen = walker.heard(0.0)
    state = cloud.update(seen)
    assert state is not None
    limbs.on_skins(seen, state.tracks)
    first = limbs.joints
    assert first is not None
    error = np.linalg.norm(first[0, :, :2] + state.tracks.axes_xy[0] - walker.joints(0.0)[:, :2])
    assert error / np.sqrt(17) < 0.3
    # The same window again, at once and much later: nothing new is said.
    for later_s in (0.0, 9.0):
        limbs.on_skins(seen, replace(state.tracks, time_s=later_s))
        assert limbs.joints is not None
        np.testing.assert_allclose(limbs.joints, first, atol=1e-6)


def test_a_whole_fit_does_not_take_the_skins_away(walker: Walker, network) -> None:
    cloud = Cloud(CONFIG, limbs=LiveLimbs(network, COUNT))
    state = cloud.update(walker.heard(0.0))
    assert state is not None
    means = state.gaussians.means + 1.0
    cloud.take(replace(state, gaussians=replace(state.gaussians, means=means)))
    assert cloud.state is state


def test_radios_without_a_network_have_no_limbs(tiny_dataset: Path) -> None:
    setting = Replay(recorded_dataset(tiny_dataset, None, None, "complex")).setting
    assert _limbs(LiveArgs(), setting) is None
    own = replace(setting, freq_hz=Walker().freq_hz)
    assert _limbs(LiveArgs(), own) is not None
    assert _limbs(LiveArgs(limbs="off"), own) is None
    assert _limbs(LiveArgs(observe="power"), own) is None
