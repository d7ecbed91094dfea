# SPDX-License-Identifier: Apache-2.0
"""From metrics and figures to one self-contained HTML page."""

from __future__ import annotations

import base64
import hashlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from rfgs_core.links import refuse_link
from rfgs_core.report.tables import Table

#: Frames of the gallery that are farther apart follow each other this fast [s].
MOST_S = 0.8


@dataclass(frozen=True)
class Shot:
    """One embedded picture."""

    uri: str
    """Data URI."""
    caption: str
    """What it shows."""


@dataclass(frozen=True)
class Card:
    """One headline number."""

    value: str
    """Number as shown."""
    label: str
    """What it is."""
    note: str
    """What stands beside it."""
    subcarrier: str = ""
    """`won`, `lost` or nothing."""


@dataclass(frozen=True)
class Player:
    """Pictures of all frames, true and fitted."""

    camera: str
    """Through which camera."""
    seen: bool
    """Whether the shader was fitted to some of the true pictures."""
    frames: list[int]
    """Blender frame numbers."""
    time_s: list[float]
    """Their times [s]."""
    true: list[str]
    """Data URI of each true picture."""
    fitted: list[str]
    """Data URI of the Gaussians of each frame, drawn into the empty room."""


@dataclass(frozen=True)
class Verdict:
    """One sentence of judgement."""

    subcarrier: str
    """`won`, `lost` or `open`."""
    word: str
    """Won, Lost or Not decided."""
    text: str
    """The rest of the sentence."""


@dataclass(frozen=True)
class LimbSection:
    """What is known of limbs."""

    chart: Shot
    """Skeletons, estimated beside true."""
    sentences: list[str]
    """How far off joints are, and how many are seen."""
    table: Table
    """Each part of the body."""


@dataclass(frozen=True)
class RunSection:
    """Everything about one run."""

    anchor: str
    """Fragment of the section."""
    title: str
    """Heading."""
    cards: list[Card]
    """Headline numbers."""
    player: Player | None
    """True beside fitted; None without pictures."""
    verdicts: list[Verdict]
    """Won and lost comparisons."""
    channel: Shot
    """Amplitudes and delay profile."""
    delay_angle: Shot
    """Delay–angle images."""
    shape: Shot
    """Gaussians beside the true mesh."""
    f10: Shot
    """F10 per frame."""
    limbs: LimbSection | None
    """Skeletons and joints; None where no limbs were told."""
    motion: Shot | None
    """Gaussians and speeds over time; None of a few frames."""
    views: list[list[Shot]]
    """Rows of true, rendered and person-only pictures."""
    tables: list[Table]
    """Metrics beside baselines."""
    limits: list[tuple[str, str]]
    """Names and values."""
    conditions: list[tuple[str, str]]
    """Names and values."""
    reasons: list[tuple[str, str]]
    """Why values are missing."""


@dataclass(frozen=True)
class Page:
    """The whole page."""

    title: str
    """Heading."""
    lead: str
    """One sentence under it."""
    scene: list[Shot]
    """Pictures of the scene."""
    hero: bool
    """Whether the first of them is fine enough to be shown large."""
    runs: list[RunSection]
    """One section per run."""
    timings: list[tuple[str, str, float]]
    """Stage, duration and share of the longest in percent."""
    provenance: list[tuple[str, str]]
    """Names and values."""
    blender: list[Shot] = field(default_factory=list)
    """Gaussians imported into Blender."""


@dataclass(frozen=True)
class Panel:
    """One of the three pictures of a tile, over all frames."""

    title: str
    """What it shows."""
    alt: str
    """The same for who does not see it; why there is none where there is none."""
    pictures: list[str]
    """Data URI of each frame; empty where there is nothing to show."""
    score: str = ""
    """Its F-scores."""


@dataclass(frozen=True)
class Tile:
    """One scene."""

    anchor: str
    """Fragment of its section."""
    title: str
    """Name of the scene."""
    about: str
    """Who moves, by which radio it is heard, how it was traced."""
    panels: list[Panel]
    """Truth, ours, strongest baseline; none where nothing that moves can be drawn."""
    frames: list[int]
    """Blender frame numbers; empty without pictures."""
    time_s: list[float]
    """Their times [s]."""
    verdict: Verdict
    """Who is ahead, or why nobody is."""

    @property
    def tracks(self) -> list[list[str]]:
        """Pictures of those panels that have some."""
        return [panel.pictures for panel in self.panels if panel.pictures]


def _environment() -> Environment:
    return Environment(
        loader=PackageLoader("rfgs_core.report", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def render_page(page: Page) -> str:
    """The page as HTML."""
    return _environment().get_template("template.html.j2").render(page=page)


def comparison_page(rows: list[list[str]], notes: list[str]) -> str:
    """A comparison of two runs as HTML."""
    template = _environment().get_template("compare.html.j2")
    return template.render(head=rows[0], rows=rows[1:], notes=notes)


def gallery_page(
    tiles: list[Tile], lead: str, legend: tuple[str, str], provenance: list[tuple[str, str]]
) -> str:
    """The gallery as HTML, which may load and run nothing but what stands in it.

    Args:
        tiles: One per scene.
        lead: What they say together.
        legend: Data URI of all colours, and what the last one means.
        provenance: Names and values.
    """
    environment = _environment()
    inline = {
        name: environment.get_template(f"{file}.j2").render()
        for name, file in (("style", "style.css"), ("script", "player.js"))
    }
    digests = {
        f"{name}_sha256": base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
        for name, text in inline.items()
    }
    marked = {name: Markup(text) for name, text in inline.items()}
    return environment.get_template("gallery.html.j2").render(
        tiles=tiles,
        lead=lead,
        legend=legend,
        most_s=MOST_S,
        provenance=provenance,
        **marked,
        **digests,
    )


def pairs(values: dict[str, Any]) -> list[tuple[str, str]]:
    """Known entries of a dictionary as names in words and text."""
    return [(name.replace("_", " "), str(value)) for name, value in values.items() if value]


def stage_times(timings: dict[str, float]) -> list[tuple[str, str, float]]:
    """Stages in order with duration in words and share of the longest in percent."""
    longest = max(timings.values(), default=0.0)
    return [
        (name, duration(seconds), 100.0 * seconds / longest if longest > 0 else 0.0)
        for name, seconds in timings.items()
    ]


def duration(seconds: float) -> str:
    """A time in words.

    Example:
        >>> duration(75.2)
        '1 min 15 s'
    """
    if seconds < 60:
        return f"{seconds:.1f} s"
    return f"{int(seconds // 60)} min {int(seconds % 60)} s"


def image_file(path: Path) -> bytes | None:
    """Bytes of a picture, None where there is none."""
    refuse_link(path)
    return path.read_bytes() if path.is_file() else None
