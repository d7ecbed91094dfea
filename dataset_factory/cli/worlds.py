# SPDX-License-Identifier: Apache-2.0
"""`rfgs-factory worlds`."""

from __future__ import annotations

import logging
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import tyro

from dataset_factory.plan.tracers import TracerName
from rfgs_core.errors import RfgsError

if TYPE_CHECKING:
    from rfgs_core.worlds.motion import KeptRecording
    from rfgs_core.worlds.settings_file import Pictures


@dataclass(frozen=True)
class WorldsArgs:
    """Makes small datasets of random worlds: rooms, furniture, devices and people who move.

    Every world is a dataset of its own, OUT/world_0000012, with channels of the fast tracer,
    meshes and joints. With --images Blender renders it too, and its scene is kept as
    OUT/scenes/world_0000012.blend; without, no Blender is needed. The same seed and number give the
    same world, whoever makes it; run the same command again to continue where it stopped.
    In Python, `rfgs_core.worlds.world.soundings` gives the same without writing anything.
    """

    out: Path
    """Folder of the worlds."""
    radio: str
    """Radio to trace: a preset (see `rfgs-factory radios`) or a file like my_radio.yaml; how many
    devices there are and where they stand is drawn for every world."""
    count: int = 10
    """How many worlds there shall be, all shards together."""
    shard: str = "1/1"
    """Which share of them this command makes, K/N, for machines that no cluster joins."""
    workers: int = 1
    """Processes that make them, each keeps one core busy; the same bytes from any number. With
    scenes of Blender they share the frames of one world after another."""
    worker_memory: float = 0.0
    """Memory of each [GB], as with `rfgs-factory generate`; 0 shares 90 % of the machine's."""
    scheduler: str = ""
    """Address of a Dask scheduler, as in tcp://node1:8786, whose workers make them instead. They
    need this version of RF-GS, no shared storage; see docs/cluster.md."""
    frames: int = 8
    """Frames of each world."""
    fps: float = 10.0
    """Frames per second."""
    people: str = "1:2"
    """Fewest and most people, up to 4."""
    motion: tyro.conf.UseAppendAction[tuple[str, ...]] = ()
    """What people do, as in walk, sit, fall or gesture, or recorded; repeat the option for several;
    default: anything, or what was recorded if --recording is given."""
    recording: tyro.conf.UseAppendAction[tuple[Path, ...]] = ()
    """Motion capture that people play on bodies of their own: a .bvh of any rig of a person, or a
    clip in DeepMimic's format (.txt); repeat the option for several."""
    up: Literal["y", "z"] = "y"
    """Axis that is up in the recordings."""
    depth: int = 2
    """Interactions of a path that meets a person: 1 the person alone, 2 also one wall, 3 two."""
    seed: int = 0
    """Root seed; 0 is a seed like any other."""
    images: bool = False
    """Also make a scene of Blender of every world, and render pictures, depth and masks of it."""
    cameras: int = 2
    """Cameras of each world that is rendered, 1 to 12."""
    resolution: int = 128
    """Side of the pictures [px]."""
    samples: int = 16
    """Light samples per pixel; more is less noisy and slower."""
    tracer: TracerName = "fast"
    """What traces the channels: the fast tracer, or Sionna RT, some hundred times slower and
    through a scene of Blender as well."""


def run(args: WorldsArgs) -> int:
    """Makes what is missing; exit code 0."""
    from tqdm import tqdm

    from dataset_factory.make.worlds import MOST, make_worlds, missing, parse_shard
    from dataset_factory.scene.radios import SCENE_RADIO, chosen_radios
    from rfgs_core.extras import require
    from rfgs_core.files import refuse_place
    from rfgs_core.links import filled
    from rfgs_core.past import count_in_words
    from rfgs_core.schedule.spread import Spread
    from rfgs_core.worlds.motion import FAMILIES, RECORDED
    from rfgs_core.worlds.settings_file import WorldsFile
    from rfgs_core.worlds.world import WorldSettings

    if not 1 <= args.count <= MOST:
        raise RfgsError(f"--count {args.count}: expected 1 to {MOST}")
    number, shards = parse_shard(args.shard)
    spread = Spread(args.workers, args.worker_memory, args.scheduler)
    spread.check()
    if args.scheduler or args.workers > 1:
        require("distributed")
    (radio,) = chosen_radios((args.radio,)).values()
    if radio.name == SCENE_RADIO:
        raise RfgsError(f"--radio {SCENE_RADIO}: random worlds have no Empties; name another")
    settings = WorldSettings(
        frames=args.frames,
        fps=args.fps,
        people=parse_people(args.people),
        depth=args.depth,
        families=args.motion or ((RECORDED,) if args.recording else FAMILIES),
        recordings=tuple(kept_recording(path, args.up) for path in args.recording),
    )
    settings.check()
    shared = WorldsFile(radio, settings, args.seed, _pictures(args), args.tracer)
    if shared.in_blender and settings.fps != round(settings.fps):
        raise RfgsError(f"--fps {args.fps}: expected a whole number for a scene of Blender")
    refuse_place(args.out)
    indices = range(number - 1, args.count, shards)
    # What is in each of many scenes would bury the bar.
    logging.getLogger("dataset_factory.make.generate").setLevel(logging.WARNING)
    with filled(args.out):
        left = len(missing(args.out, indices))
        with tqdm(total=left, desc="worlds", unit="world", disable=not left) as bar:
            for _ in make_worlds(args.out, shared, args.radio, indices, spread):
                bar.update()
    sys.stdout.write(f"{args.out}: {count_in_words(len(indices), 'world')}, {left} of them new\n")
    return 0


def _pictures(args: WorldsArgs) -> Pictures | None:
    from rfgs_core.worlds.settings_file import Pictures

    if not args.images:
        return None
    limits = {"cameras": (1, 12), "resolution": (16, 8192), "samples": (1, 65536)}
    for name, (low, high) in limits.items():
        if not low <= getattr(args, name) <= high:
            raise RfgsError(f"--{name} {getattr(args, name)}: expected {low} to {high}")
    return Pictures(args.cameras, args.resolution, args.samples)


def kept_recording(path: Path, up: str) -> KeptRecording:
    """A file of motion capture, to be kept with the worlds.

    Raises:
        RfgsError: It is missing, or no recording of a person.
    """
    from rfgs_core.motion_capture import read_recording
    from rfgs_core.worlds.motion import KeptRecording

    if not path.is_file():
        raise RfgsError(f"{path}: no such file; expected a .bvh or a clip in DeepMimic's format")
    kept = KeptRecording.of(path.name, read_recording(path), up)
    kept.check()
    return kept


def parse_people(text: str) -> tuple[int, int]:
    """Fewest and most people of `FEWEST:MOST` or of one number.

    Raises:
        RfgsError: The text is of another form.
    """
    fewest, _, most = text.partition(":")
    if not fewest.isdecimal() or not (most or fewest).isdecimal():
        raise RfgsError(f"--people {text!r}: expected FEWEST:MOST or one number, as in 1:2")
    return int(fewest), int(most or fewest)
