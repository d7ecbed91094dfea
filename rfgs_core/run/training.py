# SPDX-License-Identifier: Apache-2.0
"""Training over the frames of a sequence: warm start, files, resume."""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from pathlib import Path

from rfgs_core.arrays import save_arrays
from rfgs_core.background.learned import (
    learned_background,
    need_enough_frames,
    without_movers,
)
from rfgs_core.background.static_set import fit_static_set
from rfgs_core.dataset import Dataset, Sequence
from rfgs_core.device import need_device
from rfgs_core.files import sweep
from rfgs_core.fit.calibrate import calibrate
from rfgs_core.fit.frame import FrameState, start_anywhere, start_frame, start_on_skins
from rfgs_core.fit.refine import need_sample_points
from rfgs_core.fit.stages import fit_frame
from rfgs_core.gaussians.ply import GaussianCloud, read_ply, write_ply
from rfgs_core.limbs.weights import Trained
from rfgs_core.locks import alone_in
from rfgs_core.measure.offsets import Offsets
from rfgs_core.measure.resolving import resolving
from rfgs_core.past import Speed, Stage, note_speed
from rfgs_core.run.begun import POINT_CLOUD_FILE, asked_of, open_or_create, refuse_other_files
from rfgs_core.run.calibration import (
    calibration_path,
    need_shared_links,
    read_calibration,
    write_calibration,
)
from rfgs_core.run.checkpoint import (
    finished_frame,
    is_finished,
    lost_limbs,
    partial_path,
    store_frame,
)
from rfgs_core.run.config import REMEDY
from rfgs_core.run.costs import CostBar, cost_bar, pose_stages, price_line
from rfgs_core.run.data import need_a_band, need_one_port
from rfgs_core.run.encoders import (
    ENCODER_FILE,
    keep_encoder,
    refuse_other_radios,
    run_encoder,
)
from rfgs_core.run.excess import ExcessPath
from rfgs_core.run.find_limbs import (
    evidence_tells,
    find_limbs,
    frames_read,
    limbs_network,
    limbs_wanted,
    looks_at,
)
from rfgs_core.run.folder import (
    BACKGROUND_FILE,
    Run,
    open_run,
)
from rfgs_core.run.limbs import Limbs
from rfgs_core.run.log import Scalars, TrainingLog
from rfgs_core.run.people import People, known_people, need_no_people
from rfgs_core.run.pose_bars import PoseBars
from rfgs_core.run.static import (
    has_static_set,
    need_phases,
    static_cloud,
    write_static_set,
)
from rfgs_core.seeds import sub_seed
from rfgs_core.settings import TrainConfig
from rfgs_core.threads import one_torch_thread


def train_sequence(
    dataset: Dataset,
    sequence: Sequence,
    radio: str,
    frames: list[int],
    config: TrainConfig,
    out: Path,
    encoder_file: Path | None = None,
    *,
    people: People = "told",
    excess: ExcessPath = 0.0,
    log: bool = False,
) -> Run:
    """Fits every frame, each starting from the one before; finished frames are kept.

    Args:
        dataset: Where the sequence comes from.
        sequence: What to fit.
        radio: Which radio.
        frames: Which frames.
        config: Settings.
        out: Folder of the run.
        encoder_file: Learned encoder of the settings, copied into the run.
        people: How it is known how many people there are; a run keeps what it began with.
        excess: How it is known what paths over people are longer than straight lines [m].
        log: Write curves for TensorBoard into `out`/log.

    Raises:
        RfgsError: `out` holds a run with other settings, or they do not go together or ask of the
            radio and the sequence what these do not have.
    """
    need_no_people(config, people)
    _check(dataset, sequence, radio, config)
    if encoder_file is not None:
        refuse_other_radios(encoder_file, sequence, radio, config.packets)
    refuse_other_files(out)
    out.mkdir(parents=True, exist_ok=True)
    with alone_in(out, out, "rfgs train"):
        sweep(out, ".tmp-*")
        begin = time.perf_counter()
        asked, heads = asked_of(out, dataset, sequence, radio, frames, config, people, excess)
        asked = replace(asked, train_s=round(time.perf_counter() - begin, 2))
        # The file of a run does not keep every setting: the device is free.
        run = open_or_create(out, asked)
        if heads is not None:
            heads.write(out)
        return _train(run, asked.settings, sequence, encoder_file, log)


def _train(
    run: Run, config: TrainConfig, sequence: Sequence, encoder_file: Path | None, log: bool
) -> Run:
    """Fits what is missing of a run."""
    out, radio = run.path, run.config.radio
    if encoder_file is not None and not (out / ENCODER_FILE).exists():
        keep_encoder(encoder_file, out)
    if config.background == "learned" and not (out / BACKGROUND_FILE).exists():
        _learn_background(out, sequence, radio, config)
    spent = _fit_frames(run, config, log)
    if config.static_set and not has_static_set(out):
        begin = time.perf_counter()
        # Of a calibrated run the background has no offsets only once a frame is fitted.
        seed = sub_seed(config.seed, sequence.name, radio, "static set")
        observations = run.observations(run.frames[0])
        with one_torch_thread():
            write_static_set(out, fit_static_set(observations, config.static_set, seed))
        spent += time.perf_counter() - begin
        replace(run.config, train_s=round(spent, 2)).write(out)
    _write_point_cloud(run)
    return open_run(out)


def _check(dataset: Dataset, sequence: Sequence, radio: str, config: TrainConfig) -> None:
    """Refuses settings that do not go together, or ask for what is not there."""
    need_a_band(sequence, radio)
    need_one_port(sequence, radio)
    need_shared_links(sequence, radio, config)
    need_phases(config)
    need_sample_points(config)
    need_device(config.device)
    if config.background == "learned":
        need_enough_frames(sequence)
    if config.channel == "impaired":
        sequence.impairments(radio)
    if config.encoder == "paths":
        dataset.need("paths")


def _learn_background(out: Path, sequence: Sequence, radio: str, config: TrainConfig) -> None:
    """Writes what takes the place of the empty room's capture."""
    empty = learned_background(sequence, radio, config.channel, config.observe, config.packets)
    if config.static_set:
        empty = without_movers(sequence, radio, empty, config)
    save_arrays(out / BACKGROUND_FILE, {"empty": empty})


def _fit_frames(run: Run, config: TrainConfig, log: bool) -> float:
    """Fits and stores the frames that are not finished; returns the time of all so far [s]."""
    spent = run.config.train_s
    before: FrameState | None = None
    begin = time.perf_counter()
    trained = limbs_network(run) if limbs_wanted(run, config) else None
    # What is told of limbs is not kept where it is of no use, and a finished run needs none of it.
    unfinished = lost_limbs(run) or not all(is_finished(run, frame) for frame in run.frames)
    posing = _posing(run, trained) if unfinished and (trained or _evidence(run, config)) else []
    can = resolving(run.sequence, run.config.radio, config.num_gaussians, config.observe)
    sys.stderr.write("".join(f"{line}\n" for line in [*can.lines(), price_line(run, posing)]))
    limbs = _limbs(run, config, trained, posing) if posing else None
    spent += time.perf_counter() - begin
    with (
        cost_bar(run, config.iterations) as bar,
        TrainingLog(run.path / "log" if log else None) as curves,
    ):
        for frame in run.frames:
            begin = time.perf_counter()
            state = finished_frame(run, frame)
            if state is None:
                with one_torch_thread():
                    state = _fit(run, frame, config, before, limbs, bar, curves.of_frame(frame))
                more = None if limbs is None else limbs.of_gaussians(frame, config)
                store_frame(run, frame, state, more)
                spent += time.perf_counter() - begin
                replace(run.config, train_s=round(spent, 2)).write(run.path)
                bar.finish_frame()
            else:
                bar.skip()
            before = state
    return spent


def _evidence(run: Run, config: TrainConfig) -> bool:
    """Whether evidence tells limbs without a network."""
    return limbs_wanted(run, config) and evidence_tells(run, frames_read(run))


def _posing(run: Run, trained: Trained | None) -> list[Stage]:
    """Finding and posing the people of all frames."""
    return pose_stages(run, len(frames_read(run)), looks_at(run, trained), known_people(run))


def _limbs(
    run: Run, config: TrainConfig, trained: Trained | None, posing: list[Stage]
) -> Limbs | None:
    """Follows and poses the people of all frames, where a network or evidence tells limbs."""
    with PoseBars() as bars, one_torch_thread():
        limbs = find_limbs(run, config, trained, bars.begin)
    for stage in posing:
        if stage.name in bars.step_s:
            note_speed(stage, Speed(0.0, bars.step_s[stage.name]))
    return limbs


def _fit(
    run: Run,
    frame: int,
    config: TrainConfig,
    before: FrameState | None,
    limbs: Limbs | None,
    bar: CostBar,
    scalars: Scalars | None = None,
) -> FrameState:
    """Runs all stages on one frame."""
    seed = sub_seed(config.seed, run.config.sequence, run.config.radio, frame, "fit")
    if config.calibrate != "none":
        _calibrate(run, frame, config, seed)
    observations = run.observations(frame)
    encoder = run_encoder(run.path, run.config, run.sequence, frame)
    earlier = None
    if config.density == "motion" and before is not None:
        earlier = run.observations(run.frames[run.frames.index(frame) - 1])
    bar.begin(f"frame {frame}, finding bodies")
    if config.start == "random":
        state = start_anywhere(observations, config, seed, before, encoder)
    elif limbs is None:
        state = start_frame(observations, config, seed, before, encoder, earlier)
    else:
        skins = limbs.on_skins(frame, config)
        state = start_on_skins(observations, config, skins, before, encoder)
    bar.found(f"frame {frame}, solving reflectivities")

    def on_step(loss: float, count: int) -> None:
        bar.step(f"frame {frame}, loss {loss:.3g}, {count} Gaussians")

    return fit_frame(
        observations,
        state,
        config,
        seed,
        encoder=encoder,
        checkpoint=partial_path(run, frame),
        on_solved=bar.solved,
        on_step=on_step,
        scalars=scalars,
    )


def _calibrate(run: Run, frame: int, config: TrainConfig, seed: int) -> None:
    """Finds a frame's offsets, unless that is done."""
    if calibration_path(run.path, frame).exists():
        return
    reported, known = run.as_reported(frame), None
    if config.channel == "impaired" and config.background == "empty_room":
        # The empty room of impaired channels is the clean one.
        known = Offsets.none(reported.layout)
    elif frame != run.frames[0]:
        known = read_calibration(run.path, run.frames[0]).capture
    write_calibration(run.path, frame, calibrate(reported, config, seed, known))


def _write_point_cloud(run: Run) -> None:
    """Static Gaussians and those of the first frame in one file, for any splat viewer."""
    write_ply(
        run.path / POINT_CLOUD_FILE,
        GaussianCloud.join(static_cloud(run.path), read_ply(run.ply_path(run.frames[0]), REMEDY)),
    )
