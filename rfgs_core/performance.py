# SPDX-License-Identifier: Apache-2.0
"""A page of how fast the kernels are on this machine, beside what they are judged by.

Every number of `docs/performance.md` is measured when the page is made, in one process.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from rfgs_core.bench import PropagationBench, bench_propagation, hardware
from rfgs_core.device import Device, most_held_gib
from rfgs_core.render.bench import (
    Distant,
    Picture,
    bench_raster,
    time_distant,
    time_picture,
)
from rfgs_core.scaling import Growth, growths
from rfgs_core.selftest import OPERATIONS, SPEED, Throughput, throughput

#: Pictures that are timed: Gaussians, edge [px].
PICTURES: dict[Device, tuple[tuple[int, int], ...]] = {
    "cpu": ((100_000, 512), (1_000_000, 512)),
    "cuda": ((100_000, 512), (1_000_000, 512), (1_000_000, 1024), (5_000_000, 1024)),
}
#: Gaussians in a box of 4 × 4 × 2.5 m, and how far from its middle the camera is [m].
DISTANT = tuple((count, far_m) for count in (100_000, 1_000_000) for far_m in (5.0, 50.0, 500.0))
#: What is as large as at most this grows linearly, up to the noise of timing.
_LINEAR = 1.1
#: Share of the time at the largest size that may be fixed for the exponent of the rest to be told.
_MOST_FIXED = 0.5


@dataclass(frozen=True)
class Performance:
    """What one run measured."""

    propagation: dict[str, Any]
    """As of `bench_propagation`."""
    share: Throughput
    """The scattered channel, and the chip's ceiling."""
    raster: dict[str, float]
    """As of `bench_raster`."""
    pictures: tuple[Picture, ...]
    """Of `PICTURES`."""
    distant: tuple[Distant, ...]
    """Of `DISTANT`; not measured on a GPU."""
    memory_gib: float
    """The most memory that this process has held, before and with the pictures [GiB]; on a GPU the
    most of it that was in use there."""
    growths: tuple[Growth, ...]
    """Cost over two decades of size; not measured on a GPU."""
    device: Device
    """Where everything ran."""
    machine: dict[str, str | int]
    """As of `hardware`."""


def measure(
    device: Device = "cpu", note: Callable[[str], None] = lambda words: None
) -> Performance:
    """Measures everything; some five minutes on two cores, one on a GPU.

    Args:
        device: Where kernels run.
        note: Told what is timed next.
    """
    note("propagation, beside its plain twin")
    propagation = bench_propagation(PropagationBench(device=device))
    note("propagation, beside a product of matrices")
    share = throughput(device)
    note("pictures, beside their plain twin")
    raster = bench_raster(device=device)
    pictures = []
    for count, size_px in PICTURES[device]:
        note(f"a picture of {count} Gaussians")
        pictures.append(time_picture(count, size_px, device=device))
    distant = []
    for count, distance_m in DISTANT if device == "cpu" else ():
        note(f"a picture of {count} Gaussians, {distance_m:g} m away")
        distant.append(time_distant(count, distance_m))
    memory_gib = most_held_gib(device)
    return Performance(
        propagation=propagation,
        share=share,
        raster=raster,
        pictures=tuple(pictures),
        distant=tuple(distant),
        memory_gib=memory_gib,
        growths=growths(note) if device == "cpu" else (),
        device=device,
        machine=hardware(),
    )


def page(found: Performance, day: str) -> str:
    """The page, in Markdown.

    Args:
        found: What was measured.
        day: When, as YYYY-MM-DD.
    """
    parts = [_head(found, day), _propagation(found), _pictures(found)]
    if found.growths:
        parts.append(_growths(found.growths))
    return "\n".join(parts)


def _head(found: Performance, day: str) -> str:
    machine, option, title = found.machine, "", "Performance"
    if found.device == "cuda":
        option, title = "--device cuda ", "Performance on a GPU"
        made = f"{machine['gpu']}, torch {found.propagation['torch']}, {day}"
    else:
        gpu = "no GPU" if machine["gpu"] == "none" else f"{machine['gpu']} (not used here)"
        made = f"{machine['cpu']}, {machine['cores']} cores, {gpu}, {day}"
    return (
        f"# {title}\n\nMade by `rfgs bench performance {option}--out FILE` on {made}. "
        "Run it on a machine without other work.\nTimes are wall-clock, the shortest of some runs; "
        "each ratio is of two times of the same run. `rfgs selftest` holds every\nkernel against "
        "its plain twin in double precision; `rfgs selftest --device cuda` does so on a GPU.\n"
    )


def _propagation(found: Performance) -> str:
    told, share = found.propagation, found.share
    counts = (f"{told[f'num_{what}']:,} {what}" for what in ("gaussians", "links", "subcarriers"))
    size = " × ".join(counts).replace("gaussians", "Gaussians")
    rows = [
        (
            what,
            f"{1e3 * told[f'{key}_s']:.1f} ms",
            f"{told[f'{key}_ratio']:.0f}×",
            f"{told[f'tuned_{key}_ratio']:.0f}×",
        )
        for what, key in (("forward", "forward"), ("with gradients", "forward_backward"))
    ]
    return (
        f"## Propagation\n\n{size}, scattering and shadows, float32. The largest relative error of "
        f"channels and gradients beside\nthe twin is {told['max_relative_error']:.1e}.\n\n"
        + _table(("", "time", "plain torch twin", "twin with blocks as large as the cache"), rows)
        + f"\n{_ceiling(share, found.device)}\n"
    )


#: What the count of operations leaves out, and why the ceiling is not reached.
_NOT_COUNTED: dict[Device, str] = {
    "cpu": (
        "Not counted is what each Gaussian and link cost before\nthe recurrence over subcarriers "
        "begins: distances and phases in double precision, sines, cosines and exponentials.\nThat, "
        "and a recurrence whose steps wait for each other, is what a product of matrices does not "
        "have."
    ),
    "cuda": (
        "Sine, cosine and exponential\nof each are among them, distances and phases in double "
        "precision are not. Few of these operations are a multiplication and an addition\nin one, "
        "as all of a product of matrices are."
    ),
}


def _ceiling(share: Throughput, device: Device) -> str:
    gaussians, links, subcarriers = SPEED[device]
    return (
        f"Scattering alone of {gaussians:,} Gaussians × {links} links × {subcarriers} subcarriers "
        f"takes {1e3 * share.forward_s:.1f} ms: {share.rate / 1e9:.0f} billion\nadditions and "
        f"multiplications per second, {share.rate / share.ceiling:.0%} of the "
        f"{share.ceiling / 1e9:.0f} billion that a product of matrices reaches in the same run.\n"
        f"{OPERATIONS[device]} are counted for each Gaussian, link and subcarrier. "
        f"{_NOT_COUNTED[device]}"
    )


def _pictures(found: Performance) -> str:
    raster = found.raster
    rows = [
        (
            f"{each.num_gaussians:,}",
            f"{each.size_px} × {each.size_px}",
            *_times(each, found.device),
        )
        for each in found.pictures
    ]
    columns = ["Gaussians", "pixels", "projected, sorted and drawn"]
    if found.device == "cuda":
        columns += ["frames per second", "with gradients of everything"]
        said = (
            f"gsplat draws, and projects anew every time. The GPU has held {found.memory_gib:.1f} "
            "GiB at most.\n"
        )
    else:
        columns += ["drawn again", "with gradients of everything"]
        said = (
            "*Drawn again* is another picture of Gaussians that stay where they are, as in the fit "
            f"of colours.\nThe process has held {found.memory_gib:.1f} GiB at most after these "
            "pictures and the propagation above.\n"
        )
    return (
        "## Pictures\n\nOf 20,000 Gaussians at 256 × 256 pixels the tiled rasteriser takes "
        f"{1e3 * raster['raster_s']:.0f} ms, {raster['raster_ratio']:.0f} times quicker than the\n"
        f"twin that visits every Gaussian at every pixel; the largest difference is "
        f"{raster['max_abs_error']:.0e} of full brightness.\n\n"
        + _table(columns, rows)
        + f"\n{said}"
        + (_distant(found.distant) if found.distant else "")
    )


def _distant(distant: Sequence[Distant]) -> str:
    rows = [
        (
            f"{each.num_gaussians:,}",
            f"{each.distance_m:g} m",
            f"{1e3 * each.every_s:.0f} ms",
            f"{1e3 * each.shown_s:.0f} ms",
            f"{each.shown:,}",
            f"{each.max_abs_error:.1g}",
        )
        for each in distant
    ]
    heads = ("Gaussians", "seen from", "all sorted", "as drawn", "sorted then", "difference")
    return (
        "\nOf a crowd that is small in the picture only the nearest are seen; the others are left "
        "out before they are sorted\nwhere that pays (`rfgs_core/render/hidden.py`). A box of "
        "4 × 4 × 2.5 m at 512 × 512 pixels; the difference is the largest\nof a pixel, of full "
        f"brightness:\n\n{_table(heads, rows)}"
    )


def _times(picture: Picture, device: Device) -> tuple[str, ...]:
    if device == "cpu":
        times_s = picture.first_s, picture.again_s, picture.gradients_s
        return tuple(f"{time_s:.2g} s" for time_s in times_s)
    return (
        f"{1e3 * picture.first_s:.2f} ms",
        f"{1.0 / picture.first_s:.0f}",
        f"{1e3 * picture.gradients_s:.2f} ms",
    )


def _growths(growths: Sequence[Growth]) -> str:
    rows = [_growth(each) for each in growths]
    steep = [each.name for each in growths if each.exponent > _LINEAR]
    said = (
        f"More than linear: {', '.join(steep)}."
        if steep
        else "Nothing grows more than linearly. Below 1, part of the work does not grow: time is "
        "that part\nand a power of what grows, whose exponent has no meaning (–) where most of the "
        "time at the largest size does not grow."
    )
    heads = ("what grows", "sizes", "CPU time", "exponent", "does not grow", "exponent of the rest")
    return f"## How cost grows\n\n{_table(heads, rows)}\n{said}\n"


def _growth(each: Growth) -> tuple[str, ...]:
    """A row of the table of growths."""
    fixed_s, exponent = each.law
    return (
        each.name,
        f"{each.sizes[0]:,} to {each.sizes[-1]:,}",
        f"{each.seconds[0]:.3g} s to {each.seconds[-1]:.3g} s",
        f"{each.exponent:.2f}",
        f"{fixed_s:.3g} s",
        f"{exponent:.2f}" if fixed_s < _MOST_FIXED * each.seconds[-1] else "–",
    )


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [heads, ["---"] * len(heads), *rows]
    return "".join(f"| {' | '.join(row)} |\n" for row in lines)
