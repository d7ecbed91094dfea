# SPDX-License-Identifier: Apache-2.0
"""`rfgs room`: where a radio hears the walls of the room that it stands in."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import tyro


@dataclass(frozen=True)
class RoomArgs:
    """Tells where walls, floor and ceiling stand, from the empty room's channel alone.

    A wall mirrors every device. Its image is sought in csi_static, line of sight and stronger
    walls taken out first; antenna places are all that is known. Printed are the place of each
    plane that is heard, what it reflects, and how far it is from the box of the scene's bounds,
    which nothing else here reads: bounds may reach beyond the walls, or stop at furniture.

    Example: rfgs room data --radio wifi
    """

    dataset: tyro.conf.Positional[Path]
    """Folder of a dataset."""
    radio: str = "wifi"
    """Radio of the dataset."""
    sequence: str | None = None
    """Sequence of the dataset; the only one when left out."""
    farthest: float = 3.0
    """How far beyond the outermost antennas walls are sought [m]."""
    json: Path | None = None
    """Also write the planes to this file."""


def run(args: RoomArgs) -> int:
    """Prints a line for each plane; exit code 0."""
    from rfgs_core.dataset import open_dataset
    from rfgs_core.errors import RfgsError
    from rfgs_core.files import write_json
    from rfgs_core.simulate.walls import find_walls, room_of_walls

    if not 0.1 <= args.farthest <= 100.0:
        raise RfgsError(f"--farthest {args.farthest}: expected 0.1 to 100 m")
    dataset = open_dataset(args.dataset)
    dataset.need("csi_static")
    sequence = dataset.sequence(args.sequence)
    if args.radio not in sequence.radios:
        raise RfgsError(
            f"{args.dataset} ({sequence.name}) has no radio {args.radio!r}; "
            f"it has {', '.join(sequence.radios)}"
        )
    radio = sequence.radio_spec(args.radio)
    if radio.antennas_move:
        raise RfgsError(
            f"--radio {args.radio}: its antennas move; walls are told by those that do not"
        )
    walls = find_walls(
        sequence.csi_static(args.radio), sequence.layout(args.radio), radio, args.farthest
    )
    bounds_m = sequence.bounds_m
    materials = room_of_walls(walls, radio).materials if walls else ()
    for wall, material in zip(sorted(walls, key=lambda w: w[:2]), materials, strict=True):
        off_m = wall.at_m - float(bounds_m[int(wall.high), wall.axis])
        sys.stdout.write(
            f"{wall.name}  {wall.at_m:7.3f} m   {off_m:+.3f} m from the bounds   reflects "
            f"{wall.reflection:.2f} of the amplitude, as {material.name} does\n"
        )
    heard = {wall.name for wall in walls}
    missing = [name for name in ("x-", "x+", "y-", "y+", "z-", "z+") if name not in heard]
    if missing:
        sys.stdout.write(f"not heard: {', '.join(missing)}\n")
    if args.json is not None:
        write_json(args.json, {wall.name: wall._asdict() for wall in walls})
    return 0
