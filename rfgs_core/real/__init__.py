# SPDX-License-Identifier: Apache-2.0
"""Judged on data that nobody here made: each part prints a baseline beside ours."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from rfgs_core.errors import RfgsError

#: Part → its file, or folder of NeRF2's layout, below the data folder.
PARTS = {
    "bedroom": "newrf/dataset_bedroom.mat",
    "bedroom_fields": "newrf/dataset_bedroom.mat",
    "aperture": "sar/data_3dsar_pass1_az001_HH.mat",
    "ranging": "uwb/6.log",
    "breathing": "acconeer/acconeer_a121_presence-medium_range_no_timeout.h5",
    "reflector": "acconeer/acconeer_a121_corner-reflector.h5",
    "walking": "intel5300/walk_post_1597163546.dat",
    "spectra": "nerf2",
}


def bench_real(data: Path, say: Callable[[str], None]) -> dict[str, float | str]:
    """Runs every part whose file is there.

    Args:
        data: Folder laid out as `PARTS` says.
        say: Told what is skipped.

    Returns:
        Figures of the baselines and of ours, by `part_figure`.

    Raises:
        RfgsError: None of the files is there.
    """
    from rfgs_core.real.aperture import judge_aperture
    from rfgs_core.real.bedroom import judge_bedroom
    from rfgs_core.real.bedroom_fields import judge_bedroom_fields
    from rfgs_core.real.radar import judge_breathing, judge_reflector
    from rfgs_core.real.ranging import judge_ranging
    from rfgs_core.real.spectra import judge_spectra
    from rfgs_core.real.walking import judge_walking

    judges: dict[str, Callable[[Path], dict[str, float | str]]] = {
        "bedroom": judge_bedroom,
        "bedroom_fields": judge_bedroom_fields,
        "aperture": judge_aperture,
        "ranging": judge_ranging,
        "breathing": judge_breathing,
        "reflector": judge_reflector,
        "walking": judge_walking,
        "spectra": judge_spectra,
    }
    result: dict[str, float | str] = {}
    for part, judge in judges.items():
        file = data / PARTS[part]
        if not file.exists():
            say(f"{part}: skipped, no {PARTS[part]} in {data}")
            continue
        result |= {f"{part}_{name}": value for name, value in judge(file).items()}
    if not result:
        raise RfgsError(f"{data}: expected some of {', '.join(dict.fromkeys(PARTS.values()))}")
    return result
