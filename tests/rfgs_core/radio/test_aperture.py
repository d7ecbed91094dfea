# SPDX-License-Identifier: Apache-2.0
"""A device that moves: its circle, its samples, and what such a radio cannot be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rfgs_core.errors import RfgsError
from rfgs_core.radio import devices_at, frame_samples, layout, place_devices, pose_span_s, preset
from rfgs_core.radio.files import radio_problems
from rfgs_core.radio.layout import rotation

BOUNDS_M = np.array([[-1.0, 0.5, 0.25], [5.0, 4.5, 2.95]])


def test_places_lie_evenly_on_the_largest_circle_and_face_its_middle() -> None:
    devices = place_devices(preset("sar"), BOUNDS_M)
    places = np.array([device.position_m for device in devices])
    assert len({device.name for device in devices}) == len(places) == 180
    away = places - [2.0, 2.5, 0.25]
    # Half of the shorter side less 0.2 m, above heads.
    assert np.allclose(np.linalg.norm(away[:, :2], axis=1), 1.8)
    assert np.allclose(away[:, 2], 2.2)
    steps = np.diff(np.unwrap(np.arctan2(away[:, 1], away[:, 0])))
    assert np.allclose(steps, 2 * np.pi / 180) and np.allclose(away[0, :2], [1.8, 0.0])
    for device, place in zip(devices, away, strict=True):
        boresight, up = rotation(device.quat_wxyz)[:, [0, 2]].T
        assert np.allclose(boresight[:2], -place[:2] / 1.8) and np.allclose(up, [0, 0, 1])


def test_every_sample_is_one_link_of_one_place() -> None:
    radio = preset("sar")
    devices = place_devices(radio, BOUNDS_M)
    samples = frame_samples(radio, 10.0, devices)
    assert samples.antennas_move and len(samples) == 180
    # The scene waits: no pose beside the frame's own is asked for.
    assert not samples.offset_s.any() and pose_span_s(radio) is None
    assert samples.tx_xyz is not None and samples.rx_xyz is not None
    for sample in (0, 77, 179):
        place = layout(radio, devices, sample)
        assert place.measured.shape == (1, 1) and place.measured.all()
        assert devices_at(radio, devices, sample) == [devices[sample]]
        assert np.allclose(place.rx_xyz, devices[sample].position_m)
        assert np.array_equal(samples.tx_xyz[sample], place.tx_xyz)
        assert np.array_equal(samples.rx_xyz[sample], place.rx_xyz)
        assert np.linalg.norm(place.tx_xyz - place.rx_xyz) == pytest.approx(0.1)


def test_places_and_samples_are_equally_many() -> None:
    radio = preset("sar")
    with pytest.raises(RfgsError, match="179 places for 180 samples per frame"):
        frame_samples(radio, 10.0, place_devices(radio, BOUNDS_M)[:-1])
    closet = np.array([[0.0, 0.0, 0.0], [4.0, 0.4, 2.5]])
    with pytest.raises(RfgsError, match="no circle fits into a scene"):
        place_devices(radio, closet)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"own_device_links": "included"}, "own_device_links: included: expected only"),
        ({"num_devices": 2}, "num_devices: 2: expected 1 that moves"),
        ({"sample_interval_s": 1e-3}, "sample_interval_s: 0.001: expected 0"),
    ],
)
def test_impossible_apertures_are_named(changed: dict, said: str) -> None:
    problems = radio_problems(replace(preset("sar"), name="mine", **changed))
    assert len(problems) == 1 and said in problems[0]
