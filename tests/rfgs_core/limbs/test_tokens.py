# SPDX-License-Identifier: Apache-2.0
"""A network sees the same of a world that is turned, mirrored or listed in another order."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from rfgs_core.encode.body_maps import ArrayEnd, View
from rfgs_core.limbs.network import LimbNetwork
from rfgs_core.limbs.tokens import Packed, Tokens, mirrored_joints, pack, relative_power, tokens
from rfgs_core.skeleton import JOINTS

CENTRE = np.array([0.3, -0.2, 0.95])


def view(pair: tuple[int, int], tx: list[float], rx: list[float], yaw: float) -> View:
    """A pair of arrays whose x axis points to `yaw`."""
    y = np.array([-np.sin(yaw), np.cos(yaw), 0.0])
    axes = np.stack([y, [0.0, 0.0, 1.0]])
    line = np.linspace(-0.1, 0.1, 4)
    up, across = (np.stack(pair, 1) for pair in ((0 * line, line), (line, 0 * line)))
    return View(pair, ArrayEnd(np.array(tx), axes, up), ArrayEnd(np.array(rx), axes, across))


def world(seed: int = 0) -> tuple[list[View], np.ndarray, np.ndarray]:
    """Three pairs and their maps."""
    rng = np.random.default_rng(seed)
    views = [
        view((0, 0), [2.0, 1.0, 1.2], [2.0, 1.05, 1.2], 3.5),
        view((1, 1), [-2.0, 1.5, 2.2], [-2.0, 1.55, 2.2], -0.6),
        view((2, 2), [-1.5, -2.0, 0.6], [-1.5, -1.95, 0.6], 0.9),
    ]
    return views, rng.uniform(0.01, 1.0, (3, 7, 5, 48)).astype(np.float32), CENTRE


def turned(world: tuple, angle: float) -> tuple:
    """The whole world turned around z."""
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    views, maps, centre = world

    def end(one: ArrayEnd) -> ArrayEnd:
        return ArrayEnd(turn @ one.centre, one.axes @ turn.T, one.offsets)

    return [View(v.pair, end(v.tx), end(v.rx)) for v in views], maps, turn @ centre


def mirrored(world: tuple) -> tuple:
    """The world in a mirror at y = 0, whose arrays again have their y axis to the left."""
    flip = np.array([1.0, -1.0, 1.0])
    views, maps, centre = world

    def end(one: ArrayEnd) -> ArrayEnd:
        axes = one.axes * flip
        axes[0] *= -1.0
        return ArrayEnd(one.centre * flip, axes, one.offsets * [-1.0, 1.0])

    return [View(v.pair, end(v.tx), end(v.rx)) for v in views], maps[:, :, ::-1], centre * flip


def seen(packed: Packed, reference: int = 0, mirror: bool = False) -> Tokens:
    return tokens(
        packed,
        relative_power(packed),
        packed.there,
        torch.tensor([reference]),
        torch.tensor([mirror]),
    )


def test_a_turned_world_reads_the_same() -> None:
    one, two = (seen(pack([some], 4)) for some in (world(), turned(world(), 1.1)))
    torch.testing.assert_close(one.geometry, two.geometry, atol=1e-5, rtol=0)
    torch.testing.assert_close(one.maps, two.maps)
    assert float(two.yaw - one.yaw) == pytest.approx(1.1, abs=1e-5)


def test_a_mirror_is_a_mirrored_world() -> None:
    """Seen in a mirror, the world reads as the mirrored world does plainly."""
    one = seen(pack([world()], 4), mirror=True)
    two = seen(pack([mirrored(world())], 4))
    torch.testing.assert_close(one.maps, two.maps)
    torch.testing.assert_close(one.geometry, two.geometry, atol=1e-5, rtol=0)


def test_mirrored_joints_swap_sides() -> None:
    joints = torch.zeros(2, len(JOINTS), 3)
    joints[:, JOINTS.index("left_wrist")] = torch.tensor([1.0, 2.0, 3.0])
    got = mirrored_joints(joints, torch.tensor([True, False]))
    assert got[0, JOINTS.index("right_wrist")].tolist() == [1.0, -2.0, 3.0]
    assert got[1, JOINTS.index("left_wrist")].tolist() == [1.0, 2.0, 3.0]


def test_padding_and_order_change_nothing() -> None:
    torch.manual_seed(0)
    network = LimbNetwork(48).eval()
    views, maps, centre = world()
    order = [2, 0, 1]
    swapped = ([views[k] for k in order], maps[order], centre)
    with torch.no_grad():
        plain, _ = network(seen(pack([world()], 3)))
        padded, _ = network(seen(pack([world()], 9)))
        other, _ = network(seen(pack([swapped], 3), reference=1))
    torch.testing.assert_close(plain, padded, atol=1e-5, rtol=1e-4)
    torch.testing.assert_close(plain, other, atol=1e-5, rtol=1e-4)


def test_a_silent_pair_is_no_pair() -> None:
    views, maps, centre = world()
    maps = maps.copy()
    maps[1] = 0.0
    packed = pack([(views, maps, centre)], 4)
    assert packed.there.tolist() == [[True, False, True, False]]


def test_maps_keep_their_power_to_a_tenth_of_a_decibel() -> None:
    _, maps, _ = world()
    packed = pack([world()], 3)
    power = (relative_power(packed)[0] * 10.0 ** packed.level[0][:, None, None, None]).numpy()
    np.testing.assert_allclose(10 * np.log10(power / maps), 0.0, atol=0.101)
