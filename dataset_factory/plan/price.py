# SPDX-License-Identifier: Apache-2.0
"""What a dataset takes, from the speed of jobs like it on this machine."""

from __future__ import annotations

from dataclasses import dataclass

from dataset_factory.plan.disk import gigabytes
from dataset_factory.plan.speed_cache import Recalled


@dataclass(frozen=True)
class Estimate:
    """What a dataset will take."""

    frames: int
    """Frames."""
    cameras: int
    """Cameras."""
    seconds: dict[str, float]
    """Wall time by stage [s]."""
    disk_bytes: float
    """Disk [B]."""
    measured_now: bool
    """Whether frames were made for it, not remembered."""


def scaled(known: Recalled, frames: int, measured_now: bool) -> Estimate:
    """What so many frames take, all stages, at a speed that is known."""
    seconds = {}
    for name, speed in known.speeds.items():
        if name == "render":
            # Blender starts once more for the empty room.
            pictures = known.cameras * (frames + 1)
            seconds[name] = speed.seconds(pictures) + speed.start_s
        else:
            seconds[name] = speed.seconds(frames + 1 if name.startswith("trace") else frames)
    seconds["write"] = known.rest_s * frames
    return Estimate(frames, known.cameras, seconds, known.space.bytes(frames), measured_now)


def price_line(
    known: Recalled | None, frames: int, cameras: int, radios: int, disk_bytes: float
) -> str:
    """One line before a dataset is made: how much of what, and what would be less.

    Args:
        known: What is remembered of jobs like this one, if anything.
        frames: Frames of the dataset.
        cameras: Cameras whose pictures are rendered; 0 without pictures.
        radios: Radios that are traced.
        disk_bytes: Disk that is needed, at most [B].
    """
    what = f"{frames} frames of {radios} radio{'s' * (radios > 1)}"
    what += f", {cameras * (frames + 1)} pictures" if cameras else ", no pictures"
    time = "how long is known after the first frames (or ask `rfgs-factory plan`)"
    if known is not None:
        total = sum(scaled(known, frames, False).seconds.values())
        time = f"about {minutes(total)} from the start, as measured here before"
    less = "fewer --frames" + (", --cameras" * bool(cameras)) + " or --depth 1 make it less"
    return f"{what}; at most {gigabytes(disk_bytes)}; {time}; {less}"


def minutes(seconds: float) -> str:
    """A time in words."""
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 6000.0 else f"{seconds / 3600.0:.1f} h"
