# SPDX-License-Identifier: Apache-2.0
"""Writes a prepared capture as a dataset of ours."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from rfgs_core import __version__
from rfgs_core.arrays import save_arrays
from rfgs_core.capture.prepared import Prepared
from rfgs_core.dataset.csi_store import create_csi, write_csi
from rfgs_core.dataset.names import SequenceFiles
from rfgs_core.dataset.schema import DatasetInfo, SequenceInfo
from rfgs_core.dataset.splits import radio_split
from rfgs_core.dataset.writer import finish_dataset, write_sequence_info
from rfgs_core.errors import RfgsError
from rfgs_core.files import replacing_folder
from rfgs_core.radio import FrameSamples, frame_samples, layout
from rfgs_core.radio.files import radio_values

#: What is kept beside a radio's channels.
CAPTURE_FILE = "capture.npz"


def write_dataset(out: Path, capture: Prepared, config: dict[str, Any]) -> None:
    """Writes a dataset in one step: channels, mean or empty room, devices and guesses.

    Args:
        out: Folder to make.
        capture: What to write.
        config: What was asked for, kept in `dataset.json`.

    Raises:
        RfgsError: `out` holds something already.
    """
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise RfgsError(f"{out}: holds something already; choose another --out")
    with replacing_folder(out) as folder:
        files = SequenceFiles(folder / capture.scene)
        _write_channels(files, capture)
        write_sequence_info(files, _info(capture))
        info = DatasetInfo(
            versions={"rfgs": __version__},
            config=config,
            root_seed=0,
            has=["csi", "csi_static"],
            sequences=[capture.scene],
        )
        finish_dataset(folder, info)


def _write_channels(files: SequenceFiles, capture: Prepared) -> None:
    radio, name = capture.radio, capture.radio.name
    store, frames = files.csi(name), _frames(capture)
    samples: FrameSamples = frame_samples(radio, capture.fps, capture.devices)
    times_s = [(frame - 1) / capture.fps for frame in frames]
    elements = layout(radio, capture.devices)
    create_csi(store, radio, elements, frames, times_s, samples)
    static = capture.static if radio.antennas_move else capture.static[0]
    write_csi(store, None, np.ascontiguousarray(static), files.csi_done(name, None))
    for index, frame in enumerate(frames):
        value = np.ascontiguousarray(capture.csi[index])
        write_csi(store, index, value, files.csi_done(name, frame))
    save_arrays(store.with_name(CAPTURE_FILE), capture.packet_arrays)


def _frames(capture: Prepared) -> list[int]:
    return list(range(1, len(capture.csi) + 1))


def _info(capture: Prepared) -> SequenceInfo:
    radio = capture.radio
    split = radio_split(radio, layout(radio, capture.devices), 0)
    split["unmeasured_subcarriers"] = np.flatnonzero(~capture.measured).tolist()
    return SequenceInfo(
        scene=capture.scene,
        blend_sha256="",
        frames=_frames(capture),
        frame_start=1,
        fps=capture.fps,
        bounds_m=capture.bounds_m.tolist(),
        cameras=[],
        devices={radio.name: [asdict(device) for device in capture.devices]},
        radios={radio.name: radio_values(radio)},
        splits={
            "rf": {radio.name: split},
            "images": {"test_cameras": [], "test_frames": []},
        },
        guesses=capture.guesses,
        shadow="measured",
    )
