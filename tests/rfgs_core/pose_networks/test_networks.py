# SPDX-License-Identifier: Apache-2.0
"""Pose networks: what they may not depend on, that they learn, and what they refuse."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
import torch

from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.pose_networks.cloud import FEATURES
from rfgs_core.pose_networks.cloud_network import CloudNetwork
from rfgs_core.pose_networks.learn import (
    Training,
    as_heard,
    asked,
    errors,
    split,
    train,
    turned,
)
from rfgs_core.pose_networks.lessons import Lessons, Part, lessons
from rfgs_core.pose_networks.picture_network import PictureNetwork
from rfgs_core.threads import one_torch_thread


@pytest.fixture(autouse=True)
def one_thread() -> Iterator[None]:
    with one_torch_thread():
        yield


def clips(count: int, frames: int = 3, points: int = 20) -> Lessons:
    """Clouds around poses of chance."""
    generator = torch.Generator().manual_seed(1)
    joints = torch.randn(count, frames, 17, 3, generator=generator) * 0.3
    near = joints[:, :, torch.arange(points) % 17]
    more = torch.randn(count, frames, points, FEATURES - 3, generator=generator) * 0.1
    return Lessons(
        (torch.cat([near, more], -1), torch.ones(count, frames, points, dtype=torch.bool)), joints
    )


def networks() -> CloudNetwork:
    torch.manual_seed(0)
    return CloudNetwork().eval()


def test_the_order_of_points_changes_nothing() -> None:
    (points, there), _ = clips(2)
    there[:, :, 15:] = False
    order = torch.randperm(points.shape[2], generator=torch.Generator().manual_seed(3))
    said = asked(networks(), (points, there))
    swapped = asked(networks(), (points[:, :, order], there[:, :, order]))
    torch.testing.assert_close(said, swapped, atol=1e-5, rtol=0.0)
    # Padding is nothing, whatever it holds.
    points[:, :, 15:] = 7.0
    torch.testing.assert_close(asked(networks(), (points, there)), said, atol=1e-5, rtol=0.0)


def test_later_frames_change_nothing_before() -> None:
    (points, there), _ = clips(1, frames=5)
    said = asked(networks(), (points, there))
    points[:, 3:] += 0.5
    other = asked(networks(), (points, there))
    torch.testing.assert_close(said[:, :3], other[:, :3], atol=1e-6, rtol=0.0)
    assert float((said[:, 3:] - other[:, 3:]).abs().max()) > 1e-4
    # And earlier ones are remembered.
    points[:, 0] -= 0.5
    assert float((asked(networks(), (points, there)) - other)[:, 1:].abs().max()) > 1e-4


def test_points_of_a_few_clips_are_learnt() -> None:
    known, network = clips(2), networks()
    before = errors(asked(network, known.inputs), known.joints)["joints_m"]
    train(network, known, Training(passes=60, batch=2, rate=3e-3), as_heard)
    assert errors(asked(network, known.inputs), known.joints)["joints_m"] < 0.75 * before


def heard(count: int) -> Lessons:
    """Pictures that say where joints are."""
    generator = torch.Generator().manual_seed(2)
    pictures = torch.randn(count, 6, 12, generator=generator)
    turn = torch.randn(12, 3, generator=generator) * 0.2
    joints = (pictures.mean(1) @ turn)[:, None].expand(-1, 17, -1) + torch.rand(17, 3)
    return Lessons((pictures.half(),), joints)


def test_amplitudes_of_some_frames_are_learnt() -> None:
    torch.manual_seed(0)
    known = heard(32)
    network = PictureNetwork.fitting(known)
    begun = errors(asked(network, known.inputs), known.joints)["joints_m"]
    mean = errors(known.joints.mean(0).expand_as(known.joints), known.joints)["joints_m"]
    assert begun == pytest.approx(mean, rel=1e-5)
    train(network, known, Training(passes=40, batch=32), as_heard)
    assert errors(asked(network, known.inputs), known.joints)["joints_m"] < 0.6 * mean


def test_what_networks_cannot_read_is_refused() -> None:
    (points, there), _ = clips(1)
    with pytest.raises(RfgsError, match=r"points of shape \(1, 3, 20, 4\)"):
        CloudNetwork()(points[..., :4], there)
    with pytest.raises(RfgsError, match="serves the one layout it was trained with"):
        PictureNetwork(6, 12)(torch.zeros(2, 5, 12))


def test_a_turn_moves_points_and_joints_alike() -> None:
    known = clips(4)
    # Points lie on the joints of the same number; a mirror swaps the sides of joints.
    moved = turned(known, torch.Generator().manual_seed(0))
    for (points, _), joints in ((known.inputs, known.joints), (moved.inputs, moved.joints)):
        assert float(torch.cdist(points[..., :3], joints).amin(-1).max()) < 1e-3
    assert float((moved.joints - known.joints).abs().max()) > 0.1
    torch.testing.assert_close(moved.joints[..., 2].sum(-1), known.joints[..., 2].sum(-1))


class Stopped(Exception):
    """Somebody has had enough."""


def test_a_training_that_was_stopped_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rfgs_core.pose_networks.learn._KEPT", 3)
    known, path, training = clips(2), tmp_path / "network.safetensors", Training(4, batch=1)

    def stop(done: int, words: str) -> None:
        if done == 4:
            raise Stopped

    with pytest.raises(Stopped):
        train(networks(), known, training, as_heard, path, stop)
    one, whole, told = networks(), networks(), []
    train(one, known, training, as_heard, path, lambda done, words: told.append(done))
    assert told == [4, 5, 6, 7, 8]
    train(whole, known, training, as_heard)
    for found, wanted in zip(one.parameters(), whole.parameters(), strict=True):
        torch.testing.assert_close(found, wanted, atol=1e-6, rtol=1e-5)


def test_the_last_fifth_of_every_recording_is_judged() -> None:
    joints = torch.arange(20.0)[:, None, None].expand(-1, 17, 3)
    known, judged = split(Lessons((joints,), joints), 10)
    assert judged.joints[:, 0, 0].tolist() == [8.0, 9.0, 18.0, 19.0]
    assert len(known.joints) == 16


def test_parts_are_made_once(tmp_path: Path) -> None:
    made = []

    def stream() -> Iterator[Part]:
        for number in range(9):

            def part(number: int = number) -> Lessons:
                made.append(number)
                return Lessons((torch.full((4, 2), float(number)),), torch.zeros(4, 17, 3))

            yield part

    found = lessons(tmp_path, stream(), 6, lambda count: None)
    assert found.inputs[0][:, 0].tolist() == [0.0] * 4 + [1.0] * 2
    again = lessons(tmp_path, stream(), 10, lambda count: None)
    assert made == [0, 1, 2]
    assert again.inputs[0][:6].equal(found.inputs[0])
    path = tmp_path / "part_0001.safetensors"
    path.write_bytes(path.read_bytes()[:-3])
    with pytest.raises(RfgsFormatError, match=r"part_0001\.safetensors"):
        lessons(tmp_path, stream(), 6, lambda count: None)
