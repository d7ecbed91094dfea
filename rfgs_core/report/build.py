# SPDX-License-Identifier: Apache-2.0
"""Collects what a report shows: pictures, figures, tables and where they come from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rfgs_core.evaluate.pictures import (
    has_pictures,
    rendered_picture,
    true_picture,
)
from rfgs_core.evaluate.scene import EvaluatedRun, Scene
from rfgs_core.evaluate.verdicts import LOST, OPEN, WON
from rfgs_core.figures.motion import write_motion_chart
from rfgs_core.figures.radio import channel_chart, delay_angle_chart, f10_chart
from rfgs_core.figures.shapes import shape_chart
from rfgs_core.figures.style import BASELINE, file_uri, picture_uri
from rfgs_core.files import write_text
from rfgs_core.render.view import pictures_of
from rfgs_core.report.cards import headline_cards, in_words, strongest
from rfgs_core.report.limbs import limbs_of
from rfgs_core.report.metrics_file import read_metrics
from rfgs_core.report.page import (
    Page,
    RunSection,
    Shot,
    Verdict,
    image_file,
    pairs,
    render_page,
    stage_times,
)
from rfgs_core.report.player import player_of
from rfgs_core.report.tables import metric_tables
from rfgs_core.run.people import HeadCount

#: Pictures of the scene and rows of rendered views, at most.
SCENE_SHOTS, VIEW_ROWS = 4, 4
#: Pictures at least this wide are large enough to lead the page [px].
HERO_PX = 400
#: Baselines drawn beside the method frame by frame, and the strongest of all others.
DRAWN = {"matched_filter": BASELINE, "template": "#6a994e", "oracle_init": "#b8a1d9"}
STRONGEST = "#c9a227"
#: Pictures a demo may leave beside its report, with their captions.
BLENDER_PICTURES = {
    "inspect.png": "The fitted Gaussians imported into Blender, beside the scene they came from.",
}


def write_run_report(run: EvaluatedRun) -> Path:
    """Writes `report.html` into an evaluated run.

    Args:
        run: The run; `metrics.json` is there.

    Raises:
        RfgsError: The run has not been evaluated.
    """
    metrics = read_metrics(run.path)
    known = {"training": metrics.get("train_s"), "evaluation": metrics.get("eval_s")}
    timings = {name: float(value) for name, value in known.items() if value is not None}
    target = run.path / "report.html"
    _write(target, [(run, metrics)], timings, command=f"rfgs report {run.path.name}")
    return target


def write_demo_report(
    demo_dir: Path,
    runs: Sequence[EvaluatedRun],
    timings: Mapping[str, float],
) -> Path:
    """Writes the demo's `report.html`: one scene, several radios.

    Args:
        demo_dir: Folder of the demo; `inspect.png` in it is shown if present.
        runs: Evaluated runs on the same sequence.
        timings: Seconds per stage, in order.

    Returns:
        The page.

    Raises:
        RfgsError: A run has not been evaluated.
    """
    blender = []
    for name, caption in BLENDER_PICTURES.items():
        data = image_file(demo_dir / name)
        if data is not None:
            blender.append(Shot(file_uri(data), caption))
    target = demo_dir / "report.html"
    evaluated = [(run, read_metrics(run.path)) for run in runs]
    _write(target, evaluated, timings, "make demo", blender)
    return target


def _write(
    target: Path,
    runs: Sequence[tuple[EvaluatedRun, dict[str, Any]]],
    timings: Mapping[str, float],
    command: str,
    blender: Sequence[Shot] = (),
) -> None:
    first, metrics = runs[0]
    info = first.sequence.info
    frames = first.sequence.frames
    page = Page(
        title=f"RF-GS on {info.scene}",
        lead=(
            f"{len(frames)} frames at {first.sequence.fps:g} frames per second, seen by "
            f"{', '.join(str(run.config.radio) for run, _ in runs)}. The Gaussians are fitted "
            "to channel state information alone; colours are added afterwards, for display."
        ),
        scene=_scene_shots(first),
        hero=bool(first.sequence.cameras) and first.sequence.cameras[0]["width"] >= HERO_PX,
        runs=[_section(run, part) for run, part in runs],
        timings=stage_times(dict(timings)),
        provenance=_provenance(first, metrics, command),
        blender=list(blender),
    )
    write_text(target, render_page(page))


def _scene_shots(run: EvaluatedRun) -> list[Shot]:
    """True pictures: the first camera over time, then other cameras."""
    if not has_pictures(run):
        return []
    cameras, frames = [row["name"] for row in run.sequence.cameras], run.frames
    middle = frames[len(frames) // 2]
    wanted = [(cameras[0], middle), *((camera, middle) for camera in cameras[1:])]
    return [
        Shot(
            picture_uri(run.sequence.image(camera, frame)[..., :3]),
            f"{camera}, frame {frame}",
        )
        for camera, frame in wanted[:SCENE_SHOTS]
    ]


def _conditions(run: EvaluatedRun, metrics: dict[str, Any]) -> dict[str, Any]:
    """What was asked for, how far paths were traced, and how the number of people is known."""
    heads = HeadCount.read(run.path)
    people = {} if heads is None else {"people": str(heads)}
    return metrics["conditions"] | {"trace_depth": metrics["trace_depth"]} | people


def _section(run: EvaluatedRun, metrics: dict[str, Any]) -> RunSection:
    scene = Scene.of(run)
    frame = run.frames[len(run.frames) // 2]
    centroid = scene.reference(frame).mean(axis=0)
    radio = scene.radio
    shapes, colours = shape_chart(scene, frame)
    return RunSection(
        anchor=f"run-{radio.name}",
        title=f"{radio.name}: {radio.freq_min_hz / 1e9:.4g}–{radio.freq_max_hz / 1e9:.4g} GHz",
        cards=headline_cards(metrics),
        player=player_of(run),
        verdicts=[_verdict(sentence) for sentence in metrics["verdicts"]],
        channel=Shot(
            channel_chart(scene, frame),
            "Channel amplitudes over receiving elements and frequency, with and without the "
            "empty room, and the delay profile of the difference over all frames.",
        ),
        delay_angle=Shot(
            delay_angle_chart(scene, frame, centroid),
            f"Delay–angle images of the difference to the empty room, frame {frame}. The ring "
            "marks where the true person's direct echo belongs.",
        ),
        shape=Shot(
            shapes,
            f"Frame {frame}: true mesh (grey), Gaussians coloured by {colours}, and what "
            "the matched filter alone would say.",
        ),
        f10=Shot(
            f10_chart(metrics["frames"], _drawn(metrics)),
            "How well every frame matches the true moving surface, beside what knows less; the "
            "fit that starts on the truth is a ceiling and does not compete.",
        ),
        limbs=limbs_of(run),
        motion=_motion(run),
        views=_views(run),
        tables=metric_tables(metrics),
        limits=_limits(metrics),
        conditions=pairs(_conditions(run, metrics)),
        reasons=sorted(metrics["reasons"].items()),
    )


def _drawn(metrics: dict[str, Any]) -> dict[str, tuple[str, str]]:
    """Words and colour of each baseline that is drawn."""
    best = strongest(metrics, "geometry", "f10")
    colours = ({} if best is None else {best[0]: STRONGEST}) | DRAWN
    return {name: (in_words(name), colour) for name, colour in colours.items()}


def _motion(run: EvaluatedRun) -> Shot | None:
    """Number of Gaussians over time; the picture stays in the run as `motion.png`."""
    path = run.path / "motion.png"
    if not write_motion_chart(path, run.path, run.sequence, run.frames):
        return None
    return Shot(
        file_uri(path.read_bytes()),
        "Moving Gaussians over time, and how fast their bodies move over the ground: the track "
        "that was estimated from radio, beside the true pelvis.",
    )


def _verdict(sentence: str) -> Verdict:
    for prefix, subcarrier in ((WON, "won"), (LOST, "lost"), (OPEN, "open")):
        if sentence.startswith(prefix):
            return Verdict(subcarrier, prefix.rstrip(": "), in_words(sentence[len(prefix) :]))
    return Verdict("open", "Note", sentence)


def _views(run: EvaluatedRun) -> list[list[Shot]]:
    """True and rendered pictures that the shader never saw, spread over cameras and frames."""
    if not has_pictures(run):
        return []
    unseen = pictures_of(run, "test")
    if not unseen:
        return []
    chosen = [unseen[i] for i in np.unique(np.linspace(0, len(unseen) - 1, VIEW_ROWS).astype(int))]
    rows = []
    for camera, frame in chosen:
        true, rendered = true_picture(run, camera, frame), rendered_picture(run, camera, frame)
        where = f"{camera}, frame {frame}"
        rows.append(
            [
                Shot(picture_uri(true.rgb), f"true, {where}"),
                Shot(picture_uri(rendered.rgb), "rendered into the empty room"),
                Shot(picture_uri(true.on_grey), "true person"),
                Shot(picture_uri(rendered.on_grey), "rendered person"),
            ]
        )
    return rows


def _limits(metrics: dict[str, Any]) -> list[tuple[str, str]]:
    """Resolution of the radio, in words."""
    reach, cross = metrics["limits"]["range_resolution_m"], metrics["limits"]["cross_range_m"]
    return [
        ("range resolution c/2B", f"{reach:.3f} m"),
        (
            "cross-range λR/D at half the room's diagonal",
            "–" if cross is None else f"{cross:.3f} m",
        ),
    ]


def _provenance(run: EvaluatedRun, metrics: dict[str, Any], command: str) -> list[tuple[str, str]]:
    rows = [("command", command), ("evaluated", str(metrics["date"]))]
    rows += [(f"hardware: {name}", value) for name, value in pairs(metrics["hardware"])]
    versions = ", ".join(f"{name} {value}" for name, value in metrics["versions"].items())
    rows.append(("versions", versions))
    rows.append(("scene file, SHA-256", run.sequence.info.blend_sha256))
    return rows
