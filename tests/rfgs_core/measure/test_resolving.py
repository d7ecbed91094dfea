# SPDX-License-Identifier: Apache-2.0
"""What a radio can tell apart: closed forms on the tiny dataset, and where it is said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rfgs_core.cli import main
from rfgs_core.dataset import open_dataset
from rfgs_core.dataset.splits import HeldOut
from rfgs_core.measure.resolving import resolving
from rfgs_core.radio.constants import SPEED_OF_LIGHT


def test_band_and_antennas_decide(tiny_dataset: Path) -> None:
    sequence = open_dataset(tiny_dataset).sequence()
    can = resolving(sequence, "wifi", 100)
    radio = sequence.radio_spec("wifi")
    # 16 subcarriers over 160 MHz: 1.87 m of path, and 16 times that until delays repeat.
    assert can.path_m == pytest.approx(SPEED_OF_LIGHT / 160e6)
    assert can.repeats_m == pytest.approx(16 * can.path_m)
    elements = sequence.layout("wifi")
    middle = np.asarray(sequence.bounds_m).mean(axis=0)
    for row, (device, across) in enumerate(zip(sequence.devices("wifi"), can.across, strict=True)):
        assert across.device == device.name
        sight = middle[:2] - np.array(device.position_m)[:2]
        sight /= np.linalg.norm(sight)
        rx = elements.rx_xyz[elements.rx_device == row]
        # Four columns half a wavelength apart, foreshortened by where the device looks.
        span = np.ptp(rx[:, :2] @ np.array([-sight[1], sight[0]]))
        wanted = radio.wavelength_m * across.distance_m / span
        assert across.sideways_m == pytest.approx(wanted, rel=1e-6)
        assert np.isfinite(across.upright_m)


def test_numbers_and_unknowns_are_counted(tiny_dataset: Path) -> None:
    sequence = open_dataset(tiny_dataset).sequence()
    split = HeldOut.of(sequence.held_out("wifi"), sequence.layout("wifi"), 16)
    visible = int(split.links.sum()) * int(split.subcarriers.sum())
    whole, powers = (resolving(sequence, "wifi", 10, kind) for kind in ("complex", "power"))
    assert (whole.numbers, powers.numbers, whole.unknowns) == (2 * visible, visible, 50)
    assert "more numbers than unknowns" in whole.lines()[-1]
    assert "fewer numbers" in resolving(sequence, "wifi", 10**6).lines()[-1]


def test_inspect_says_it_of_a_dataset(
    tiny_dataset: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["inspect", str(tiny_dataset)]) == 0
    out = capsys.readouterr().out
    assert "wifi: paths are resolved by 1.87 m (out and back: ranges by 0.937 m)" in out
    assert out.count(": across, at ") == 4


@pytest.mark.parametrize("option", ["--out pictures", "--sanitize", "--format intel5300"])
def test_what_only_captures_have_is_refused_of_a_dataset(
    tiny_dataset: Path, option: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["inspect", str(tiny_dataset), *option.split()]) == 2
    out, err = capsys.readouterr()
    assert out == "" and len(err.splitlines()) == 1
    assert f"is a dataset: {option.split()[0]} goes with captures only; leave it out" in err
