# SPDX-License-Identifier: Apache-2.0
"""What stands beside every number: conditions, limits, machine and versions."""

from __future__ import annotations

import os
import platform
from dataclasses import asdict
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

from rfgs_core.evaluate.scene import Scene
from rfgs_core.radio.impairments import Impairments
from rfgs_core.run.calibration import calibration_text

PACKAGES = ("rfgs", "torch", "numpy", "numba", "scipy", "sionna-rt", "mitsuba", "bpy")


def versions() -> dict[str, str]:
    """Versions of what took part and is installed here."""
    found = {"python": platform.python_version()}
    for name in PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return found


def hardware() -> dict[str, Any]:
    """Processor, cores, memory and GPU of this machine."""
    import torch

    return {
        "cpu": _cpu_name(),
        "cores": os.cpu_count(),
        "memory_gib": _memory_gib(),
        "gpu": torch.cuda.get_device_name(0) if torch.cuda.is_available() else None,
        "system": f"{platform.system()} {platform.machine()}",
    }


def _cpu_name() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def _memory_gib() -> float | None:
    try:
        size = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (ValueError, OSError, AttributeError):
        return None
    return round(size / 2**30, 1)


def conditions(scene: Scene) -> dict[str, Any]:
    """How the data came about, as far as it decides what a number means."""
    info = scene.run.sequence.info
    depth = scene.run.sequence.trace_depth(scene.radio.name)
    kind = "clean" if scene.run.channel == "clean" else "impaired"
    if depth <= 1:
        label = (
            f"{kind}, depth 1: single-bounce data fitted with a single-bounce model, an inverse "
            "crime; not a headline result"
        )
    else:
        walls = "one wall bounce" if depth == 2 else f"up to {depth - 1} wall bounces"
        label = f"{kind}, depth {depth}: what people scatter arrives directly and over {walls}"
    return {
        "label": label,
        "impairments": _impairments(scene),
        "calibration": _calibration(scene),
        "shadow": info.shadow,
        "scene": info.scene,
        "sequence": scene.run.sequence.name,
        "radio": scene.radio.name,
        "num_frames": len(scene.run.frames),
        "voxels_predicted": scene.voxels,
        "voxel_m": scene.grid.voxel_m,
        "objective": scene.run.config.settings.objective,
        "observe": scene.observe,
        "packets": _packets(scene),
        "background": scene.background,
        "density": scene.run.config.settings.density,
        "recipe": scene.run.config.settings.recipe,
        "seed": scene.run.config.settings.seed,
        "prior": "the person's position is not given; search is over the whole scene",
    }


def _impairments(scene: Scene) -> str:
    """What imperfect radios did to the channel that was fitted."""
    if scene.run.channel == "clean":
        return "none"
    chosen = asdict(scene.run.sequence.impairments(scene.radio.name).settings)
    plain = asdict(Impairments())
    return ", ".join(f"{name} {chosen[name]}" for name in chosen if chosen[name] != plain[name])


def _packets(scene: Scene) -> str:
    """Which packets of a frame were read."""
    return f"{scene.packets} of {scene.radio.samples_per_frame} per frame"


def _calibration(scene: Scene) -> str:
    """Offsets of devices that were estimated and taken out."""
    if scene.run.config.settings.calibrate == "none":
        return "none"
    return calibration_text(scene.run.path, scene.run.frames)


def limits(scene: Scene) -> dict[str, float | None]:
    """Resolution limits of the radio: c/2B and λR/D [m]."""
    return {
        "range_resolution_m": scene.radio.range_resolution_m,
        "cross_range_m": scene.cross_range_m,
    }


def now() -> str:
    """Date and time in UTC, to the second."""
    return datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
