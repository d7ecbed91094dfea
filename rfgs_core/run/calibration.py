# SPDX-License-Identifier: Apache-2.0
"""Calibrations of a run on disk: one file per frame, written before the frame is fitted."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rfgs_core.arrays import Shape, load_arrays, save_arrays
from rfgs_core.dataset import Sequence
from rfgs_core.errors import RfgsError
from rfgs_core.fit.calibrate import Calibration
from rfgs_core.measure.offsets import Offsets
from rfgs_core.run.config import REMEDY
from rfgs_core.settings import TrainConfig

_SHAPES: dict[str, Shape] = {
    "capture_phase_rad": ("device",),
    "capture_delay_s": ("device",),
    "drift_phase_rad": ("device",),
    "drift_delay_s": ("device",),
}


def need_shared_links(sequence: Sequence, radio: str, config: TrainConfig) -> None:
    """Refuses to calibrate what has no offsets, or does not report them.

    Raises:
        RfgsError: All links stay within a device, or the radio reports no phases.
    """
    if config.calibrate == "none":
        return
    if config.observe != "complex":
        raise RfgsError(
            f"--calibrate {config.calibrate}: expected the phases that --observe complex reports, "
            f"found --observe {config.observe}; leave one of them out"
        )
    if all(a == b for a, b in sequence.layout(radio).device_pairs):
        raise RfgsError(
            f"--calibrate {config.calibrate}: all links of {radio} stay within a device, whose "
            "clock cancels, so there is nothing to calibrate; leave --calibrate out"
        )


def calibration_path(run: Path, frame: int) -> Path:
    """File of a frame's calibration."""
    return run / "calibration" / f"{frame:06d}.npz"


def write_calibration(run: Path, frame: int, calibration: Calibration) -> None:
    """Keeps a frame's calibration."""
    arrays = {
        f"{name}_{field}": getattr(offsets, field)
        for name, offsets in (("capture", calibration.capture), ("drift", calibration.drift))
        for field in ("phase_rad", "delay_s")
    }
    save_arrays(calibration_path(run, frame), arrays)


def read_calibration(run: Path, frame: int) -> Calibration:
    """A frame's calibration.

    Raises:
        RfgsError: The frame has none.
        RfgsFormatError: The file is damaged.
    """
    path, types = calibration_path(run, frame), dict.fromkeys(_SHAPES, "f8")
    arrays = load_arrays(path, REMEDY, _SHAPES, types=types)
    return Calibration(
        capture=Offsets(arrays["capture_phase_rad"], arrays["capture_delay_s"]),
        drift=Offsets(arrays["drift_phase_rad"], arrays["drift_delay_s"]),
    )


def calibration_text(run: Path, frames: list[int]) -> str:
    """The offsets of a run in words, relative to device 0."""
    parts = [read_calibration(run, frame) for frame in frames]
    rows = [
        f"device {device}: {np.rad2deg(phase):.1f}°, {delay * 1e9:.3f} ns"
        for device, (phase, delay) in enumerate(
            zip(parts[0].capture.phase_rad, parts[0].capture.delay_s, strict=True)
        )
        if device
    ]
    phase = max(float(np.abs(part.drift.phase_rad).max()) for part in parts)
    delay = max(float(np.abs(part.drift.delay_s).max()) for part in parts)
    return (
        f"against device 0, {', '.join(rows)}; frames differ from the empty room by up to "
        f"{np.rad2deg(phase):.1f}° and {delay * 1e9:.3f} ns"
    )
