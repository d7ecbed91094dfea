# SPDX-License-Identifier: Apache-2.0
"""`rfgs encode`: trains an encoder on a radio's channels alone."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import tyro

from rfgs_core.dataset.observed import Observed
from rfgs_core.settings import Packets, TrainConfig


@dataclass(frozen=True)
class EncodeArgs:
    """Trains an encoder (a network from channels to 32 features at any point) on radio alone.

    Antennas and subcarriers are hidden, and predicted from the others through the propagation
    model. The file goes to `rfgs train --encoder cnn:FILE` for any dataset of the same radio.
    """

    dataset: tyro.conf.Positional[Path]
    """Dataset folder, as `rfgs-factory generate` makes it."""
    radio: str
    """Which of the dataset's radios, for example wifi."""
    out: Path
    """File to write, NAME.npz."""
    sequence: str | None = None
    """Which sequence; may be left out when there is only one."""
    frames: str | None = None
    """Frames A:B[:STEP] (inclusive), or one number; all when left out. The last of several is
    kept for the error that is printed."""
    network: Literal["auto", "csi", "cube", "doppler", "range"] = "auto"
    """csi: 2D over antennas and subcarriers (Wi-Fi); cube: 3D over range and angles (mmWave);
    doppler: 3D over Doppler, range and angle (mmWave with several chirps per frame); range: 1D
    over range (UWB); auto: by the radio."""
    channel: Observed = "clean"
    """clean: the traced channel; impaired: what `rfgs-factory impair` made of it."""
    packets: Packets | None = None
    """Of several packets (chirps) per frame: all, or first, the one at the frame's own time."""
    steps: int = 200
    """Adam steps, one frame each."""
    seed: int = 0
    """Root seed; 0 is a seed like any other."""


def run(args: EncodeArgs) -> int:
    """Trains and writes the encoder; exit code 0."""
    from tqdm import tqdm

    from rfgs_core.dataset import open_dataset
    from rfgs_core.encode.learned import network_for, save_encoder
    from rfgs_core.errors import RfgsError
    from rfgs_core.fit.self_supervised import train_encoder
    from rfgs_core.frames import chosen_frames
    from rfgs_core.measure.observations import observe, packets_to_read
    from rfgs_core.run.data import need_a_band, need_one_port

    if args.out.suffix != ".npz":
        raise RfgsError(f"--out {args.out}: expected a file name that ends in .npz")
    if args.steps < 1:
        raise RfgsError(f"--steps {args.steps}: expected at least 1")
    dataset = open_dataset(args.dataset)
    dataset.need("csi", "csi_static")
    sequence = dataset.sequence(args.sequence)
    need_a_band(sequence, args.radio)
    need_one_port(sequence, args.radio)
    packets = packets_to_read(args.packets, sequence, args.radio, TrainConfig())
    frames = [
        observe(sequence, args.radio, frame, args.channel, packets=packets)
        for frame in chosen_frames(args.frames, sequence.frames)
    ]
    network = network_for(frames[0]) if args.network == "auto" else args.network
    with tqdm(total=args.steps, desc=f"encode {args.radio}") as bar:

        def on_step(loss: float) -> None:
            bar.update(1)
            bar.set_postfix_str(f"hidden error {loss:.3f}")

        result = train_encoder(frames, network, args.steps, args.seed, on_step)
    save_encoder(args.out, result.encoder)
    where = "of an unseen frame" if result.unseen else "of the training frame"
    sys.stdout.write(
        f"{args.out}: network {network}; hidden entries {where} predicted with "
        f"{result.trained_db:.2f} dB error (untrained {result.untrained_db:.2f} dB); features vary "
        f"by {result.spread.deviation:.2f} of their RMS in {result.spread.rank:.1f} dimensions; "
        f"next: rfgs train {args.dataset} --radio {args.radio} --objective paper "
        f"--encoder cnn:{args.out} --out RUN\n"
    )
    return 0
