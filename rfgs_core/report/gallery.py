# SPDX-License-Identifier: Apache-2.0
"""The gallery: a tile per scene with the true surface, our Gaussians and the strongest baseline."""

from __future__ import annotations

import contextlib
import io
from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from rfgs_core.dataset import Sequence, open_dataset
from rfgs_core.errors import RfgsError
from rfgs_core.evaluate.provenance import hardware, now, versions
from rfgs_core.evaluate.scene import EvaluatedRun, Scene
from rfgs_core.figures.clouds import FARTHEST_M
from rfgs_core.figures.style import bytes_uri, picture_uri, power_colours
from rfgs_core.files import write_text
from rfgs_core.render.view import moving_gaussians
from rfgs_core.report.cards import in_words
from rfgs_core.report.page import Panel, Tile, Verdict, gallery_page, pairs
from rfgs_core.report.stage import Stage, points_of, staged
from rfgs_core.report.tables import show
from rfgs_core.study.gallery import ranked_baselines

#: Quality of the pictures and of their edges. More effort saves a twentieth in a hundred times the
#: time.
_ENCODING = {"quality": 70, "alpha_quality": 60, "method": 4}
#: F-scores below a picture.
_SHOWN = (("F10", "f10"), ("F5", "f05"))
#: Instances by class: one, several.
_WORDS = {"person": ("one person", "people"), "vehicle": ("one vehicle", "vehicles")}


def tile_of(run: EvaluatedRun, methods: Mapping[str, Any]) -> Tile:
    """The tile of a run.

    Args:
        run: The run of our Gaussians.
        methods: Groups of metrics of `rfgs` and of every baseline.
    """
    sequence, stage = run.sequence, staged(run.sequence)
    others = ranked_baselines(methods)
    baseline = next(iter(others), None)
    ours = Panel(
        "RF-GS",
        "our Gaussians, fitted to radio alone",
        [_picture(stage.drawn(moving_gaussians(run, frame), frame)) for frame in run.frames],
        _scores(methods["rfgs"]),
    )
    theirs = Panel("no baseline", "no baseline finds any of it", [])
    if baseline is not None:
        title = f"strongest of {len(others)} baselines: {in_words(baseline)}"
        scene = Scene.of(run)
        pictures = [
            _picture(stage.voxels(points_of(scene, frame, baseline), frame)) for frame in run.frames
        ]
        theirs = Panel(title, title, pictures, _scores(methods[baseline]))
    return Tile(
        anchor=sequence.info.scene,
        title=_titled(sequence.info.scene),
        about=_about(sequence, str(run.config.radio)),
        panels=[_truth(stage), ours, theirs],
        frames=run.frames,
        time_s=[sequence.time_s(frame) for frame in run.frames],
        verdict=_verdict(methods, baseline),
    )


def tile_without_run(scene: str, radio: str, data: Path, why: str) -> Tile:
    """The tile of a scene that we have no answer about: what is known of the truth, and why.

    Args:
        scene: Name of the scene.
        radio: Its radio.
        data: Folder of its dataset, if that could be made.
        why: Why there is no run.
    """
    about, panels, frames, times_s = radio, [], [], []
    # No dataset, a damaged one or one where nothing moves is what `why` tells of.
    with contextlib.suppress(RfgsError):
        sequence = open_dataset(data).sequence()
        about = _about(sequence, radio)
        panels = [_truth(staged(sequence)), Panel("RF-GS", "no answer", [])]
        frames = sequence.frames
        times_s = [sequence.time_s(frame) for frame in frames]
    return Tile(
        scene, _titled(scene), about, panels, frames, times_s, Verdict("open", "No answer", why)
    )


def write_gallery(path: Path, tiles: list[Tile], command: str) -> None:
    """Writes the page.

    Args:
        path: The page.
        tiles: One per scene.
        command: What made it.
    """
    counts = Counter(tile.verdict.subcarrier for tile in tiles)
    several = "s" if len(tiles) != 1 else ""
    rest = f", and {counts['open']} not decided" if counts["open"] else ""
    lead = (
        f"{len(tiles)} scene{several}, each heard by one radio. By F10, the match with the true "
        "surface within 10 cm, RF-GS is ahead of the strongest of all baselines in "
        f"{counts['won']}, behind it in {counts['lost']}{rest}."
    )
    provenance = [("command", command), ("made", now()), *pairs(hardware()), *pairs(versions())]
    colours = power_colours()(np.linspace(0.0, 1.0, 64))[None, :, :3].astype(np.float32)
    legend = (picture_uri(colours), f"{100 * FARTHEST_M:.0f} cm")
    write_text(path, gallery_page(tiles, lead, legend, provenance))


def _truth(stage: Stage) -> Panel:
    """The true surface, frame by frame."""
    pictures = [_picture(stage.truth(frame)) for frame in stage.surfaces]
    return Panel("true surface", "the true surface of what moves", pictures)


def _picture(drawn: Image.Image) -> str:
    """One frame of a panel."""
    stream = io.BytesIO()
    drawn.save(stream, format="WEBP", **_ENCODING)
    return bytes_uri(stream.getvalue(), "webp")


def _scores(groups: Mapping[str, Any]) -> str:
    geometry = groups["geometry"]
    shown = [f"{name}\N{NO-BREAK SPACE}{show(geometry[key], 2)}" for name, key in _SHOWN]
    return ", ".join(shown)


def _verdict(methods: Mapping[str, Any], baseline: str | None) -> Verdict:
    """Whether ours is ahead, told by the numbers as they are shown."""
    if baseline is None:
        return Verdict("open", "Not decided", "no baseline finds any of it.")
    ahead = {
        key: round(methods["rfgs"]["geometry"][key], 2)
        - round(methods[baseline]["geometry"][key], 2)
        for key in ("f10", "f05")
    }
    finer = _than(ahead["f05"])
    if ahead["f10"] == 0.0:
        text = f"RF-GS and this baseline are level within 10 cm; within 5 cm RF-GS is {finer}."
        return Verdict("open", "Level", text)
    won = ahead["f10"] > 0.0
    text = f"RF-GS is {_than(ahead['f10'])} within 10 cm, and {finer} within 5 cm."
    return Verdict("won", "Won", text) if won else Verdict("lost", "Lost", text)


def _than(ahead: float) -> str:
    if round(ahead, 2) == 0.0:
        return "level"
    return f"{abs(ahead):.2f} {'ahead' if ahead > 0.0 else 'behind'}"


def _about(sequence: Sequence, radio: str) -> str:
    """Who moves, which frames, by which radio they are heard, and how it was traced."""
    spec, depth, times_s = (
        sequence.radio_spec(radio),
        sequence.trace_depth(radio),
        [sequence.time_s(frame) for frame in sequence.frames],
    )
    band = f"{spec.freq_min_hz / 1e9:.4g}–{spec.freq_max_hz / 1e9:.4g} GHz"
    apart = f", {times_s[1] - times_s[0]:g} s apart" if len(times_s) > 1 else ""
    tracer = {"fast": "the fast tracer", "sionna": "Sionna RT"}.get(
        sequence.info.tracer, sequence.info.tracer
    )
    return (
        f"{_who(sequence.instances)}. {len(times_s)} frames{apart}. {radio} ({band}), "
        f"{len(sequence.info.devices[radio])} devices, traced by {tracer} to depth {depth}."
    )


def _titled(scene: str) -> str:
    return scene.replace("_", " ").capitalize()


def _who(instances: Iterable[Mapping[str, Any]]) -> str:
    """Who or what moves, and that nobody does."""
    counts = Counter(str(row["class"]) for row in instances if row.get("nominal_surface_m2"))
    if not counts:
        return "Nothing moves"
    parts = [] if counts["person"] else ["no person"]
    for kind in sorted(counts, key=lambda kind: (kind != "person", kind)):
        one, several = _WORDS.get(kind, (f"one {kind}", f"of {kind}"))
        parts.append(one if counts[kind] == 1 else f"{counts[kind]} {several}")
    words = ", ".join(parts)
    return words[0].upper() + words[1:]
