# SPDX-License-Identifier: Apache-2.0
"""`rfgs inspect`: what a capture holds, or what the radios of a dataset can tell apart."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

if TYPE_CHECKING:
    from rfgs_core.capture import Capture, Reading


@dataclass(frozen=True)
class InspectArgs:
    """Tells what a capture of a real radio holds, with pictures of it.

    Reads Intel 5300, FeitCSI, PicoScenes, Nexmon, ESP32, TI mmWave, Acconeer A121, DW1000, NeRF2
    folders, NeWRF tables and AFRL phase history; the file itself tells which. docs/captures.md
    explains each. Of a dataset it says what the band and the antennas of its radios can tell apart.

    Example: rfgs inspect walk.dat --sanitize --out pictures
    """

    file: tyro.conf.Positional[Path]
    """A capture: a file, or a folder in NeRF2's layout; or a dataset."""
    out: Path | None = None
    """Folder for pictures of a capture; none are drawn when left out."""
    sanitize: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    """Also clean a capture, step by step, and draw before and after."""
    format: str | None = None
    """Name of the reader, where the file does not tell it."""


def run(args: InspectArgs) -> int:
    """Prints a summary and draws what was asked for; exit code 0."""
    from rfgs_core.capture import read_capture

    if (args.file / "dataset.json").is_file():
        _refuse_capture_options(args)
        sys.stdout.write("".join(f"{line}\n" for line in _can_tell(args.file)))
        return 0
    reading = read_capture(args.file, args.format)
    sys.stdout.write("".join(f"{line}\n" for line in summary(reading)))
    for number, capture in enumerate(reading.captures):
        name = args.file.stem + (f"_{number}" if number else "")
        if args.out is not None:
            from rfgs_core.figures.captures import write_capture_chart

            write_capture_chart(args.out / f"{name}.png", capture)
            sys.stdout.write(f"{args.out / f'{name}.png'} written\n")
        if args.sanitize:
            _sanitise(capture, None if args.out is None else args.out / f"{name}_sanitised.png")
    return 0


def _refuse_capture_options(args: InspectArgs) -> None:
    """Refuses what has no meaning for a dataset.

    Raises:
        RfgsError: Such an option was given.
    """
    from rfgs_core.errors import RfgsError

    given = [f"--{name}" for name in ("out", "sanitize", "format") if getattr(args, name)]
    if given:
        raise RfgsError(
            f"{args.file} is a dataset: {', '.join(given)} goes with captures only; leave it out, "
            f"or draw pictures with `rfgs-factory preview {args.file}`"
        )


def _can_tell(dataset: Path) -> list[str]:
    """What the radios of a dataset can tell apart, in lines."""
    from rfgs_core.dataset import open_dataset
    from rfgs_core.measure.resolving import resolving
    from rfgs_core.settings import TrainConfig

    lines, opened = [], open_dataset(dataset)
    for name in opened.sequences:
        sequence = opened.sequence(name)
        for radio in sequence.radios:
            can = resolving(sequence, radio, TrainConfig().num_gaussians)
            lines += [f"{name}: {line}" for line in can.lines()]
    return lines


def summary(reading: Reading) -> list[str]:
    """A capture in lines for people: formats, sizes, bands, times, levels, damage."""
    from rfgs_core.capture.readers import reader

    lines = [f"{reading.path.name}: {reader(reading.source).TITLE} ({reading.source})"]
    for number, capture in enumerate(reading.captures):
        lines += [f"capture {number}: {row}" for row in _rows(capture)]
    return lines + [f"warning: {warning}" for warning in reading.warnings]


def _rows(capture: Capture) -> list[str]:
    import numpy as np

    from rfgs_core.radio.levels import amplitude_decibels

    packets, devices, num_rx, num_tx, bins = capture.values.shape
    units = {"subcarrier": ("MHz", 1e-6), "delay": ("ns", 1e9), "range": ("m", 1.0)}
    unit, factor = units.get(capture.axis, ("", 1.0))
    low, high = factor * capture.bins[0], factor * capture.bins[-1]
    device = "" if devices == 1 else f"{devices} devices x "
    centre = capture.centre_hz
    settings = ", ".join(
        f"{key} {value}"
        for key, value in capture.info.items()
        if isinstance(value, (str, int)) and key != "untimed"
    )
    rows = [
        f"{packets} packets of {device}{num_rx} RX x {num_tx} TX x {bins} {capture.axis} bins, "
        f"{low:.4g} to {high:.4g} {unit}",
        f"centre {'not in the file' if centre is None else f'{centre / 1e9:.6g} GHz'}; {settings}",
    ]
    if capture.info.get("untimed"):
        rows.append("times are not told")
    else:
        steps = np.diff(capture.time_s)
        gap = float(steps.max()) if len(steps) else 0.0
        rows.append(
            f"{capture.time_s[-1]:.3f} s, median {capture.rate_hz:.4g} packets/s, longest gap "
            f"{1e3 * gap:.1f} ms"
        )
    level = np.abs(capture.values[capture.valid])
    if level.size:
        missing = 100.0 * (1.0 - capture.valid.mean())
        rows.append(
            f"median level {amplitude_decibels(float(np.median(level))):.1f} dB, "
            f"{missing:.1f} % of the entries missing, pilots or nulls"
        )
    for name in ("rssi_dbm", "rssi_db", "noise_dbm", "agc_db", "distance_m", "temperature_c"):
        value = capture.packets.get(name)
        if value is not None and np.isfinite(value).any():
            rows.append(f"{name} {np.nanmin(value):.1f} to {np.nanmax(value):.1f}")
    return rows


def _sanitise(capture: Capture, picture: Path | None) -> None:
    """Prints what each step does to the coherence of neighbouring packets."""
    from rfgs_core.capture.cleaned import coherence, steps

    sys.stdout.write(f"as recorded: coherence of neighbouring packets {coherence(capture):.2f}\n")
    after = capture
    for step in steps(capture):
        after = step.capture
        sys.stdout.write(f"{step.name}: {coherence(after):.2f}\n")
    if picture is not None:
        from rfgs_core.figures.captures import write_sanitised_chart

        write_sanitised_chart(picture, capture, after)
        sys.stdout.write(f"{picture} written\n")
