# SPDX-License-Identifier: Apache-2.0
"""`metrics.json` of a run: every metric, every baseline, conditions and verdicts."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from jaxtyping import Float
from tqdm import tqdm

from rfgs_core.evaluate.background import Backgrounds, background_metrics
from rfgs_core.evaluate.baselines import BASELINES, Baseline, BaselineResult, phase_free
from rfgs_core.evaluate.evidence import Evidence
from rfgs_core.evaluate.geometry import GEOMETRY_KEYS, geometry_metrics
from rfgs_core.evaluate.image import IMAGE_KEYS
from rfgs_core.evaluate.oracle import oracle_scores
from rfgs_core.evaluate.people import FramePeople, people_metrics
from rfgs_core.evaluate.pictures import Values, has_pictures, mean_of, picture_metrics
from rfgs_core.evaluate.price import frames_stage, price_line
from rfgs_core.evaluate.provenance import conditions, hardware, limits, now, versions
from rfgs_core.evaluate.residual import GAUSSIANS_ALONE, Answer, with_residual
from rfgs_core.evaluate.rf import RF_KEYS, frame_rf, pool_rf, rf_values
from rfgs_core.evaluate.scene import EvaluatedRun, Scene
from rfgs_core.evaluate.verdicts import verdicts
from rfgs_core.measure.observations import Kept, excess_turn
from rfgs_core.past import timed
from rfgs_core.render.view import pictures_of
from rfgs_core.seals import write_sealed_json

SCHEMA = "rfgs-metrics/2"
#: Name of the evaluated method among the baselines while they are computed alike.
METHOD = "method"
#: The bar of the first frame, which also waits for kernels: nothing tells what is left yet.
_FIRST_FRAME = "{l_bar}{bar}| {n_fmt}/{total_fmt} [{elapsed}]"
MEDIANS = ("element_snr_median_db", "subcarrier_snr_median_db")


def evaluate_run(run: EvaluatedRun, *, oracle: bool = True) -> dict[str, Any]:
    """Evaluates a run with all its baselines and writes `metrics.json` into it.

    Args:
        run: A trained run.
        oracle: Whether to run `oracle_init`, which trains once more.

    Returns:
        What was written.
    """
    start_s = time.perf_counter()
    scene = Scene.of(run)
    table, room = _Table(), Backgrounds.of(scene)
    pictures = pictures_of(run, "test") if has_pictures(run) else []
    sys.stderr.write(f"{price_line(run, len(pictures), oracle=oracle)}\n")
    steps = len(run.frames) * (1 + len(BASELINES)) + len(pictures)
    with tqdm(total=steps, desc="evaluate", unit="step") as bar:
        usual = bar.bar_format
        bar.bar_format = usual or _FIRST_FRAME
        with timed(frames_stage(run)) as clock:
            for frame in run.frames:
                _evaluate_frame(scene, frame, table, room, bar.update)
                clock.step()
                bar.bar_format = usual
        image, image_reasons = ({}, {})
        if pictures:
            image, image_reasons = picture_metrics(run, bar.update)
    _add_oracle(scene, table, oracle)
    groups = table.groups(image)
    metrics: dict[str, Any] = groups.pop(METHOD)
    metrics["baselines"] = groups
    metrics["reasons"] = table.reasons(image, image_reasons, bool(pictures))
    metrics["frames"] = table.frames()
    metrics["people"] = people_metrics(table.people) if table.people else None
    metrics["background"] = None if room is None else background_metrics(scene, room)
    metrics |= _circumstances(scene)
    metrics["verdicts"] = verdicts(metrics)
    metrics["eval_s"] = round(time.perf_counter() - start_s, 2)
    write_sealed_json(run.path / "metrics.json", metrics)
    return metrics


def _circumstances(scene: Scene) -> dict[str, Any]:
    """What stands beside the numbers."""
    run = scene.run
    return {
        "schema": SCHEMA,
        "limits": limits(scene),
        "trace_depth": run.sequence.trace_depth(scene.radio.name),
        "n_gaussians": len(run.gaussians(run.frames[0])),
        "train_s": run.config.train_s,
        "conditions": conditions(scene),
        "hardware": hardware(),
        "versions": versions(),
        "date": now(),
    }


def evaluate_method(run: EvaluatedRun) -> dict[str, dict[str, Values]]:
    """Geometry and channels of a run by itself, without baselines, ceiling, pictures or files.

    Returns:
        The groups of the method, and of its Gaussians without their residual.
    """
    scene, table = Scene.of(run), _Table()
    for frame in run.frames:
        _evaluate_frame(scene, frame, table, None, lambda: None, {})
    groups = table.groups({})
    return {name: groups[name] for name in (METHOD, GAUSSIANS_ALONE)}


def evaluate_answers(
    run: EvaluatedRun, answers: Callable[[int, Evidence], Mapping[str, BaselineResult]]
) -> dict[str, dict[str, Values]]:
    """Geometry and channels of what is answered to each frame's evidence.

    Args:
        run: Names data, radio and frames, and has no bodies or Gaussians.
        answers: Results of a frame for `METHOD` and, without its residual, `GAUSSIANS_ALONE`.

    Returns:
        The groups of both.
    """
    scene, table = Scene.of(run), _Table()
    nothing = np.zeros(scene.grid.shape, dtype=np.float32)
    for frame in run.frames:
        reference, csi = scene.reference(frame), scene.csi(frame)
        for name, result in answers(frame, scene.evidence(frame, nothing)).items():
            _add(scene, table, name, frame, result, reference, csi)
    groups = table.groups({})
    return {name: groups[name] for name in (METHOD, GAUSSIANS_ALONE)}


class _Table:
    """Per-frame rows of the method and of each baseline, its people, and why values are missing."""

    def __init__(self) -> None:
        self.rows: dict[str, dict[int, dict[str, Any]]] = {}
        self.why: dict[str, str] = {}
        self.people: list[FramePeople] = []

    def add(self, name: str, frame: int, group: str, value: dict[str, Any]) -> None:
        """Stores one group of one frame."""
        self.rows.setdefault(name, {}).setdefault(frame, {})[group] = value

    def groups(self, image: dict[str, Values]) -> dict[str, dict[str, Values]]:
        """All groups of all names, pooled over frames; what is missing is None."""
        result: dict[str, dict[str, Values]] = {}
        for name in (METHOD, GAUSSIANS_ALONE, *BASELINES, "silhouette", "oracle_init"):
            rows = list(self.rows.get(name, {}).values())
            geometry = mean_of(
                [row["geometry"] for row in rows if "geometry" in row], GEOMETRY_KEYS
            )
            result[name] = {"geometry": geometry, "image": image.get(name, _none(IMAGE_KEYS))}
            for group in ("rf", "rf_csi"):
                parts = [row[group] for row in rows if group in row]
                result[name][group] = pool_rf(parts) if parts else _none((*RF_KEYS, *MEDIANS))
        return result

    def frames(self) -> list[dict[str, Any]]:
        """Values of each frame: the method's own and those of every baseline."""
        result = []
        for frame in self.rows[METHOD]:
            row: dict[str, Any] = {"frame": frame, "baselines": {}}
            for name, rows in self.rows.items():
                part = {
                    group: value if group == "geometry" else rf_values(value)
                    for group, value in rows.get(frame, {}).items()
                }
                if name == METHOD:
                    row |= part
                else:
                    row["baselines"][name] = part
            result.append(row)
        return result

    def reasons(
        self, image: dict[str, Values], image_reasons: dict[str, str], pictures: bool
    ) -> dict[str, str]:
        """Why values are None: dotted path of a group or value → one sentence."""
        result = {f"baselines.{name}": why for name, why in self.why.items()}
        for name, why in image_reasons.items():
            if name == "lpips":
                result["image.lpips"] = why
            else:
                result["image" if name == METHOD else f"baselines.{name}.image"] = why
        if not pictures:
            result["image"] = "the dataset holds no pictures that the shader did not see"
        else:
            result["baselines.*.image"] = "only empty_room and silhouette are pictures"
        result["baselines.silhouette"] = "a baseline of pictures; it says nothing about space"
        result["baselines.zero.rf.device_gain_mae_db"] = "a power of zero has no level in dB"
        result["baselines.empty_room.rf.device_gain_mae_db"] = "a power of zero has no level in dB"
        return result


def _none(keys: tuple[str, ...]) -> Values:
    return dict.fromkeys(keys)


def _evaluate_frame(
    scene: Scene,
    frame: int,
    table: _Table,
    room: Backgrounds | None,
    on_step: Callable[[], Any],
    baselines: Mapping[str, Baseline] = BASELINES,
) -> None:
    """Method and baselines on one frame."""
    reference, csi = scene.reference(frame), scene.csi(frame)
    score, predicted = scene.score(frame), scene.run.predict(frame)
    evidence = scene.evidence(frame, score)
    people = scene.people(frame, score)
    if people is not None:
        table.people.append(people)
    # Without phases there is no channel to compare with, and nothing is left to add.
    whole = predicted
    if scene.observe == "complex":
        change = scene.run.visible_change(frame, scene.run.observations(frame))
        seen = replace(evidence, delta=change)
        whole = with_residual(predicted, seen, partial(_from_less, scene.run, frame))
    # A static set brings the method's own empty room.
    best, alone = (None, None) if room is None else (room.best, room.whole)
    _add(scene, table, METHOD, frame, BaselineResult(score, whole, best), reference, csi)
    model = BaselineResult(
        delta=predicted, static=alone, reason="the method's own Gaussians without the residual"
    )
    _add(scene, table, GAUSSIANS_ALONE, frame, model, reference, csi)
    on_step()
    excess_m = scene.run.config.settings.excess_m
    spared = evidence.lengthened(-excess_m)
    for name, baseline in baselines.items():
        # Baselines are spared the wall that the method found.
        result = phase_free.answer(name, baseline, spared, scene.observe)
        if result.delta is not None and excess_m:
            turn = excess_turn(scene.radio.freq_hz, excess_m)
            result = replace(result, delta=result.delta * turn)
        _add(scene, table, name, frame, result, reference, csi)
        on_step()


def _from_less(run: EvaluatedRun, frame: int, kept: Kept) -> Answer:
    """What is visible of some entries, and what the method says from them."""
    less = run.observations(frame, kept)
    return Answer(run.visible_change(frame, less), run.refitted(frame, less))


def _add(
    scene: Scene,
    table: _Table,
    name: str,
    frame: int,
    result: BaselineResult,
    reference: Float[np.ndarray, "n 3"],
    csi: np.ndarray,
) -> None:
    """Scores one answer about one frame.

    A method that brings no empty room of its own is completed with the kriged one.
    """
    if result.reason:
        table.why[name] = result.reason
    if result.score is not None:
        geometry = geometry_metrics(result.score, scene.grid, reference, scene.voxels)
        table.add(name, frame, "geometry", geometry)
    if result.delta is None:
        return
    static = scene.environment if result.static is None else result.static
    rf = frame_rf(csi - scene.csi_static, result.delta, scene.held_out, scene.layout)
    table.add(name, frame, "rf", rf)
    both = frame_rf(csi, result.delta + static, scene.held_out, scene.layout)
    table.add(name, frame, "rf_csi", both)


def _add_oracle(scene: Scene, table: _Table, wanted: bool) -> None:
    """The fit started on the true surface: how far this model and these data could go."""
    if not wanted:
        table.why["oracle_init"] = "left out with --no-oracle"
        return
    scores = oracle_scores(scene)
    for frame, score in scores.items():
        result = BaselineResult(score=score, reason="only its geometry is compared")
        _add(scene, table, "oracle_init", frame, result, scene.reference(frame), scene.csi(frame))
