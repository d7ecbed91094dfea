# SPDX-License-Identifier: Apache-2.0
"""`rfgs-factory generate`."""

from __future__ import annotations

import logging
import sys
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import tyro

from dataset_factory.plan.tracers import TracerName, TracingDevice
from dataset_factory.scene.overrides import SceneOptions
from rfgs_core.errors import RfgsError

if TYPE_CHECKING:
    from dataset_factory.plan.contents import Plan
    from dataset_factory.plan.job import Job
    from dataset_factory.scene.catalogue import Scene
    from dataset_factory.scene.outline import Outline

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class GenerateArgs:
    """Makes a dataset; run it again to continue where it stopped.

    Takes any Blender file with something that moves; the file is never changed and none of its
    scripts runs. Stop at any moment: the same command continues and ends in the same bytes.
    """

    scene: tyro.conf.Positional[str]
    """Name from `rfgs-factory scenes`, or path of a .blend file."""
    out: Path
    """Folder of the dataset."""
    radio: tyro.conf.UseAppendAction[tuple[str, ...]] = ()
    """Radio to trace: a preset (see `rfgs-factory radios`), a file like my_radio.yaml, or `scene`
    for the one that the scene's Empties describe, which is the default where there are Empties
    of the radio `scene`; repeat the option for several."""
    frames: str = ""
    """Blender frames A:B[:STEP] (inclusive), or one number; default: all."""
    cameras: int = 0
    """How many of the scene's cameras, in order of their names; 0 takes all."""
    resolution: int = 256
    """Longer side of the pictures [px]."""
    samples: int = 16
    """Light samples per pixel; more is less noisy and slower."""
    depth: int | None = None
    """Interactions of a path that meets a person: 1 the person alone (fast), 2 also one wall, 3
    two (slow; needed behind a wall). Default: what the scene needs, else 2; for uwb and sar 1,
    which is all that an ultra-wide band, or antennas that move, can have."""
    seed: int = 0
    """Root seed; the same seed gives the same bytes."""
    workers: int = 2
    """Worker processes that trace; each keeps one core busy."""
    worker_memory: float = 0.0
    """Memory of each [GB]: at 80 % of it a process is replaced after its frame, beyond it the
    process is killed and the frame tried once more; 0 shares 90 % of the machine's memory. On a
    cluster its own limit counts."""
    scheduler: str = ""
    """Address of a Dask scheduler, as in tcp://node1:8786, whose workers trace instead. They
    need this version of RF-GS, no shared storage; see docs/cluster.md."""
    tracer: TracerName = "sionna"
    """What traces the channels: Sionna RT, the reference, or the fast tracer, several times
    quicker and held against it (`rfgs-factory tracers`); see docs/tracers.md."""
    device: TracingDevice = "auto"
    """What Sionna RT traces on: cuda, a GPU; cpu; or a GPU where there is one. Bytes are the same
    on one kind of device, and differ in the last digits between the two."""
    shadow: Literal["kirchhoff", "hard"] = "kirchhoff"
    """How bodies shadow paths: diffracted at the silhouette, or cut off sharply."""
    impairments: str = ""
    """Also store what imperfect radios would report: thermal, lab, commodity or a JSON file; see
    `rfgs-factory impair --help`."""
    packets_per_frame: int = 1
    """Channels per frame, for Doppler: packets spread until the next frame, or for mmwave chirps
    0.25 ms apart. The animation's last frame is left out, as nothing is known beyond it. Not for
    sar, whose pulses are the places of its antenna."""
    paths: bool = False
    """Also store the paths behind every channel: amplitude, delay, angles, Doppler, and what each
    meets where. Takes about as much disk as the channels, and a few seconds per frame. Not for
    sar."""
    images: bool = True
    """Render pictures with Blender."""
    options: tyro.conf.OmitArgPrefixes[SceneOptions] = field(default_factory=SceneOptions)
    """What to make of the scene."""
    blender: Path | None = None
    """A real Blender with the add-on enabled; default: $BLENDER, else pip's bpy."""


def run(args: GenerateArgs) -> int:
    """Makes the dataset, or what is missing of it."""
    from dataset_factory.make.generate import generate
    from rfgs_core.extras import require

    if not args.scheduler:
        require("sionna")  # Else it would be missed only once the scene has been exported.
        if args.device == "cuda":
            from dataset_factory.trace.setup import prepare

            prepare(device="cuda")
    made = generate(job_of(args)[0])
    what = "finished" if made else "already complete"
    sys.stdout.write(f"{args.out}: {what}; look at it with: rfgs-factory preview {args.out}\n")
    return 0


def job_of(args: GenerateArgs) -> tuple[Job, Outline]:
    """The job that arguments ask for, and its scene's outline; says which devices it does without.

    Raises:
        RfgsError: An argument is out of range, or names nothing.
    """
    from dataset_factory.plan.contents import whole_frames
    from dataset_factory.plan.folder import open_folder
    from dataset_factory.plan.job import Job
    from dataset_factory.scene.blender import Blender
    from dataset_factory.scene.catalogue import find_scene
    from dataset_factory.scene.outline import (
        left_out,
        no_radio,
        read_outline,
        silence,
        usual_radios,
    )
    from dataset_factory.scene.overrides import label, read_options
    from rfgs_core.llvm import use_llvm
    from rfgs_core.radio import pose_span_s
    from rfgs_core.schedule.spread import Spread

    Spread(args.workers, args.worker_memory, args.scheduler).check()
    scene, said = find_scene(args.scene), read_options(args.options)
    frames = whole_frames(args.frames or str(said.pop("frames", "")))
    blender, source = Blender(scene.blend, args.blender), label(args.options)

    def look(between: bool) -> Outline:
        return read_outline(blender, frames, said, source, between=between)

    seen = None if args.radio else look(args.packets_per_frame > 1)
    named = args.radio or usual_radios(seen.devices if seen else ())
    if seen and not named:
        raise RfgsError(f"{scene.blend}: {no_radio(seen.devices)}")
    plan = _plan(args, scene, named, frames, said)
    use_llvm()
    radios = [plan.radio(name) for name in plan.radios]
    job = Job(
        args.out,
        plan,
        blender,
        args.workers,
        worker_memory_gb=args.worker_memory,
        scheduler=args.scheduler,
        device=args.device,
        overrides_label=source,
    )
    # A place that is taken is refused before a large scene is opened.
    open_folder(job)
    # Also refuses frames that the scene does not have, before anything is made for them.
    seen = seen or look(any(pose_span_s(radio) is not None for radio in radios))
    for radio in radios:
        if problem := silence(seen.devices, radio):
            raise RfgsError(f"{scene.blend}: {problem}")
    for sentence in left_out(seen.devices, radios):
        logger.warning("%s", sentence)
    return job, seen


def _plan(
    args: GenerateArgs, scene: Scene, radios: tuple[str, ...], frames: str, said: dict[str, Any]
) -> Plan:
    """What the dataset shall hold.

    Raises:
        RfgsError: An argument is out of range, or names nothing.
    """
    from dataset_factory.plan.contents import make_plan
    from rfgs_core.radio.impairments import read_impairments

    _refuse_depth(scene, radios, args.depth)
    return make_plan(
        scene,
        radios,
        frames,
        cameras=args.cameras,
        resolution=args.resolution,
        samples=args.samples,
        depth=scene.depth if args.depth is None else args.depth,
        seed=args.seed,
        shadow=args.shadow,
        tracer=args.tracer,
        images=args.images,
        impairments=asdict(read_impairments(args.impairments)) if args.impairments else None,
        packets_per_frame=args.packets_per_frame,
        paths=args.paths,
        overrides=said,
    )


def _refuse_depth(scene: Scene, radios: tuple[str, ...], depth: int | None) -> None:
    """Refuses radios that cannot be traced as deep as was asked, or as what moves needs.

    Raises:
        RfgsError: Naming the radio and the remedy.
    """
    from dataset_factory.scene.catalogue import DEFAULT_DEPTH
    from dataset_factory.scene.radios import SCENE_RADIO, chosen_radios
    from rfgs_core.radio.check import too_deep

    for name, radio in chosen_radios(radios).items():
        if name == SCENE_RADIO:
            continue
        if radio.deepest == 1 and depth is not None and depth > 1:
            raise RfgsError(too_deep(radio, depth))
        if depth is None and scene.depth > max(radio.deepest, DEFAULT_DEPTH):
            raise RfgsError(
                f"scene {scene.name!r}: who moves there is seen at trace depth {scene.depth}, but "
                f"radio {name!r} is traced at {radio.deepest} at most; use another radio or scene, "
                f"or --depth {radio.deepest} for what people scatter without a wall on the way"
            )
