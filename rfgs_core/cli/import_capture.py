# SPDX-License-Identifier: Apache-2.0
"""`rfgs import`: captures of real radios become a dataset."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro


@dataclass(frozen=True)
class ImportArgs:
    """Makes a dataset of what real radios recorded.

    A file for each receiving device, in the order of the layout or by the names in it. Packets are
    put on one clock, subcarriers that were not reported are filled and kept out of training.
    docs/captures.md explains the layout and lists the formats; `rfgs inspect FILE` tells whether
    a file reads.

    Example: rfgs import r1.dat r2.dat --layout radios.yaml --out lab
    """

    files: tyro.conf.Positional[tuple[Path, ...]]
    """Captures."""
    out: Path
    """Folder of the dataset to make."""
    layout: Path | None = None
    """Where the radios stood (YAML); captures that tell it themselves need none."""
    empty: tuple[Path, ...] = ()
    """The same radios with nothing that moves; the mean over the capture when left out."""
    sanitize: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    """Clean each packet first, as `rfgs inspect --sanitize` shows: packets of most Wi-Fi cards
    share no phase, so their mean says nothing otherwise. Absolute delays and levels are gone."""
    format: str | None = None
    """Name of the reader, where a file does not tell it."""


def run(args: ImportArgs) -> int:
    """Writes the dataset and prints what is in it; exit code 0."""
    from rfgs_core.capture import read_capture
    from rfgs_core.capture.layout_file import EXAMPLE, read_layout
    from rfgs_core.capture.prepare import prepare
    from rfgs_core.capture.prepare_placed import prepare_placed, tells_places
    from rfgs_core.capture.to_dataset import write_dataset
    from rfgs_core.errors import RfgsError

    if not args.files:
        raise RfgsError("import: expected at least one capture")
    if args.layout is not None:
        given = read_layout(args.layout)
        prepared, warnings = prepare(
            list(args.files),
            given,
            list(args.empty) or None,
            args.format,
            sanitise=args.sanitize,
        )
    else:
        first, *others = args.files
        reading = read_capture(first, args.format)
        if others or not tells_places(reading.largest):
            raise RfgsError(
                f"{first}: the file does not tell where its antennas were; give --layout "
                f"with {EXAMPLE}"
            )
        unused = [f"--{name}" for name in ("empty", "sanitize") if getattr(args, name)]
        if unused:
            raise RfgsError(
                f"{first}: {' and '.join(unused)}: expected captures of several packets over time; "
                "each of this one is from a place of its own, so leave it out"
            )
        prepared, warnings = prepare_placed(reading.largest, "capture"), reading.warnings
    config = {"files": [path.name for path in args.files], "program": "rfgs import"}
    write_dataset(args.out, prepared, config)
    for warning in warnings:
        sys.stderr.write(f"warning: {warning}\n")
    for row in prepared.guesses:
        sys.stdout.write(f"guessed: {row['object']}: {row['what']}: {row['value']}\n")
    frames, samples, num_tx, num_rx, count = prepared.csi.shape
    radio = prepared.radio
    # A capture does not tell who was there, and few radios can count: the reader knows.
    people = "--people N " if args.layout else ""
    trains = (
        f"next: rfgs train {args.out} --radio {radio.name} {people}--out RUN"
        f"{' (N people were there)' if people else ''}"
    )
    if count < 2:
        trains = "a single subcarrier tells no delays, so nothing can be trained on it"
    sys.stdout.write(
        f"{args.out}: {frames} frames of {samples} packets, {num_tx} x {num_rx} antennas, "
        f"{count} subcarriers ({int(prepared.measured.sum())} measured) at "
        f"{radio.centre_hz / 1e9:.4f} GHz; {trains}\n"
    )
    return 0
