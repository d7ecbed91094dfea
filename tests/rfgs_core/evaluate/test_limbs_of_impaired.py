# SPDX-License-Identifier: Apache-2.0
"""The table of limbs reads what imperfect radios report, as a training does."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dataset_factory.make.impair import impair_dataset
from rfgs_core.cli import main
from rfgs_core.dataset import open_dataset
from rfgs_core.evaluate.limbs import Person
from rfgs_core.measure.observations import observe
from rfgs_core.radio.impairments import Impairments
from rfgs_core.settings import TrainConfig


@pytest.mark.slow
def test_noise_reaches_the_table_where_it_is_asked_for(own_dataset: Path) -> None:
    impair_dataset(own_dataset, Impairments(thermal_noise=True, power_dbm=-10.0), seed=1)
    sequence = open_dataset(own_dataset).sequence()
    for channel in ("clean", "impaired"):
        config = TrainConfig(channel=channel)
        person = Person.of(sequence, "wifi", sequence.frames, config, True, lambda: None)
        for frame, seen in zip(sequence.frames, person.seen, strict=True):
            expected = observe(sequence, "wifi", frame, channel, everything=True)
            np.testing.assert_array_equal(seen.delta, expected.delta)
            clean = observe(sequence, "wifi", frame, everything=True)
            noise = np.abs(seen.delta - clean.delta)[seen.links]
            assert (noise.max() > 0.0) == (channel == "impaired")


def test_a_dataset_without_noise_says_so(
    tiny_dataset: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = ["bench", "limbs", "--dataset", str(tiny_dataset), "--channel", "impaired"]
    assert main(asked) == 2
    said = capsys.readouterr().err.splitlines()[-1]
    assert "holds no impaired channels; add them with: rfgs-factory impair" in said
