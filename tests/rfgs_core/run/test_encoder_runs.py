# SPDX-License-Identifier: Apache-2.0
"""From `rfgs encode` to a run that keeps its encoder and refuses another."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rfgs_core.cli import main
from rfgs_core.dataset import open_dataset
from rfgs_core.encode.learned import LearnedEncoder, load_encoder, save_encoder
from rfgs_core.errors import RfgsError
from rfgs_core.measure.observations import observe
from rfgs_core.run.encoders import ENCODER_FILE, run_encoder, with_encoder
from rfgs_core.run.training import train_sequence
from rfgs_core.settings import TrainConfig


@pytest.fixture(scope="module")
def encoder_file(tiny_dataset: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A briefly trained encoder of the tiny dataset's radio."""
    file = tmp_path_factory.mktemp("encoder") / "wifi.npz"
    command = ["encode", str(tiny_dataset), "--radio", "wifi", "--steps", "2", "--out", str(file)]
    assert main(command) == 0
    return file


@pytest.fixture
def paper_config(quick_config: TrainConfig) -> TrainConfig:
    return replace(quick_config, objective="paper", refine_levels=1)


def test_the_command_writes_an_encoder_of_the_radio(
    encoder_file: Path, tiny_dataset: Path, capsys
) -> None:
    sequence = open_dataset(tiny_dataset).sequence()
    encoder = load_encoder(encoder_file)
    assert encoder.kind == "csi"
    seen = observe(sequence, "wifi", 1)
    features = encoder(seen, np.array([[1.3, 1.4, 1.0], [2.5, 2.5, 0.2]]))
    assert np.isfinite(features).all()
    command = ["encode", str(tiny_dataset), "--radio", "wifi", "--steps", "1", "--frames", "1"]
    again = encoder_file.with_name("again.npz")
    assert main([*command, "--out", str(again)]) == 0
    told = capsys.readouterr().out
    assert "network csi; hidden entries of the training frame predicted with" in told
    assert f"--encoder cnn:{again}" in told


@pytest.mark.parametrize(
    ("extra", "message"),
    [
        (["--out", "e.pt"], "ends in .npz"),
        (["--out", "e.npz", "--steps", "0"], "--steps 0: expected at least 1"),
        (["--out", "e.npz", "--network", "cube"], "use --network csi"),
    ],
)
def test_what_cannot_be_trained_is_named(extra, message, tiny_dataset, tmp_path, capsys) -> None:
    extra[1] = str(tmp_path / extra[1])
    assert main(["encode", str(tiny_dataset), "--radio", "wifi", *extra]) == 2
    assert message in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_run_keeps_its_encoder_and_refuses_another(
    encoder_file: Path, tiny_dataset: Path, paper_config: TrainConfig, tmp_path: Path
) -> None:
    data = open_dataset(tiny_dataset)
    config, file = with_encoder(paper_config, f"cnn:{encoder_file}")
    assert file == encoder_file

    def train(config: TrainConfig, file: Path | None):
        return train_sequence(data, data.sequence(), "wifi", [1], config, tmp_path / "run", file)

    run = train(config, file)
    assert (run.path / ENCODER_FILE).read_bytes() == encoder_file.read_bytes()
    assert run.config.settings.encoder == "cnn"
    points = np.array([[1.3, 1.4, 1.0]])
    seen = observe(data.sequence(), "wifi", 1)
    kept = run_encoder(run.path, run.config, run.sequence, 1)
    np.testing.assert_array_equal(kept(seen, points), load_encoder(encoder_file)(seen, points))
    train(config, file)
    other = tmp_path / "other.npz"
    save_encoder(other, LearnedEncoder.untrained("csi", seen, 5))
    with pytest.raises(RfgsError, match="a run with another encoder_sha256"):
        train(*with_encoder(paper_config, f"cnn:{other}"))
    with pytest.raises(RfgsError, match="a run with another encoder, encoder_sha256"):
        train(*with_encoder(paper_config, "matched_filter"))
    (run.path / ENCODER_FILE).write_bytes(other.read_bytes())
    with pytest.raises(RfgsError, match=r"encoder\.npz is not the encoder that this run began"):
        run_encoder(run.path, run.config, run.sequence, 1)
    (run.path / ENCODER_FILE).unlink()
    with pytest.raises(RfgsError, match="no such file"):
        run_encoder(run.path, run.config, run.sequence, 1)


def test_the_encoder_changes_what_the_papers_objective_finds(
    encoder_file: Path, tiny_dataset: Path, paper_config: TrainConfig, tmp_path: Path, train
) -> None:
    data = open_dataset(tiny_dataset)
    config, file = with_encoder(paper_config, f"cnn:{encoder_file}")
    learned = train_sequence(data, data.sequence(), "wifi", [1], config, tmp_path / "learned", file)
    plain = train(tiny_dataset, tmp_path / "plain", paper_config, [1])
    difference = learned.moving(1).means - plain.moving(1).means
    assert 1e-6 < float(difference.abs().max()) < 1.0


def test_an_encoder_of_another_radio_is_refused_before_anything_is_written(
    tiny_dataset: Path, tmp_path: Path, make_observations, capsys
) -> None:
    foreign = tmp_path / "foreign.npz"
    save_encoder(foreign, LearnedEncoder.untrained("csi", make_observations(), 0))
    command = ["train", str(tiny_dataset), "--radio", "wifi", "--out", str(tmp_path / "run")]
    for encoder, message in (
        (f"cnn:{foreign}", "was made for a radio of 32 subcarriers"),
        ("cnn", "expected matched_filter, paths or cnn:FILE"),
        ("transformer:x", "expected matched_filter, paths or cnn:FILE"),
        (f"cnn:{tmp_path / 'absent.npz'}", "no such file"),
        ("paths", "this dataset holds no paths"),
    ):
        assert main([*command, "--encoder", encoder]) == 2
        error = capsys.readouterr().err
        assert message in error
        assert len(error.strip().splitlines()) == 1
    assert not (tmp_path / "run").exists()
