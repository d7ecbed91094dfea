# SPDX-License-Identifier: Apache-2.0
"""Which encoder a run uses: named on the command line, kept inside the run's folder."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from rfgs_core.dataset import Sequence
from rfgs_core.encode import MATCHED_FILTER, PAPER_FILTER, Encoder
from rfgs_core.encode.learned import load_encoder
from rfgs_core.encode.learned.signature import RadioSignature
from rfgs_core.encode.path_features import PathFeatures
from rfgs_core.errors import RfgsError
from rfgs_core.files import sha256, write_bytes
from rfgs_core.links import refuse_link
from rfgs_core.radio.path_table import PathTable
from rfgs_core.run.config import RunConfig
from rfgs_core.settings import Packets, TrainConfig

#: Name of a learned encoder inside a run.
ENCODER_FILE = "encoder.npz"


def with_encoder(config: TrainConfig, text: str) -> tuple[TrainConfig, Path | None]:
    """Settings with the encoder that a command line names, and its file.

    Args:
        config: Settings of the run.
        text: `matched_filter`, `paths`, or `cnn:FILE` with a file of `rfgs encode`.

    Raises:
        RfgsError: Nothing like that exists, or the file is no encoder.
    """
    kind, _, name = text.partition(":")
    if text == "matched_filter" or text == "paths":
        return replace(config, encoder=text), None
    if kind != "cnn" or not name:
        raise RfgsError(f"--encoder {text}: expected matched_filter, paths or cnn:FILE")
    file = Path(name)
    load_encoder(file)
    return replace(config, encoder="cnn", encoder_sha256=sha256(file)), file


def keep_encoder(file: Path, out: Path) -> None:
    """Copies a learned encoder into a run, so that both stay together."""
    refuse_link(file)
    write_bytes(out / ENCODER_FILE, file.read_bytes())


def refuse_other_radios(file: Path, sequence: Sequence, radio: str, packets: Packets) -> None:
    """Refuses an encoder that was made for another radio, or for other packets of it.

    Raises:
        RfgsError: Subcarriers, antennas or, if its network looks at them, packets differ.
    """
    encoder = load_encoder(file)
    freq_hz = np.array(sequence.coordinates(radio)["freq_hz"].values, dtype=np.float64)
    times_s = sequence.sample_times_s(radio, sequence.frames[0])
    rhythm = 1, 0.0
    if encoder.kind == "doppler" and packets == "all" and len(times_s) > 1:
        rhythm = len(times_s), float(times_s[1] - times_s[0])
    own = RadioSignature.of(sequence.layout(radio), freq_hz, *rhythm)
    encoder.radio.refuse_others(own, encoder.name)


def run_encoder(run: Path, config: RunConfig, sequence: Sequence, frame: int) -> Encoder:
    """The encoder of a run with the given settings.

    Args:
        run: Folder of the run.
        config: Its settings.
        sequence: What it is trained on.
        frame: Which frame; only encoders of traced paths differ from frame to frame.

    Raises:
        RfgsError: Its learned encoder is missing, damaged or another one, or the dataset holds no
            paths.
    """
    if config.settings.encoder == "paths":
        return PathFeatures(moving_paths(sequence, config.radio, frame))
    if config.settings.encoder != "cnn":
        # Networks bring the preprocessing that they were trained with.
        return PAPER_FILTER if config.settings.recipe == "paper" else MATCHED_FILTER
    file = run / ENCODER_FILE
    expected = config.settings.encoder_sha256
    if file.is_file() and sha256(file) != expected:
        raise RfgsError(
            f"{file} is not the encoder that this run began with (expected digest "
            f"{expected[:12]}, found {sha256(file)[:12]}); restore it or train again"
        )
    return load_encoder(file)


def moving_paths(sequence: Sequence, radio: str, frame: int) -> PathTable:
    """The traced paths that meet something that moves.

    Raises:
        RfgsError: The dataset holds no paths.
    """
    table = sequence.paths(radio, frame)
    moving = [row["id"] for row in sequence.info.objects if row["class"] != "static"]
    return table.select(np.isin(table.object, moving).any(axis=1))
