# SPDX-License-Identifier: Apache-2.0
"""MATLAB: one `.mat` file (version 5, compressed) per radio, with labels."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from rfgs_core.dataset import Sequence
from rfgs_core.dataset.impaired_store import has_impaired
from rfgs_core.errors import RfgsError
from rfgs_core.files import replacing

#: Version 5 of the format holds variables below this size [bytes].
LARGEST_BYTES = 2**31


def write(sequence: Sequence, out: Path) -> None:
    """Writes `RADIO.mat`; names, axes and units are those of the dataset.

    Raises:
        RfgsError: A radio's channels do not fit the format.
    """
    from scipy.io import savemat

    labels = _labels(sequence)
    for radio in sequence.radios:
        data = sequence.radio(radio)
        if data["csi"].nbytes >= LARGEST_BYTES:
            raise RfgsError(
                f"{sequence.files.csi(radio)}: {data['csi'].nbytes / 2**30:.1f} GiB of channels, "
                "a .mat file takes 2; read the Zarr store, or convert fewer frames"
            )
        values: dict[str, Any] = {name: data[name].values for name in sorted(map(str, data.coords))}
        values["csi"] = _all(sequence, radio, impaired=False)
        values["csi_static"] = sequence.csi_static_samples(radio)
        if has_impaired(sequence.files.csi(radio)):
            values["csi_impaired"] = _all(sequence, radio, impaired=True)
        with replacing(out / f"{radio}.mat") as temporary:
            savemat(temporary, {**values, **labels}, do_compression=True, oned_as="column")
            with temporary.open("r+b") as stream:
                # The text of the header, which scipy fills with the time of writing.
                stream.write(b"MATLAB 5.0 MAT-file, written by rfgs-factory".ljust(116))


def _all(sequence: Sequence, radio: str, *, impaired: bool) -> np.ndarray:
    """Channels of all samples (time, tx, rx, subcarrier), each checked against its digest."""
    frames = tqdm(sequence.frames, desc=radio, unit="frame")
    return np.concatenate([sequence.csi_samples(radio, f, impaired=impaired) for f in frames])


def _labels(sequence: Sequence) -> dict[str, Any]:
    """Joints and velocities (frame, person, 17, 3), actions (frame, person), if they are there."""
    if not sequence.files.geometry(sequence.frames[0]).is_file():
        return {}
    actions = [sequence.actions(frame) for frame in sequence.frames]
    return {
        "label_frame": np.array(sequence.frames),
        "joints_m": np.stack([sequence.joints(frame) for frame in sequence.frames]),
        "segment_velocity_m_s": np.stack([sequence.segment_velocity(f) for f in sequence.frames]),
        "person_instance": np.stack([sequence.people(frame) for frame in sequence.frames]),
        "action": np.array(actions, dtype=object),
    }
