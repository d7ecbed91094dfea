# SPDX-License-Identifier: Apache-2.0
"""`rfgs train`: fits Gaussians to the channel of a sequence."""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from rfgs_core.dataset.observed import Observed
from rfgs_core.device import Device
from rfgs_core.settings import (
    Background,
    Calibrate,
    Density,
    Objective,
    Observe,
    Packets,
    Part,
    Posture,
    Recipe,
    TrainConfig,
)

if TYPE_CHECKING:
    from rfgs_core.dataset import Dataset, Sequence


@dataclass(frozen=True)
class TrainArgs:
    """Fits Gaussians to the channel of a sequence, frame by frame, and keeps them in a run.

    Pictures are only used afterwards, to colour frozen Gaussians for display. Running the same
    command again continues where it stopped.
    """

    dataset: tyro.conf.Positional[Path]
    """Dataset folder, as `rfgs-factory generate` makes it."""
    radio: str
    """Which of the dataset's radios, for example wifi."""
    out: Path
    """Folder of the run."""
    sequence: str | None = None
    """Which sequence; may be left out when there is only one."""
    frames: str | None = None
    """Frames A:B[:STEP] (inclusive), or one number; all when left out."""
    objective: Objective = "csi"
    """csi: the propagation model; paper: eq. 4-7 of the paper; both: their sum."""
    encoder: str = "matched_filter"
    """What gives the 32 features at a point: matched_filter; cnn:FILE with a file of
    `rfgs encode`; or paths, which reads traced paths (of datasets generated with --paths)."""
    channel: Observed = "clean"
    """clean: the traced channel; impaired: what `rfgs-factory impair` made of it. The empty room
    stays clean, since its capture can be averaged."""
    observe: Observe = "complex"
    """What the radio reports, and all that any stage sees: complex, the channel itself; power,
    |CSI|^2 per link and tone; delay_power, the power of each link's delay profile."""
    packets: Packets | None = None
    """Of several packets (chirps) per frame: all, which tells the channel's change from noise by
    delay, direction and Doppler; or first, the one at the frame's own time. Left out: all, but
    first with --calibrate or with an --observe that has no phases."""
    background: Background = "empty_room"
    """What the moving part is told from: empty_room, its capture; learned, the median over all
    frames of the sequence, where nobody recorded the empty room."""
    static_set: int = 0
    """Gaussians of what stands still, shared by all frames and fitted to the background less the
    direct paths; 0: none. With --background learned, what moves is then taken out of every frame
    before the median is taken again. Needs --observe complex."""
    density: Density | None = None
    """How Gaussians come and go: none; paper, section 3.5 of the paper (needs its losses); 3dgs,
    clone, split, prune and reset; residual, new ones where the back-projected residual peaks;
    motion, between frames, more for a body that moves fast and fewer for one that stands still.
    Left out: paper with the paper's losses, else none."""
    recipe: Recipe = "rfgs"
    """rfgs: our start, rates and steps; paper: the paper's numbers."""
    calibrate: Calibrate = "none"
    """Estimate each device's phase and timing offset and take them out: of oscillators (phase), of
    clocks (timing) or both. From the empty room first, then together with the Gaussians."""
    seed: int = 0
    """Root seed; 0 is a seed like any other."""
    device: Device = "cpu"
    """Where reflectivities are solved and Gaussians refined: cpu, or cuda, the current GPU."""
    iterations: int | None = None
    """Adam steps per frame; the recipe's own number when left out."""
    gaussians: int | None = None
    """Moving Gaussians at the start; the recipe's own number when left out."""
    without: tuple[Part, ...] = ()
    """Leave out parts of the paper's recipe, as its table 2 does: rf_weights (in eq. 5), densify,
    feature_gradients (their condition for new Gaussians), prune; see `rfgs ablate`."""
    temporal: float = 0.0
    """Weight with which Gaussians are held to their place on the body from frame to frame."""
    posture: Posture = "told"
    """told: the radio decides in every frame who stands and who sits, and where the knees point;
    standing: everybody stands, as is assumed without phases anyway."""
    log: bool = False
    """Write curves of loss and number of Gaussians into OUT/log, for `tensorboard --logdir`."""
    shader: Annotated[bool, tyro.conf.arg(name="shader")] = True
    """Colour the frozen Gaussians from training pictures afterwards, for display only. Without any
    such picture they stay grey."""


def run(args: TrainArgs) -> int:
    """Trains, then colours the result where the dataset has pictures."""
    from rfgs_core.dataset import open_dataset
    from rfgs_core.errors import RfgsError
    from rfgs_core.frames import chosen_frames
    from rfgs_core.measure.observations import packets_to_read
    from rfgs_core.render.shader import ShaderConfig
    from rfgs_core.render.view import fit_run_shader
    from rfgs_core.run.calibration import calibration_text
    from rfgs_core.run.encoders import with_encoder
    from rfgs_core.run.training import train_sequence
    from rfgs_core.seeds import sub_seed

    config = TrainConfig.of_recipe(args.recipe, args.objective, args.seed)
    config = replace(
        config,
        channel=args.channel,
        observe=args.observe,
        background=args.background,
        static_set=args.static_set,
        calibrate=args.calibrate,
        density=args.density,
        posture=args.posture,
        device=args.device,
        temporal=args.temporal,
        without=args.without,
    )
    if args.without and args.objective == "csi":
        raise RfgsError(
            "--without leaves out parts of the paper's losses; expected --objective paper or both"
        )
    if not args.temporal >= 0.0:
        raise RfgsError(f"--temporal {args.temporal}: expected at least 0")
    if args.iterations is not None:
        if args.iterations < 0:
            raise RfgsError(f"--iterations {args.iterations}: expected at least 0")
        config = replace(config, iterations=args.iterations)
    if args.gaussians is not None:
        if args.gaussians < 1:
            raise RfgsError(f"--gaussians {args.gaussians}: expected at least 1")
        config = replace(config, num_gaussians=args.gaussians)
    config, encoder_file = with_encoder(config, args.encoder)
    dataset = open_dataset(args.dataset)
    sequence = dataset.sequence(args.sequence)
    if args.radio not in sequence.radios:
        raise RfgsError(
            f"{args.dataset} ({sequence.name}) has no radio {args.radio!r}; "
            f"it has {', '.join(sequence.radios)}"
        )
    config = replace(config, packets=packets_to_read(args.packets, sequence, args.radio, config))
    frames = chosen_frames(args.frames, sequence.frames)
    shader = args.shader and _can_color(dataset, sequence, frames)
    trained = train_sequence(
        dataset, sequence, args.radio, frames, config, args.out, encoder_file, log=args.log
    )
    if args.calibrate != "none":
        sys.stdout.write(f"offsets: {calibration_text(args.out, frames)}\n")
    if shader and not (args.out / "shader.npz").exists():
        seed = sub_seed(args.seed, "shader")
        fit_run_shader(trained, ShaderConfig.for_recipe(args.recipe, seed))
    sys.stdout.write(
        f"{args.out}: {len(frames)} frames, {len(trained.moving(frames[0]))} Gaussians, "
        f"{trained.config.train_s:.0f} s; next: rfgs eval {args.out}\n"
    )
    return 0


def _can_color(dataset: Dataset, sequence: Sequence, frames: list[int]) -> bool:
    """Whether there are pictures that the shader may be fitted to; says so where there are none."""
    from rfgs_core.render.view import split_pictures

    missing = [name for name in ("images", "mask") if name not in dataset.has]
    if missing:
        why = f"the dataset holds no {' and no '.join(missing)}"
    elif split_pictures(sequence, frames, "train"):
        return True
    else:
        why = "all pictures of these frames are held out for testing"
    sys.stderr.write(f"training without the shader, so that Gaussians stay grey: {why}\n")
    return False
