# SPDX-License-Identifier: Apache-2.0
"""`rfgs csi`: the link that is drawn is the dataset's and the run's."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from rfgs_core.cli import main
from rfgs_core.figures.links import link_channels
from rfgs_core.run import Run


def test_channels_are_those_of_dataset_and_run(small_run: Run) -> None:
    sequence = small_run.sequence
    layout = sequence.layout("wifi")
    for pair in layout.device_pairs:
        link = link_channels(small_run, *pair)
        tx = np.flatnonzero(layout.tx_device == pair[0])
        rx = np.flatnonzero(layout.rx_device == pair[1])
        assert link.measured.shape == (2, len(tx) * len(rx), 16)
        delta = sequence.csi("wifi", 2) - sequence.csi_static("wifi")
        np.testing.assert_array_equal(link.measured[1], delta[np.ix_(tx, rx)].reshape(-1, 16))
        same = replace(link, predicted=link.measured * np.complex64(0.9))
        assert same.error_db == pytest.approx(-20, abs=1e-3)
        assert replace(link, predicted=0 * link.measured).error_db == pytest.approx(0)


def test_it_writes_one_picture(small_run: Run, tmp_path: Path, capsys) -> None:
    out = tmp_path / "new" / "link.png"
    arguments = ["csi", str(small_run.path), "--out", str(out)]
    assert main(arguments) == 0
    assert str(out) in capsys.readouterr().out
    with Image.open(out) as picture:
        assert np.asarray(picture.convert("L")).std() > 10
        pixels = np.asarray(picture.convert("RGBA"))
    assert (pixels[..., 3] == 255).all(), "opaque: Blender shows a checkerboard where it is not"
    assert (pixels[0, 0] == 255).all()
    first = out.read_bytes()
    assert main(arguments) == 0 and out.read_bytes() == first
    assert [path.name for path in out.parent.iterdir()] == ["link.png"]


def test_an_error_louder_than_the_change_is_not_left_of_it(small_run: Run) -> None:
    """The prediction is the change times a number: a tenth, and twice of it, are wrong."""
    link = link_channels(small_run, 0, 0)
    good, bad = (replace(link, predicted=link.measured * np.complex64(x)) for x in (0.9, 3.0))
    assert good.explained.startswith("the prediction leaves -20.0 dB of the change's energy")
    nothing = replace(link, predicted=link.measured * np.complex64(1e-3))
    assert nothing.explained.startswith("the prediction leaves 0.0 dB of the change's energy")
    assert bad.explained.startswith("the prediction's error has 6.0 dB more energy than the change")


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--tx-device", "9"], "--tx-device 9: nothing of it is measured; expected one of 0, 1"),
        (["--rx-device", "-1"], "no link 0→-1"),
        (["--out", "link.jpg"], "ends in .png"),
    ],
)
def test_mistakes_get_one_line(small_run: Run, capsys, more: list[str], words: str) -> None:
    assert main(["csi", str(small_run.path), *more]) != 0
    text = capsys.readouterr().err
    assert words in text and text.count("\n") == 1
