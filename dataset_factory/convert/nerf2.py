# SPDX-License-Identifier: Apache-2.0
"""NeRF2's spectrum layout (Zhao et al. 2023), one folder per receiving device ("gateway").

`spectrum/00001.png` is a grey picture of 90 × 360 px: power over elevation 1 to 90° (rows) and
azimuth 1 to 360° (columns) in the gateway's axes, whose z is the array's boresight, scaled to the
strongest direction; `tx_pos.csv` holds the transmitter of each picture, `gateway_info.yml` the
gateway's place and orientation (quaternion, w last), and two lists name the pictures of the split.
Levels, frames and times, which that layout leaves out, stand in `samples.csv`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation
from tqdm import tqdm

from dataset_factory.scene.bundle import sanitised
from rfgs_core.dataset import Sequence
from rfgs_core.dataset.pictures import write_png
from rfgs_core.errors import RfgsError
from rfgs_core.files import write_text
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.layout import rotation
from rfgs_core.radio.levels import decibels

ELEVATIONS, AZIMUTHS = 90, 360
#: Device axes (x boresight, y, z up) in columns of the gateway's x, y and z.
_DEVICE_FROM_GATEWAY = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def write(sequence: Sequence, out: Path) -> None:
    """Writes `RADIO/DEVICE/…` for every receiving device with at least two elements.

    Raises:
        RfgsError: No device has an array, or antennas move within a frame.
    """
    written = 0
    for radio in sequence.radios:
        layout = sequence.layout(radio)
        if sequence.radio(radio)["rx_xyz"].ndim != 2:
            raise RfgsError(f"{sequence.name}, {radio}: antennas move, a gateway stands still")
        folders: set[str] = set()
        for number, device in enumerate(sequence.devices(radio)):
            folder = sanitised(device.name)
            folder = f"{folder}_{number}" if folder in folders or not folder else folder
            folders.add(folder)
            elements = np.flatnonzero(layout.rx_device == number)
            if len(elements) >= 2 and layout.measured[:, elements].any():
                _write_gateway(sequence, radio, number, out / radio / folder)
                written += 1
    if not written:
        raise RfgsError(f"{sequence.name}: no receiving device has two elements, so no spectra")


def gateway_axes(sequence: Sequence, radio: str, number: int) -> np.ndarray:
    """Rotation world_from_gateway (3, 3); the gateway's z is the device's boresight."""
    return rotation(sequence.devices(radio)[number].quat_wxyz) @ _DEVICE_FROM_GATEWAY


def directions() -> np.ndarray:
    """Unit vectors in the gateway's axes (elevation, azimuth, 3)."""
    up = np.deg2rad(np.arange(1, ELEVATIONS + 1))[:, None]
    around = np.deg2rad(np.arange(1, AZIMUTHS + 1))[None]
    parts = (np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up) + 0 * around)
    return np.stack(parts, axis=-1)


def _write_gateway(sequence: Sequence, radio: str, number: int, out: Path) -> None:
    layout, spec = sequence.layout(radio), sequence.radio_spec(radio)
    elements = np.flatnonzero(layout.rx_device == number)
    axes, centre = gateway_axes(sequence, radio, number), layout.rx_xyz[elements].mean(axis=0)
    local = (layout.rx_xyz[elements] - centre) @ axes
    # A wave from direction u reaches an element at r earlier by r·u.
    turn = 2 * np.pi * spec.centre_hz / SPEED_OF_LIGHT * (directions().reshape(-1, 3) @ local.T)
    steering = np.exp(-1j * turn).astype(np.complex64) / len(elements)
    positions, rows, split = [], [], {"train": [], "test": []}
    test_frames = sequence.splits["images"]["test_frames"]
    senders = np.flatnonzero(layout.measured[:, elements].any(axis=1))
    for frame in tqdm(sequence.frames, desc=out.name, unit="frame"):
        csi = sequence.csi(radio, frame)
        for tx in senders:
            beams = steering @ csi[tx, elements]
            power = (np.abs(beams) ** 2).mean(axis=1).reshape(ELEVATIONS, AZIMUTHS)
            positions.append("{:.6f},{:.6f},{:.6f}\n".format(*layout.tx_xyz[tx]))
            name = f"{len(positions):05d}"
            top = power.max()
            pixels = np.rint(255 * power / top) if top > 0 else np.zeros_like(power)
            write_png(out / "spectrum" / f"{name}.png", pixels.astype(np.uint8))
            level_db = decibels(float(top))
            rows.append(f"{name},{frame},{sequence.time_s(frame):.6f},{tx},{level_db:.3f}\n")
            split["test" if frame in test_frames else "train"].append(f"{name}\n")
    write_text(out / "tx_pos.csv", "x,y,z\n" + "".join(positions))
    write_text(out / "samples.csv", "name,frame,time_s,tx,strongest_db\n" + "".join(rows))
    for name, lines in split.items():
        write_text(out / f"{name}_index.txt", "".join(lines))
    place = ", ".join(f"{value:.6f}" for value in centre)
    turn = ", ".join(f"{value:.9f}" for value in Rotation.from_matrix(axes).as_quat())
    text = f"gateway1:\n  position: [{place}]\n  orientation: [{turn}]\n"
    write_text(out / "gateway_info.yml", text)
