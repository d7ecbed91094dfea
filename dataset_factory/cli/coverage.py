# SPDX-License-Identifier: Apache-2.0
"""`rfgs-factory coverage`."""

from __future__ import annotations

import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import tyro


@dataclass(frozen=True)
class CoverageArgs:
    """Traces how loud each transmitter is over a level plane, as a map that Blender shows.

    The scene is exported and traced with Sionna RT's radio maps; people, if a frame is named,
    reflect as bodies of skin. In Blender: RF-GS, 5 Inspect, Coverage, or the command `coverage`.
    """

    scene: tyro.conf.Positional[str]
    """Name from `rfgs-factory scenes`, or path of a .blend file."""
    radio: str = "wifi"
    """A preset, a file that describes a radio, or `scene`."""
    out: Path = Path("coverage.json")
    """File that gets the map; gains of an isotropic antenna over the power sent [dB]."""
    height_m: float = 1.2
    """Height of the plane above the lower end of the scene's bounds [m]."""
    cell_m: float = 0.1
    """Side of the map's square cells [m]."""
    depth: int = 3
    """Most interactions of a path; 0 is the line of sight alone."""
    frame: int | None = None
    """Blender frame at which what moves stands; default: without people and all that moves."""
    samples: int = 1_000_000
    """Rays per transmitter."""
    diffraction: bool = False
    """Also trace the edges of walls and furniture, about three times as long."""
    blender: Path | None = None
    """A real Blender with the add-on enabled; default: $BLENDER, else pip's bpy."""


def run(args: CoverageArgs) -> int:
    """Writes the map and says what is in it."""
    import numpy as np

    from dataset_factory.scene.blender import Blender
    from dataset_factory.scene.catalogue import find_scene
    from dataset_factory.scene.radios import chosen_radios
    from dataset_factory.trace.setup import prepare
    from rfgs_core.extras import require
    from rfgs_core.files import refuse_place

    require("sionna")
    refuse_place(args.out)
    chosen_radios((args.radio,))
    scene = find_scene(args.scene)
    prepare()
    from dataset_factory.trace.coverage import NOTHING_DB, trace_coverage

    with tempfile.TemporaryDirectory(prefix="rfgs-") as folder:
        frames = [] if args.frame is None else ["--frames", f"{args.frame}:{args.frame}"]
        bundle = Path(folder, "bundle")
        Blender(scene.blend, args.blender).run("export", "--out", str(bundle), *frames)
        found = trace_coverage(
            *(bundle, args.radio, args.height_m, args.cell_m, args.depth),
            *(args.frame, args.samples, args.diffraction),
        )
    found.write(args.out)
    for name, gain_db in zip(found.devices, found.gain_db, strict=True):
        heard = gain_db[gain_db > NOTHING_DB]
        if not len(heard):
            sys.stdout.write(f"{name}: heard nowhere\n")
            continue
        low, middle, high = np.percentile(heard, (5, 50, 95))
        share = 100.0 * len(heard) / gain_db.size
        sys.stdout.write(
            f"{name}: heard in {share:.0f} % of the plane; median {middle:.1f} dB, "
            f"90 % between {low:.1f} and {high:.1f} dB\n"
        )
    sys.stdout.write(
        f"{args.out}: {found.gain_db.shape[0]} maps of {found.gain_db[0].size} cells\n"
    )
    return 0
