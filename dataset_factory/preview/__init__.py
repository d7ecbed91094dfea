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

from dataset_factory.preview.aperture import aperture_strip, image_figure, range_figure
from dataset_factory.preview.arrays import has_beam
from dataset_factory.preview.channels import delay_image_figure, profile_figure
from dataset_factory.preview.panels import doppler_shown, watch
from dataset_factory.preview.pictures import layer_sheet
from dataset_factory.preview.player import plan, player
from dataset_factory.preview.strips import MARGINS, Timeline, channel_strip, picture_strip
from rfgs_core.dataset import Dataset, Sequence, open_dataset
from rfgs_core.files import write_bytes, write_text


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
    dataset.need("csi", "csi_static", "geometry")
    sequence = dataset.sequence(sequence_name)
    folder, timeline = out or path / "log" / "preview", Timeline.of(sequence)
    sections = []
    jobs = [("Pictures over time", None)] if "images" in dataset.has and sequence.cameras else []
    jobs += [(f"Channels of {radio} over time", radio) for radio in sequence.radios]
    for title, radio in tqdm(jobs, desc="preview", unit="section"):
        if radio is None:
            figures = _pictures(sequence, timeline, folder)
        elif sequence.radio_spec(radio).antennas_move:
            figures = _aperture(sequence, radio, timeline, folder)
        else:
            figures = _radio(sequence, radio, timeline, folder)
        sections.append({"title": title, "figures": figures})
    write_text(folder / "index.html", page(dataset, sequence, timeline, sections))
    return folder / "index.html"


def page(
    dataset: Dataset, sequence: Sequence, timeline: Timeline, sections: list[dict[str, Any]]
) -> str:
    """The HTML of a sequence's page; whatever a scene's names hold stays text."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader(__name__, ""), autoescape=True, undefined=jinja2.StrictUndefined
    )
    return environment.get_template("page.html.j2").render(
        title=sequence.name,
        lead=(
            "Channel state information with matching pictures: everything below shows the same "
            "moments of the same scene. Move over a strip, or press Play."
        ),
        facts=_facts(sequence),
        sections=sections,
        guesses=sequence.info.guesses,
        fingerprint=f"dataset {dataset.fingerprint}",
        player=player(sequence, dataset.has),
        plan=plan(sequence),
        axis={
            "start_s": timeline.start_s,
            "end_s": timeline.end_s,
            "left": MARGINS[0],
            "right": MARGINS[1],
        },
    )


def _facts(sequence: Sequence) -> list[tuple[str, str]]:
    size = sequence.bounds_m[1] - sequence.bounds_m[0]
    facts = [
        ("Frames", f"{len(sequence.frames)} ({sequence.frames[0]} to {sequence.frames[-1]})"),
        ("Frame rate of the scene", f"{sequence.fps:g} per second"),
        ("Size", " × ".join(f"{value:.1f}" for value in size) + " m"),
        ("Cameras", str(len(sequence.cameras))),
    ]
    for name in sequence.radios:
        radio, layout = sequence.radio_spec(name), sequence.layout(name)
        facts.append(
            (
                f"{name}: {radio.freq_min_hz / 1e9:g} to {radio.freq_max_hz / 1e9:g} GHz",
                f"{layout.measured.shape[0]} TX × {layout.measured.shape[1]} RX × "
                f"{radio.num_subcarriers} subcarriers, depth {sequence.trace_depth(name)}",
            )
        )
    return facts


def _pictures(sequence: Sequence, timeline: Timeline, folder: Path) -> list[dict[str, Any]]:
    return [
        _figure(
            picture_strip(sequence, timeline),
            folder / "pictures.png",
            "Pictures over time",
            "Pictures at evenly spread moments; the band says what each person does.",
            strip=True,
        ),
        _figure(
            layer_sheet(sequence),
            folder / "layers.png",
            "Colour, depth, normals and instances",
            "The middle frame: colour, planar depth, world normals (X, Y, Z as red, green, blue) "
            "and instance ids (dark: everything static).",
            folded=True,
        ),
    ]


def _radio(
    sequence: Sequence, radio: str, timeline: Timeline, folder: Path
) -> list[dict[str, Any]]:
    frame = sequence.frames[len(sequence.frames) // 2]
    seen = watch(sequence, radio)
    beam = has_beam(sequence, radio)
    rows = (
        "delay and angle of the change under each picture (20 dB), the cross marks the pelvis."
        if beam
        else "delay of the change at each antenna under each picture (20 dB), dashed: the pelvis."
    )
    doppler = (
        "Doppler: half the rate at which the path shortens."
        if doppler_shown(sequence, radio)
        else "No Doppler is shown: with this few samples per second a walking person's speed "
        "would alias; generate with --packets-per-frame to have it."
    )
    return [
        _figure(
            channel_strip(sequence, radio, timeline, seen),
            folder / f"{radio}_strip.png",
            f"Channels of {radio} over time",
            f"Device {seen.pair[0]} to {seen.pair[1]}, the pair that shows movement best. The "
            "change is the channel less that of the empty scene; dashed: where the pelvis of "
            f"each person is. {doppler} Bottom: {rows}",
            strip=True,
        ),
        _figure(
            profile_figure(sequence, radio, frame),
            folder / f"{radio}_profiles.png",
            f"Amplitude and delay profiles of {radio}, one frame",
            f"Frame {frame}. Top: amplitude of the channel over receiving elements and frequency. "
            "Below: delay profile of each device pair with people, without (static), and of their "
            "difference; the dotted line is the direct path from the geometry.",
            folded=True,
        ),
        _figure(
            delay_image_figure(sequence, radio, frame),
            folder / f"{radio}_delay_{'angle' if beam else 'antenna'}.png",
            f"Delay {'and angle ' if beam else ''}at each device of {radio}, one frame",
            f"Frame {frame}. "
            + (
                "Bartlett beam over the columns of each receiving array, power averaged over its "
                "rows and transmitters; 0° is the boresight; the cross marks the person's pelvis."
                if beam
                else "Antenna by antenna, as they are too far apart for a beam; a scatterer draws "
                "a curve, dashed: that of the person's pelvis."
            )
            + " Each image has its own scale of 40 dB.",
            folded=True,
        ),
    ]


def _aperture(
    sequence: Sequence, radio: str, timeline: Timeline, folder: Path
) -> list[dict[str, Any]]:
    frame = sequence.frames[len(sequence.frames) // 2]
    return [
        _figure(
            aperture_strip(sequence, radio, timeline),
            folder / f"{radio}_strip.png",
            f"Images of {radio} over time",
            "What people change, focused by back-projection from all places of the antenna (dots), "
            "the strongest of all heights; the cross marks the pelvis. Each image has its own "
            "scale of 20 dB.",
            strip=True,
        ),
        _figure(
            range_figure(sequence, radio, frame),
            folder / f"{radio}_ranges.png",
            f"Range profiles of {radio} along its aperture, one frame",
            f"Frame {frame}. Half the path length over the places of the antenna, with people, "
            "without (static), and their difference; dashed: the pelvis' own range. A point "
            "scatterer draws one such curve.",
            folded=True,
        ),
        _figure(
            image_figure(sequence, radio, frame),
            folder / f"{radio}_images.png",
            f"Focused images of {radio}, one frame",
            f"Frame {frame}. What people change through a matched filter over all places and "
            "subcarriers, the strongest along the axis that is not drawn; the cross marks the "
            "pelvis. The antenna looks down, so heads and shoulders answer most.",
            folded=True,
        ),
    ]


def _figure(
    figure: Figure,
    file: Path,
    alt: str,
    caption: str,
    *,
    strip: bool = False,
    folded: bool = False,
) -> dict[str, Any]:
    """A figure for the page: on the time axis of all strips, or folded away."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=110, metadata={"Software": None})
    write_bytes(file, stream.getvalue())
    data = base64.b64encode(stream.getvalue()).decode("ascii")
    return {"alt": alt, "caption": caption, "data": data, "strip": strip, "folded": folded}
