# SPDX-License-Identifier: Apache-2.0
"""`rfgs-factory tracers`."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import tyro

from rfgs_core.errors import RfgsError


@dataclass(frozen=True)
class TracersArgs:
    """Holds the fast tracer against Sionna RT, on the same scenes, radios and frames.

    Prints for each scene and radio the error of csi_static and of people's part of the channel
    (dH), its level, the correlation of delay-angle powers, and CPU seconds per frame of both, on
    one thread. All twelve scenes with two radios take about forty minutes on two cores, one scene
    about three.
    """

    scenes: tyro.conf.Positional[tuple[str, ...]] = ()
    """Names from `rfgs-factory scenes`; default: all of them."""
    radio: tyro.conf.UseAppendAction[tuple[str, ...]] = ()
    """Preset whose antennas stand still; repeat the option for several. Default: wifi and
    mmwave."""
    depth: int | None = None
    """Interactions of people's paths, 1 to 3; default: what each scene needs."""
    frames: int = 2
    """Frames of each scene, evenly spread."""
    json: Path | None = None
    """Also write the numbers to this file, as one flat dictionary."""
    markdown: Path | None = None
    """Also write the table to this file."""


def run(args: TracersArgs) -> int:
    """Prints the table row by row."""
    from dataset_factory.scene.catalogue import catalogue, find_scene
    from dataset_factory.trace.setup import prepare
    from rfgs_core.extras import require
    from rfgs_core.files import refuse_place, write_json, write_text

    if not 1 <= args.frames <= 1000:
        raise RfgsError(f"--frames {args.frames}: expected 1 to 1000")
    if args.depth is not None and not 1 <= args.depth <= 3:
        raise RfgsError(f"--depth {args.depth}: expected 1 to 3")
    scenes = [find_scene(name) for name in args.scenes] or catalogue()
    radios = _radios(args.radio or ("wifi", "mmwave"))
    if args.markdown is not None:
        refuse_place(args.markdown)
    require("sionna", "bpy")
    prepare(threads=1)
    rows = _compare(scenes, radios, args)
    from dataset_factory.make.compare_tracers import as_numbers, as_table

    if args.json is not None:
        write_json(args.json, as_numbers(rows))
    if args.markdown is not None:
        write_text(args.markdown, as_table(rows))
    return 0


def _radios(names: tuple[str, ...]) -> tuple[str, ...]:
    """Refuses radios that the fast tracer does not have.

    Raises:
        RfgsError: A preset is unknown, or its antennas move.
    """
    from rfgs_core.radio import preset

    for name in names:
        if preset(name).antennas_move:
            raise RfgsError(f"--radio {name}: its antennas move, the fast tracer's stand still")
    return names


def _compare(scenes: list, radios: tuple[str, ...], args: TracersArgs) -> list:
    """Rows of all scenes and radios, printed as they come."""
    import tempfile

    from tqdm import tqdm

    from dataset_factory.make.compare_tracers import as_table, compare_tracers, export_frames
    from rfgs_core.radio import preset

    rows: list = []
    with (
        tempfile.TemporaryDirectory(prefix="rfgs-tracers-") as folder,
        tqdm(total=len(scenes) * len(radios), unit="row") as bar,
    ):
        for scene in scenes:
            bar.set_description_str(f"{scene.name}: export")
            bundle = export_frames(scene, Path(folder) / scene.name, args.frames)
            for radio in radios:
                depth = min(args.depth or scene.depth, preset(radio).deepest)
                rows.append(
                    compare_tracers(bundle, scene.name, radio, depth, bar.set_description_str)
                )
                table = as_table(rows).splitlines()
                shown = table if len(rows) == 1 else table[-1:]
                with tqdm.external_write_mode(file=sys.stdout):
                    sys.stdout.write("\n".join(shown) + "\n")
                bar.update()
    return rows
