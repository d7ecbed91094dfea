# SPDX-License-Identifier: Apache-2.0
"""Shows a dataset: pictures, channels and one page that holds them all."""

from __future__ import annotations

import base64
import io
from pathlib import Path
from typing import Any

import jinja2
from matplotlib.figure import Figure
from tqdm import tqdm

from dataset_factory.preview_channels import delay_angle_figure, profile_figure
from dataset_factory.preview_pictures import contact_sheet, layer_sheet
from rfgs_core.dataset import Sequence, open_dataset
from rfgs_core.files import write_bytes, write_text

_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{{ title }}</title>
<style>
:root { color-scheme: light dark; --ink: #1d2430; --soft: #5b6575; --line: #dfe3ea;
  --page: #f6f7f9; --card: #ffffff; --accent: #0b6bcb; }
@media (prefers-color-scheme: dark) { :root { --ink: #e6e9ef; --soft: #9aa5b5; --line: #2d3542;
  --page: #12161d; --card: #1a2029; --accent: #6db3ff; } figure img { background: #fff; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--page); color: var(--ink);
  font: 16px/1.55 system-ui, "Segoe UI", Helvetica, Arial, sans-serif; }
main { max-width: 1120px; margin: 0 auto; padding: 2.5rem 1.25rem 4rem; }
h1 { font-size: 1.9rem; margin: 0 0 .25rem; letter-spacing: -.01em; }
h2 { font-size: 1.25rem; margin: 2.5rem 0 .75rem; }
p.lead { color: var(--soft); margin: 0 0 1.5rem; max-width: 65ch; }
dl { display: grid; grid-template-columns: repeat(auto-fit, minmax(165px, 1fr)); gap: .75rem;
  margin: 0; }
dl div { background: var(--card); border: 1px solid var(--line); border-radius: 10px;
  padding: .7rem .9rem; }
dt { color: var(--soft); font-size: .8rem; } dd { margin: 0; font-weight: 600; }
figure { margin: 0 0 1.5rem; background: var(--card); border: 1px solid var(--line);
  border-radius: 12px; padding: 1rem; }
figure img { width: 100%; height: auto; display: block; border-radius: 6px; }
figcaption { color: var(--soft); font-size: .9rem; margin-top: .7rem; max-width: 90ch; }
table { border-collapse: collapse; width: 100%; font-size: .92rem; background: var(--card); }
th, td { text-align: left; padding: .4rem .7rem; border-bottom: 1px solid var(--line); }
code { font-size: .85em; color: var(--soft); word-break: break-all; }
</style></head><body><main>
<h1>{{ title }}</h1>
<p class="lead">{{ lead }}</p>
<dl>{% for name, value in facts %}<div><dt>{{ name }}</dt><dd>{{ value }}</dd></div>
{% endfor %}</dl>
{% for section in sections %}<h2>{{ section.title }}</h2>
{% for figure in section.figures %}<figure>
<img alt="{{ figure.alt }}" src="data:image/png;base64,{{ figure.data }}">
<figcaption>{{ figure.caption }}</figcaption></figure>{% endfor %}{% endfor %}
{% if guesses %}<h2>What was guessed</h2>
<table><tr><th>What</th><th>Object</th><th>Value</th><th>Why</th></tr>
{% for row in guesses %}<tr><td>{{ row.what }}</td><td>{{ row.object }}</td>
<td>{{ row.value }}</td><td>{{ row.why }}</td></tr>{% endfor %}</table>{% endif %}
<p><code>{{ fingerprint }}</code></p>
</main></body></html>
"""


def preview(path: Path, out: Path | None, sequence_name: str | None) -> Path:
    """Draws everything and writes `index.html`.

    Args:
        path: Folder of the dataset.
        out: Where to; None takes `log/preview` of the dataset.
        sequence_name: Which sequence; None takes the only one.

    Returns:
        Path of the page.

    Raises:
        RfgsError: The dataset or the sequence does not exist, or a file is damaged.
    """
    dataset = open_dataset(path)
    sequence = dataset.sequence(sequence_name)
    folder = out or path / "log" / "preview"
    sections = []
    jobs = [("Pictures", None)] if "images" in dataset.has and sequence.cameras else []
    jobs += [(f"Channels of {radio}", radio) for radio in sequence.radios]
    for title, radio in tqdm(jobs, desc="preview", unit="section"):
        figures = _pictures(sequence, folder) if radio is None else _radio(sequence, radio, folder)
        sections.append({"title": title, "figures": figures})
    environment = jinja2.Environment(autoescape=True)
    page = environment.from_string(_PAGE).render(
        title=sequence.name,
        lead=(
            "Channel state information with matching pictures. Every picture and every channel "
            "of a frame shows the same instant of the same scene."
        ),
        facts=_facts(sequence),
        sections=sections,
        guesses=sequence.info.guesses,
        fingerprint=f"dataset {dataset.fingerprint}",
    )
    write_text(folder / "index.html", page)
    return folder / "index.html"


def _facts(sequence: Sequence) -> list[tuple[str, str]]:
    size = sequence.bounds_m[1] - sequence.bounds_m[0]
    facts = [
        ("Frames", f"{len(sequence.frames)} ({sequence.frames[0]} to {sequence.frames[-1]})"),
        ("Frame rate of the scene", f"{sequence.fps:g} per second"),
        ("Size", " × ".join(f"{value:.1f}" for value in size) + " m"),
        ("Cameras", str(len(sequence.cameras))),
        ("Trace depth", str(sequence.trace_depth)),
    ]
    for name in sequence.radios:
        radio, layout = sequence.radio_spec(name), sequence.layout(name)
        facts.append(
            (
                f"{name}: {radio.freq_min_hz / 1e9:g} to {radio.freq_max_hz / 1e9:g} GHz",
                f"{layout.measured.shape[0]} TX × {layout.measured.shape[1]} RX × "
                f"{radio.num_subcarriers} tones",
            )
        )
    return facts


def _pictures(sequence: Sequence, folder: Path) -> list[dict[str, Any]]:
    return [
        _figure(
            contact_sheet(sequence),
            folder / "pictures.png",
            "Contact sheet",
            "Cameras from top to bottom, frames from left to right.",
        ),
        _figure(
            layer_sheet(sequence),
            folder / "layers.png",
            "Colour, depth, normals and instances",
            "The middle frame: colour, planar depth, world normals (X, Y, Z as red, green, blue) "
            "and instance ids (dark: everything static).",
        ),
    ]


def _radio(sequence: Sequence, radio: str, folder: Path) -> list[dict[str, Any]]:
    frame = sequence.frames[len(sequence.frames) // 2]
    return [
        _figure(
            profile_figure(sequence, radio, frame),
            folder / f"{radio}_profiles.png",
            f"Amplitude and delay profiles of {radio}",
            f"Frame {frame}. Top: amplitude of the channel over receiving elements and frequency. "
            "Below: delay profile of each device pair with people, without (static), and of their "
            "difference; the dotted line is the direct path from the geometry.",
        ),
        _figure(
            delay_angle_figure(sequence, radio, frame),
            folder / f"{radio}_delay_angle.png",
            f"Delay and angle at each device of {radio}",
            f"Frame {frame}. Bartlett beam over the columns of each receiving array, power "
            "averaged over its rows and transmitters; 0° is the boresight. Each image has its own "
            "scale of 40 dB; the cross marks the person's pelvis.",
        ),
    ]


def _figure(figure: Figure, file: Path, alt: str, caption: str) -> dict[str, Any]:
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=110, metadata={"Software": None})
    write_bytes(file, stream.getvalue())
    data = base64.b64encode(stream.getvalue()).decode("ascii")
    return {"alt": alt, "caption": caption, "data": data}
