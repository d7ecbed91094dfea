# SPDX-License-Identifier: Apache-2.0
"""The example for MATLAB, run by GNU Octave, says what NumPy says of the same channels."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from dataset_factory.convert import convert
from rfgs_core import open_dataset

EXAMPLE = Path(__file__).resolve().parents[2] / "docs" / "read_in_matlab.m"


@pytest.mark.skipif(shutil.which("octave-cli") is None, reason="GNU Octave is not installed")
@pytest.mark.parametrize("radio", ["wifi"])
def test_delays_and_places_are_those_of_the_dataset(
    tiny_dataset: Path, tmp_path: Path, radio: str
) -> None:
    convert(tiny_dataset, "mat", tmp_path / "mat")
    code = f"file = '{tmp_path}/mat/{radio}.mat'; run('{EXAMPLE}')"
    done = subprocess.run(
        ["octave-cli", "--no-init-file", "--eval", code], capture_output=True, text=True, check=True
    )
    told = np.array(re.findall(r"time ([\d.]+) s: .* after ([\d.]+) m", done.stdout), float)
    sequence = open_dataset(tiny_dataset).sequence()
    data = sequence.radio(radio)
    moving = data["csi"].values.astype(complex) - data["csi_static"].values
    count = moving.shape[-1]
    delay_m = 299_792_458.0 * np.arange(8 * count) / (8 * count)
    delay_m /= np.diff(data["freq_hz"].values).mean()
    # The sum over subcarriers itself, not a library's transform.
    turns = np.arange(8 * count)[:, None] * np.arange(count) / (8 * count)
    window = 0.5 - 0.5 * np.cos(2 * np.pi * (np.arange(count) + 0.5) / count)
    heard = np.einsum("trks,ds->dtrk", moving * window, np.exp(2j * np.pi * turns), optimize=True)
    power = (np.abs(heard) ** 2).mean(axis=(2, 3)).T
    np.testing.assert_allclose(told[:, 1], delay_m[power.argmax(axis=1)], atol=0.006)
    np.testing.assert_allclose(told[:, 0], data["time_s"].values, atol=6e-4)
    pelvis = re.search(r"frame: ([\d.-]+) ([\d.-]+) ([\d.-]+) m", done.stdout)
    assert pelvis is not None
    place = np.array(pelvis.groups(), float)
    np.testing.assert_allclose(place, sequence.joints(sequence.frames[0])[0, 0], atol=6e-4)
