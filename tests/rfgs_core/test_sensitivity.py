# SPDX-License-Identifier: Apache-2.0
"""One thing of a radio is changed at a time, and what is changed is what the dataset has."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dataset_factory.make.impair import impair_dataset
from rfgs_core.cli import main
from rfgs_core.dataset import open_dataset
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.files import read_json
from rfgs_core.links import filled
from rfgs_core.radio import preset
from rfgs_core.radio.files import read_radio
from rfgs_core.radio.impairments import Impairments
from rfgs_core.settings import TrainConfig
from rfgs_core.study import sensitivity
from rfgs_core.study.sensitivity import Setup, SetupPart, every_setup, stored, sweeps
from rfgs_core.study.sensitivity_rows import sweep_rows, sweep_table


@pytest.mark.parametrize("radio", ["wifi", "mmwave", "uwb"])
def test_each_sweep_holds_the_preset_and_changes_one_thing(radio: str, tmp_path: Path) -> None:
    base = preset(radio)
    found = sweeps(radio)
    _, plain = found["devices"][-1]
    assert not plain.changes and not plain.without
    for name, points in found.items():
        setups = [setup for _, setup in points]
        assert plain in setups and len(set(setups)) == len(points)
        assert len({label for label, _ in points}) == len(points)
        for setup in setups:
            words = setup.generate(tmp_path)
            assert [words[at + 1] for at, word in enumerate(words) if word == "--drop"] == list(
                setup.without
            )
            if not setup.changes:
                assert words[words.index("--radio") + 1] == radio
                continue
            changed = read_radio(Path(words[words.index("--radio") + 1]))
            assert changed.name == setup.heard_by
            same = replace(changed, name=radio, **{
                field: getattr(base, field) for field, _ in setup.changes
            })  # fmt: skip
            assert same == base
            if name == "bandwidth":
                assert changed.centre_hz == pytest.approx(base.centre_hz)
                count = changed.bandwidth_hz / base.bandwidth_hz * base.num_subcarriers
                assert changed.num_subcarriers == max(round(count), sensitivity.FEWEST_SUBCARRIERS)


def test_what_sweeps_share_is_made_once() -> None:
    every = sweeps("wifi")
    setups = every_setup(every)
    assert len(setups) == len(set(setups)) < sum(len(points) for points in every.values())
    assert len({setup.name for setup in setups}) == len(setups)
    assert len({setup.dataset for setup in setups}) == len(setups)
    other = replace(setups[0], seed=1)
    assert other.dataset == setups[0].dataset and other.name != setups[0].name


def test_noise_is_trained_on_and_told(tmp_path: Path) -> None:
    (_, clean), (_, loud), *_ = sweeps("wifi")["noise"]
    assert clean.config.channel == "clean" and loud.config.channel == "impaired"
    words = loud.generate(tmp_path)
    assert read_json(Path(words[words.index("--impairments") + 1])) == {
        "thermal_noise": True, "power_dbm": preset("wifi").power_dbm,
    }  # fmt: skip
    assert "--impairments" not in clean.generate(tmp_path)


def test_metal_walls_are_asked_for_where_there_are_walls(tmp_path: Path) -> None:
    (_, built), (_, walls), (_, box) = sweeps("wifi")["walls"]
    assert "--material" not in built.generate(tmp_path)
    for setup, names in ((walls, ["wall_*"]), (box, ["wall_*", "ceiling_white"])):
        words = setup.generate(tmp_path)
        asked = [words[at + 1] for at, word in enumerate(words) if word == "--material"]
        assert asked == [f"{name}=metal" for name in names]
    assert "walls" not in sweeps("wifi", "street")


def test_people_are_those_of_other_scenes() -> None:
    found = dict(sweeps("mmwave")["people"])
    assert [setup.scene for setup in found.values()] == [
        "living_room_walk", "two_crossing", "crowd_of_four",
    ]  # fmt: skip
    assert len(sweeps("wifi", "crowd_of_four")["people"]) == 2


def test_radios_are_not_written_where_a_link_leads(tmp_path: Path) -> None:
    elsewhere, out = tmp_path / "elsewhere", tmp_path / "out"
    elsewhere.mkdir()
    out.mkdir()
    (out / "radios").symlink_to(elsewhere)
    with filled(out), pytest.raises(RfgsError, match="a symbolic link"):
        sweeps("wifi")["bandwidth"][0][1].generate(out)
    assert not list(elsewhere.iterdir())


def test_signal_to_noise_is_that_of_the_change(own_dataset: Path) -> None:
    """Beside the sum over all entries, written out; lost packets are no noise."""
    settings = Impairments(thermal_noise=True, power_dbm=-40.0, loss_rate=0.4)
    impair_dataset(own_dataset, settings, seed=1)
    sequence = open_dataset(own_dataset).sequence()
    static = sequence.csi_static("wifi")
    clean = np.stack([sequence.csi("wifi", frame) for frame in sequence.frames])
    heard = [sequence.csi("wifi", frame, impaired=True) for frame in sequence.frames]
    noise = np.stack(heard).astype(np.complex128) - clean
    lost = np.isnan(noise)
    assert lost.any()
    wanted = np.sum(np.abs(clean - static) ** 2) / np.sum(np.abs(noise[~lost]) ** 2)
    assert sensitivity._snr_db(sequence, "wifi") == pytest.approx(10 * np.log10(wanted), abs=1e-4)


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch, one_step: Callable[[pytest.MonkeyPatch], None]) -> Setup:
    """A setup whose fit takes a moment."""
    one_step(monkeypatch)
    small = TrainConfig(num_gaussians=200, posture="standing", iterations=3, solver_steps=2)
    monkeypatch.setattr(Setup, "config", small)
    return Setup("living_room_walk", "wifi", "1:2")


@pytest.mark.slow
def test_a_setup_is_kept_and_its_rows_tell_who_is_best(
    quick: Setup, tiny_dataset: Path, tmp_path: Path
) -> None:
    shutil.copytree(tiny_dataset, tmp_path / quick.dataset)
    assert stored(quick, tmp_path) is None
    SetupPart(quick).make(tmp_path)
    found = stored(quick, tmp_path)
    assert found is not None and found["snr_db"] is None
    missing = replace(quick, depth=1)
    points = [("2", quick), ("1", missing)]
    row, empty = sweep_rows({"depth": points}, {quick: found})
    scores = {name: groups["geometry"]["f10"] for name, groups in found["methods"].items()}
    assert row.f10 == scores["rfgs"] and row.prior_f10 == scores["body_prior"]
    bodies = ("rfgs", "body_prior", "template", "template_filled")
    assert row.best_f10 == max(
        value for name, value in scores.items() if value is not None and name not in bodies
    )
    assert scores[row.best] == row.best_f10
    assert empty.f10 is None and empty.best == ""
    text = sweep_table([row, empty])
    assert "| 1 | – | – |" in text and f"({'MUSIC' if row.best == 'music' else ''}" in text
    path = tmp_path / "setups" / f"{quick.name}.json"
    path.rename(path.with_name(f"{missing.name}.json"))
    with pytest.raises(RfgsFormatError, match="tells of another setup; delete it"):
        stored(missing, tmp_path)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--radio lidar", "unknown radio 'lidar'"),
        ("--radio sar", "--radio sar: expected antennas that stand still"),
        ("--scene kitchen", "--scene kitchen: expected one of living_room_walk"),
        ("--scene street --sweeps walls", "--sweeps walls: street has none; expected some of b"),
        ("--workers 0", "--workers 0: expected 1 to 256"),
    ],
)
def test_what_there_is_not_is_refused_before_anything_is_made(
    words: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["bench", "sensitivity", "--out", str(tmp_path / "out"), *words.split()]) == 2
    line = capsys.readouterr().err.strip()
    assert said in line and "\n" not in line
    assert not (tmp_path / "out").exists()


def test_sweeps_of_an_unknown_scene_are_refused() -> None:
    with pytest.raises(RfgsError, match="expected one of living_room_walk"):
        sweeps("wifi", scene="kitchen")
