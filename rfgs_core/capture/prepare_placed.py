# SPDX-License-Identifier: Apache-2.0
"""Captures that tell where their antennas were: tables of receivers, and synthetic apertures."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from rfgs_core.capture.channels import Channels, channels_of
from rfgs_core.capture.model import Capture
from rfgs_core.capture.prepared import Prepared, bounds_around, guess, scale_to_free_space
from rfgs_core.errors import RfgsError
from rfgs_core.radio import DevicePose, Radio
from rfgs_core.radio.constants import SPEED_OF_LIGHT

#: Transmitter beside its receiver in a radar, across the line of sight: it changes no distance
#: by more than a nanometre at the ranges of an aircraft [m].
_RADAR_SPACING_M = 0.001
#: Half the side of the scene around an aperture's centre [m].
_APERTURE_SCENE_M = 50.0


def tells_places(capture: Capture) -> bool:
    """Whether a capture needs no layout."""
    return capture.tx_xyz is not None and capture.rx_xyz is not None


def prepare_placed(capture: Capture, scene: str) -> Prepared:
    """Makes a capture with places ready for a dataset.

    Args:
        capture: What a reader gave.
        scene: Name of the scene and the sequence.

    Raises:
        RfgsError: Transmitter and receiver both move, which no radio of ours does.
    """
    tx, rx = capture.tx_xyz, capture.rx_xyz
    if tx is None or rx is None:
        raise RfgsError(f"{capture.source}: this capture tells no places; give --layout")
    if np.array_equal(tx, rx):
        return _aperture(capture, tx, scene)
    if (tx != tx[0]).any():
        raise RfgsError(
            f"{capture.source}: transmitter and receiver both move; expected one that stands still"
        )
    return _table(capture, tx[0], rx, scene)


def _table(capture: Capture, tx: np.ndarray, rx: np.ndarray, scene: str) -> Prepared:
    """One transmitter and a receiving device at each place, in one frame."""
    channels = channels_of(capture)
    radio = _one_element(
        channels,
        name="radio",
        tx_offset_m=(0.0, 0.0, 0.0),
        own_device_links="excluded",
        num_devices=1 + len(rx),
    )
    still = (1.0, 0.0, 0.0, 0.0)
    devices = [DevicePose("tx", _point(tx), still, "TRANSMITTER")]
    devices += [
        DevicePose(f"rx{number:04d}", _point(place), still, "RECEIVER")
        for number, place in enumerate(rx)
    ]
    csi = channels.values[:, 0, 0][None, None, None]
    distance_m = float(np.median(np.linalg.norm(rx - tx, axis=1)))
    scale = scale_to_free_space(csi, radio.centre_hz, distance_m)
    reason = "one frame holds a table of places"
    return Prepared(
        scene=scene,
        radio=radio,
        devices=devices,
        csi=csi * np.float32(scale),
        static=csi[0] * np.float32(scale),
        measured=channels.measured,
        bounds_m=bounds_around([device.position_m for device in devices]),
        fps=1.0,
        guesses=[
            guess("radio", "csi_static", "the capture itself", reason),
            guess("radio", "level", scale, "cards report their own units"),
        ],
        packet_arrays={"scale": np.array(scale), "measured_subcarriers": channels.measured},
    )


def _one_element(channels: Channels, **fields: Any) -> Radio:
    """A radio of one element each way over the band of some channels, with further fields."""
    half = 0.5 * channels.spacing_hz
    return Radio(
        freq_min_hz=float(channels.freq_hz[0] - half),
        freq_max_hz=float(channels.freq_hz[-1] + half),
        num_subcarriers=len(channels.measured),
        tx_rows=1,
        tx_cols=1,
        rx_rows=1,
        rx_cols=1,
        **fields,
    )


def _aperture(capture: Capture, places: np.ndarray, scene: str) -> Prepared:
    """One radar that takes a pulse at each place, in one frame."""
    channels = channels_of(capture)
    pulses = len(places)
    radio = _one_element(
        channels,
        name="sar_capture",
        tx_offset_m=(0.0, _RADAR_SPACING_M, 0.0),
        own_device_links="only",
        placement="circle",
        num_devices=1,
        samples_per_frame=pulses,
        antennas_move=True,
    )
    csi = channels.values[:, 0, 0].astype(np.complex128)
    distance_m = capture.packets.get("centre_distance_m", np.zeros(pulses))
    # Phases count from the centre of the scene; ours count from the antenna.
    cycles = 2.0 * distance_m[:, None] / SPEED_OF_LIGHT * channels.freq_hz
    csi = (csi * np.exp(-2j * np.pi * (cycles % 1.0))).astype(np.complex64)
    scale = scale_to_free_space(csi, radio.centre_hz, 2.0 * float(np.median(distance_m)))
    csi = csi[None, :, None, None] * np.float32(scale)
    edge = np.full(3, _APERTURE_SCENE_M)
    reason = "the file does not tell"
    return Prepared(
        scene=scene,
        radio=radio,
        devices=[
            DevicePose(f"pulse{number:04d}", _point(place), _facing(-place), "ACCESS_POINT")
            for number, place in enumerate(places)
        ],
        csi=csi,
        static=np.zeros_like(csi[0]),
        measured=channels.measured,
        bounds_m=np.stack([-edge, edge]),
        fps=1.0,
        guesses=[
            guess("sar_capture", "csi_static", "zero", "there is no capture of an empty scene"),
            guess(scene, "bounds", f"{_APERTURE_SCENE_M:g} m around the centre", reason),
            guess("sar_capture", "level", scale, "radars report their own units"),
        ],
        packet_arrays={
            "scale": np.array(scale),
            "centre_distance_m": distance_m,
            "measured_subcarriers": channels.measured,
        },
    )


def _facing(way: np.ndarray) -> tuple[float, float, float, float]:
    """Rotation that turns local +X to a direction and keeps local +Y level, w first."""
    forward = way / np.linalg.norm(way)
    left = np.cross([0.0, 0.0, 1.0], forward)
    left = left / np.linalg.norm(left) if np.linalg.norm(left) > 1e-9 else np.array([0.0, 1.0, 0.0])
    matrix = np.stack([forward, left, np.cross(forward, left)], axis=1)
    x, y, z, w = Rotation.from_matrix(matrix).as_quat()
    return float(w), float(x), float(y), float(z)


def _point(place: np.ndarray) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in place)
    return x, y, z
