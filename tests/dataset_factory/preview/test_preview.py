# SPDX-License-Identifier: Apache-2.0
"""The preview shows the truth: aligned in time, joints on people, nothing from elsewhere."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from dataset_factory.check.validate import validate
from dataset_factory.preview import page
from dataset_factory.preview.panels import Watch, doppler_panel, watch
from dataset_factory.preview.player import plan, player
from dataset_factory.preview.strips import MARGINS, Timeline, channel_strip
from rfgs_core.dataset import Sequence, open_dataset
from rfgs_core.dataset.writer import write_arrays
from rfgs_core.radio.constants import SPEED_OF_LIGHT


@pytest.fixture
def sequence(tiny_dataset: Path) -> Sequence:
    return open_dataset(tiny_dataset).sequence()


def data_of_page(text: str) -> list[Any]:
    """The three values that the page's script works with."""
    line = re.search(r"const data = (.*), plan = (.*), axis = (.*);\n", text)
    assert line
    return [json.loads(part) for part in line.groups()]


def test_the_page_holds_everything_and_needs_nothing(
    factory_here: Callable[..., subprocess.CompletedProcess[str]], box_copy: Path
) -> None:
    answer = factory_here("preview", str(box_copy))
    assert answer.returncode == 0, answer.stderr
    file = Path(answer.stdout.strip())
    text = file.read_text()
    # Any four letters may stand in a picture by chance.
    assert "http" not in re.sub(r"base64,[\w+/=]*", "", text) and "src=" in text
    drawn = {file.name for file in file.parent.glob("*.png")}
    assert drawn == {
        "pictures.png",
        "layers.png",
        "wifi_strip.png",
        "wifi_profiles.png",
        "wifi_delay_angle.png",
    }
    assert text.count('src="data:image/png;base64,') == len(drawn)
    shown, _, axis = data_of_page(text)
    assert shown["frames"] == [1, 2] and len(shown["cameras"][0]["pictures"]) == 2
    assert axis["start_s"] < shown["times"][0] < shown["times"][1] < axis["end_s"]
    assert validate(box_copy) == []


def test_names_from_a_scene_stay_text(tiny_dataset: Path) -> None:
    dataset = open_dataset(tiny_dataset)
    sequence = dataset.sequence()
    sequence.info.devices["wifi"][0]["name"] = "</script><b>x</b>"
    sequence.info.guesses.append({"what": "<u>", "object": "", "value": "", "why": ""})
    text = page(dataset, sequence, Timeline.of(sequence), [])
    assert "<b>x" not in text and "<u>" not in text
    assert data_of_page(text)[1]["devices"][0]["name"] == "</script><b>x</b>"


def test_skeletons_lie_on_the_masks_and_in_the_plan(tiny_dataset: Path, sequence: Sequence) -> None:
    shown, above = player(sequence, open_dataset(tiny_dataset).has), plan(sequence)
    for camera in shown["cameras"]:
        for frame, people in zip(shown["frames"], camera["skeletons"], strict=True):
            column, row = people[0][8]
            assert sequence.mask(camera["name"], frame)[int(row), int(column)] == 1
    assert np.allclose(shown["joints"][1][0][0], sequence.joints(2)[0, 0, :2], atol=1e-3)
    assert above["low"] == [0.0, 0.0] and above["size"] == [3.0, 3.0]
    # Corner devices look at the middle.
    for device in above["devices"]:
        to_middle = np.array([1.5, 1.5]) - device["at"]
        assert np.dot(to_middle, device["ahead"]) > 0.99 * np.linalg.norm(to_middle)


def test_shown_pictures_are_nearest_to_their_place_on_the_axis(sequence: Sequence) -> None:
    timeline = Timeline.of(sequence)
    assert (timeline.start_s, timeline.end_s) == pytest.approx((-0.05, 0.15))
    assert timeline.shown == [1, 2]


def test_strips_end_where_the_packets_of_the_last_frame_do(
    sequence: Sequence, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ten packets, 1 ms apart, at the beginning of each frame: nothing is known after them."""
    packets_s = 1e-3 * np.arange(10)
    monkeypatch.setattr(
        Sequence, "sample_times_s", lambda self, _radio, frame: self.time_s(frame) + packets_s
    )
    timeline = Timeline.of(sequence)
    assert (timeline.start_s, timeline.end_s) == pytest.approx((-0.0005, 0.1095))
    assert timeline.half_s == pytest.approx(0.05)


def test_every_panel_has_the_same_axis_in_the_same_place(sequence: Sequence) -> None:
    timeline, seen = Timeline.of(sequence), watch(sequence, "wifi")
    figure = channel_strip(sequence, "wifi", timeline, seen)
    panels = [axis for axis in figure.axes if np.allclose(axis.get_xlim(), (-0.05, 0.15))]
    assert len(panels) == 3
    assert [axis.get_xlabel() for axis in panels] == ["", "", "time [s]"]
    for axis in panels:
        box = axis.get_position()
        assert (box.x0, box.x1) == pytest.approx(MARGINS)


def test_where_nobody_moves_far_the_pair_of_most_change_is_watched(sequence: Sequence) -> None:
    seen = watch(sequence, "wifi")
    layout, static = sequence.layout("wifi"), sequence.csi_static("wifi")
    change = sequence.csi("wifi", 1) - static, sequence.csi("wifi", 2) - static

    def share(pair: tuple[int, int]) -> float:
        index = np.ix_(layout.tx_device == pair[0], layout.rx_device == pair[1])
        moved = sum(np.linalg.norm(value[index]) ** 2 for value in change)
        return float(moved / np.linalg.norm(static[index]) ** 2)

    assert share(seen.pair) == max(share(pair) for pair in layout.device_pairs)
    assert seen.csi.shape == (2, 1, 8, 16) and seen.time_s.tolist() == [0.0, 0.1]


def test_where_somebody_moves_the_pair_of_most_travel_is_watched(
    tiny_dataset: Path, tmp_path: Path
) -> None:
    copy = Path(shutil.copytree(tiny_dataset, tmp_path / "copy"))
    sequence = open_dataset(copy).sequence()
    file = sequence.files.geometry(2)
    stored = dict(np.load(file))
    stored["joints"] = sequence.joints(1) + np.float32([1.0, 0.0, 0.0])
    write_arrays(file, **stored)
    places = [device.position_m for device in sequence.devices("wifi")]

    def travel(pair: tuple[int, int]) -> float:
        lengths = [
            sum(np.linalg.norm(sequence.joints(frame)[0, 0] - places[end]) for end in pair)
            for frame in sequence.frames
        ]
        return float(np.ptp(lengths))

    seen = watch(sequence, "wifi").pair
    assert seen[0] != seen[1]
    others = [pair for pair in sequence.layout("wifi").device_pairs if pair[0] != pair[1]]
    assert travel(seen) > 0.9 * max(travel(pair) for pair in others) > 0.5


def test_doppler_of_an_approaching_reflector_shows_its_speed(sequence: Sequence) -> None:
    speed_m_s, times_s = 0.8, np.arange(200) * 1e-3
    path_m = 6.0 - 2 * speed_m_s * times_s
    freq_hz = sequence.radio_spec("wifi").freq_hz
    turn = np.exp(-2j * np.pi * freq_hz * path_m[:, None] / SPEED_OF_LIGHT)
    seen = Watch((0, 1), times_s, turn[:, None, None].astype(np.complex64), np.zeros((1, 1, 1, 16)))
    axis = Figure().add_subplot()
    mesh = doppler_panel(axis, sequence, "wifi", seen)
    level = np.asarray(mesh.get_array())
    speeds = mesh.get_coordinates()[:, 0, 1]
    middle = 0.5 * (speeds[1:] + speeds[:-1])
    strongest = middle[level.argmax(axis=0)]
    assert np.abs(strongest - speed_m_s).max() < 0.05


def test_the_plan_outlines_what_moves_and_is_no_person(box_dataset: Path) -> None:
    sequence = open_dataset(box_dataset).sequence()
    assert player(sequence, [])["outlines"] == [[], []]
    sequence.info.instances[0]["class"] = "vehicle"
    for frame, (outline,) in zip((1, 2), player(sequence, [])["outlines"], strict=True):
        vertices, _, _ = sequence.moving_mesh(frame)
        corners = np.array(outline)
        assert len(corners) == 4
        np.testing.assert_allclose(corners.min(axis=0), vertices[:, :2].min(axis=0), atol=2e-3)
        np.testing.assert_allclose(corners.max(axis=0), vertices[:, :2].max(axis=0), atol=2e-3)
