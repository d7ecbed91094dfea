# SPDX-License-Identifier: Apache-2.0
"""Training over frames: files, resume, what is refused, what never influences it."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
import zarr

from rfgs_core.bodies import posture
from rfgs_core.dataset import Sequence, open_dataset
from rfgs_core.dataset.csi_store import digest
from rfgs_core.dataset.names import SequenceFiles
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.files import read_json, write_json
from rfgs_core.fit import refine as refine_module
from rfgs_core.fit import task as task_module
from rfgs_core.gaussians.ply import read_ply
from rfgs_core.measure.observations import observe
from rfgs_core.render.shader import ShaderConfig
from rfgs_core.render.view import fit_run_shader
from rfgs_core.run import Run, open_run
from rfgs_core.run.begun import finished_run
from rfgs_core.run.training import train_sequence
from rfgs_core.seals import write_sealed_json
from rfgs_core.settings import TrainConfig

RESULTS = [
    "gaussians/000001.features.npz",
    "gaussians/000001.ply",
    "gaussians/000002.features.npz",
    "gaussians/000002.ply",
    "gaussians/static.ply",
    "point_cloud.ply",
    "radio_head.npz",
]
CHECKPOINTS = ["checkpoints/000001.npz", "checkpoints/000002.npz"]


def result_bytes(run: Run) -> dict[str, bytes]:
    return {name: (run.path / name).read_bytes() for name in RESULTS + CHECKPOINTS}


def poison_held_out(dataset: Path) -> None:
    """NaN wherever something is held out, in every channel of the tiny dataset."""
    sequence = open_dataset(dataset).sequence()
    seen = observe(sequence, "wifi", 1)
    hidden = ~(seen.links[..., None] & seen.subcarriers)
    files = SequenceFiles(dataset / "tiny")
    store = files.csi("wifi")
    values = {frame: sequence.csi("wifi", frame) for frame in (1, 2)}
    values[None] = sequence.csi_static("wifi")
    for frame, value in values.items():
        value[hidden] = complex(np.nan, np.nan)
        name = "csi_static" if frame is None else "csi"
        array = zarr.open_array(str(store / name), mode="r+")
        array[... if frame is None else frame - 1] = value
        write_json(files.csi_done("wifi", frame), {"sha256": digest(value)})
    assert np.isnan(sequence.csi("wifi", 2)).mean() > 0.3


def test_a_run_holds_the_documented_files(trained_run: Run, quick_config) -> None:
    present = [
        path.relative_to(trained_run.path).as_posix()
        for path in sorted(trained_run.path.rglob("*"))
        if path.is_file()
    ]
    assert present == sorted([*RESULTS, *CHECKPOINTS, "config.json", "people.json"])
    config = read_json(trained_run.path / "config.json")
    assert config["schema"] == "rfgs-run/1"
    assert (config["radio"], config["sequence"], config["frames"]) == ("wifi", "tiny", [1, 2])
    assert config["num_gaussians"] == 40
    assert config["bodies"] == 1
    assert config["train_s"] > 0
    assert not Path(config["dataset"]).is_absolute()
    for frame in (1, 2):
        attributes = trained_run.attributes(frame)
        shapes = {name: value.shape for name, value in attributes.items()}
        expected = {"features": (40, 32), "gamma": (40, 1), "rf_power_db": (40,)}
        assert shapes == {**expected, "track_id": (40,), "body": (40,)}
        assert attributes["gamma"].dtype == np.complex64
        cloud = read_ply(trained_run.ply_path(frame))
        assert len(cloud) == 40
        np.testing.assert_array_equal(cloud.rf_power_db, attributes["rf_power_db"])
        head = trained_run.head
        gamma = head.gamma(torch.from_numpy(attributes["features"])).numpy()
        np.testing.assert_array_equal(gamma, attributes["gamma"][:, 0])
    assert len(read_ply(trained_run.path / "gaussians/static.ply")) == 0
    first = (trained_run.path / "gaussians/000001.ply").read_bytes()
    assert (trained_run.path / "point_cloud.ply").read_bytes() == first


def test_gaussians_stand_where_the_sphere_is(trained_run: Run) -> None:
    """Wi-Fi in a small room with few antennas: within its 0.94 m of range resolution."""
    for frame in (1, 2):
        centre = trained_run.moving(frame).means.mean(dim=0)[:2]
        assert np.linalg.norm(centre.numpy() - [1.1 + 0.2 * frame, 1.4]) < 0.94


def test_two_thirds_of_the_tracks_go_on(trained_run: Run) -> None:
    first, second = (trained_run.attributes(frame)["track_id"] for frame in (1, 2))
    assert first.tolist() == list(range(40))
    kept = second < 40
    assert kept.sum() == 40 - 40 // 3
    np.testing.assert_array_equal(second[kept], first[kept])
    assert sorted(second[~kept].tolist()) == list(range(40, 53))


def test_the_same_command_again_changes_nothing(
    trained_run: Run, tiny_dataset: Path, train, quick_config, tmp_path: Path
) -> None:
    before = result_bytes(trained_run)
    again = train(tiny_dataset, trained_run.path, quick_config)
    assert result_bytes(again) == before
    assert again.config == trained_run.config


def test_another_folder_gives_the_same_bytes_and_another_seed_others(
    trained_run: Run, tiny_dataset: Path, train, quick_config, tmp_path: Path
) -> None:
    again = train(tiny_dataset, tmp_path / "a", quick_config)
    assert result_bytes(again) == result_bytes(trained_run)
    other = train(tiny_dataset, tmp_path / "b", replace(quick_config, seed=6))
    assert (
        result_bytes(other)["gaussians/000002.ply"] != result_bytes(again)["gaussians/000002.ply"]
    )


def test_postures_that_are_told_give_the_same_bytes_too(
    tiny_dataset: Path, train, quick_config, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(posture, "GAUSSIANS", 40)
    config = replace(quick_config, posture="told")
    first, again = (train(tiny_dataset, tmp_path / name, config, [1]) for name in "ab")
    assert (first.path / CHECKPOINTS[0]).read_bytes() == (again.path / CHECKPOINTS[0]).read_bytes()
    bodies = first.bodies(1)
    assert bodies is not None and bodies.knees_rad.shape == (1,)


@pytest.mark.parametrize("when", ["before frame 2", "within frame 2"])
def test_a_stopped_run_ends_where_an_undisturbed_one_does(
    trained_run: Run, tiny_dataset: Path, train, quick_config, tmp_path, monkeypatch, when
) -> None:
    out = tmp_path / "run"
    with monkeypatch.context() as patch:
        if when == "before frame 2":
            real = Run.observations

            def stop(run, frame):
                if frame == 2:
                    raise KeyboardInterrupt
                return real(run, frame)

            patch.setattr(Run, "observations", stop)
        else:
            patch.setattr(refine_module, "CHECKPOINT_EVERY", 2)
            real_loss, calls = task_module.channel_loss, []

            def stop_loss(*arguments):
                calls.append(1)
                if len(calls) == 4 + 4:
                    raise KeyboardInterrupt
                return real_loss(*arguments)

            patch.setattr(task_module, "channel_loss", stop_loss)
        with pytest.raises(KeyboardInterrupt):
            train(tiny_dataset, out, quick_config)
    assert (out / "gaussians/000001.ply").exists()
    assert not (out / "gaussians/000002.ply").exists()
    assert (out / "checkpoints/000002.partial.npz").exists() == (when == "within frame 2")
    resumed = train(tiny_dataset, out, quick_config)
    assert result_bytes(resumed) == result_bytes(trained_run)
    assert not list(out.rglob("*.partial.npz"))
    assert not list(out.rglob(".tmp-*"))


@pytest.mark.parametrize(
    ("change", "name"),
    [
        ({"seed": 1}, "seed"),
        ({"objective": "both"}, "objective"),
        ({"iterations": 9, "num_gaussians": 41}, "num_gaussians, iterations"),
    ],
)
def test_other_settings_are_refused_by_name(
    trained_run: Run, tiny_dataset: Path, train, quick_config, change: dict, name: str
) -> None:
    with pytest.raises(RfgsError, match=f"holds a run with another {name};"):
        train(tiny_dataset, trained_run.path, replace(quick_config, **change))


def test_other_frames_and_other_data_are_refused(
    trained_run: Run, tiny_dataset: Path, own_dataset: Path, train, quick_config, tmp_path
) -> None:
    with pytest.raises(RfgsError, match="another frames;"):
        train(tiny_dataset, trained_run.path, quick_config, [2])
    run = Path(shutil.copytree(trained_run.path, tmp_path / "run"))
    info = read_json(own_dataset / "dataset.json")
    write_json(own_dataset / "dataset.json", {**info, "root_seed": 9})
    with pytest.raises(RfgsError, match="another dataset, dataset_fingerprint;"):
        train(own_dataset, run, quick_config)


def test_a_run_of_a_newer_version_is_not_continued(
    trained_run: Run, tiny_dataset: Path, train, quick_config, tmp_path
) -> None:
    run = Path(shutil.copytree(trained_run.path, tmp_path / "run"))
    write_sealed_json(run / "config.json", {**trained_run.config.entries, "schema": "rfgs-run/2"})
    with pytest.raises(RfgsFormatError, match="expected schema rfgs-run/1, found rfgs-run/2"):
        train(tiny_dataset, run, quick_config)


@pytest.mark.parametrize(
    "gone", ["gaussians/000001.ply", "gaussians/000002.features.npz", "radio_head.npz"]
)
def test_the_same_command_makes_what_is_missing(
    gone: str, trained_run: Run, tiny_dataset: Path, tmp_path: Path, train, quick_config
) -> None:
    """As messages about damaged files say: delete it and train again."""
    own = open_run(Path(shutil.copytree(trained_run.path, tmp_path / "run")))
    before = result_bytes(own)
    (own.path / gone).unlink()
    data = open_dataset(tiny_dataset)
    asked = (own.path, data, data.sequence(), "wifi", [1, 2], quick_config)
    assert finished_run(*asked, people="told", excess=0.0) is None
    assert result_bytes(train(tiny_dataset, own.path, quick_config)) == before
    assert finished_run(*asked, people="told", excess=0.0) is not None


def test_a_damaged_finished_frame_says_what_to_do(
    trained_run: Run, tiny_dataset: Path, train, quick_config, tmp_path
) -> None:
    run = Path(shutil.copytree(trained_run.path, tmp_path / "run"))
    file = run / "checkpoints/000002.npz"
    file.write_bytes(file.read_bytes()[:3000])
    # Where the dataset lies now is found out by the training.
    place = Path(shutil.copytree(tiny_dataset, tmp_path / "dataset"))
    with pytest.raises(RfgsFormatError, match=r"checkpoints/000002\.npz: .*damaged.*delete it"):
        train(place, run, quick_config)
    file.unlink()
    assert result_bytes(train(place, run, quick_config)) == result_bytes(trained_run)


def test_held_out_entries_never_influence_training(
    trained_run: Run, own_dataset: Path, train, quick_config, tmp_path: Path
) -> None:
    poison_held_out(own_dataset)
    poisoned = train(own_dataset, tmp_path / "run", quick_config)
    assert result_bytes(poisoned) == result_bytes(trained_run)


def test_pictures_and_meshes_never_influence_training(
    trained_run: Run, own_dataset: Path, train, quick_config, tmp_path: Path
) -> None:
    for name in ("images", "images_empty", "depth", "normal", "mask", "geometry"):
        shutil.rmtree(own_dataset / "tiny" / name)
    blind = train(own_dataset, tmp_path / "run", quick_config)
    assert result_bytes(blind) == result_bytes(trained_run)


def test_the_shader_changes_colours_only(trained_run: Run, tiny_dataset: Path, tmp_path) -> None:
    root = tmp_path / "both"
    shutil.copytree(tiny_dataset, root / "dataset")
    shutil.copytree(trained_run.path, root / "run")
    colored = open_run(root / "run").with_dataset(root / "dataset")
    fit_run_shader(colored, ShaderConfig(1e-2, steps=3, pictures_per_step=1))
    for name in RESULTS + CHECKPOINTS:
        after, before = root / "run" / name, trained_run.path / name
        if name.endswith(".npz"):
            assert after.read_bytes() == before.read_bytes(), name
            continue
        new, old = read_ply(after), read_ply(before)
        for field in ("means", "quats", "log_scales", "logit_opacities"):
            np.testing.assert_array_equal(getattr(new, field), getattr(old, field))
    colours = [read_ply(run.ply_path(1)).f_dc for run in (colored, trained_run)]
    assert not np.array_equal(*colours)


@pytest.mark.parametrize("objective", ["paper", "both"])
def test_the_other_objectives_run_and_resume(
    trained_run: Run, tiny_dataset: Path, train, quick_config, tmp_path, objective: str
) -> None:
    config = replace(quick_config, objective=objective, num_gaussians=30)
    run = train(tiny_dataset, tmp_path / "run", config)
    for frame in (1, 2):
        gaussians = run.moving(frame)
        assert all(torch.isfinite(value).all() for _, value in gaussians.items())
        assert np.isfinite(run.predict(frame)).all()
        assert np.abs(run.predict(frame)).max() > 0
    assert open_run(tmp_path / "run").config.settings.objective == objective


def test_one_frame_alone_is_a_run(tiny_dataset: Path, train, quick_config, tmp_path) -> None:
    run = train(tiny_dataset, tmp_path / "run", quick_config, [2])
    assert run.frames == [2]
    assert len(run.moving(2)) == len(read_ply(run.path / "point_cloud.ply")) == 40


def test_curves_are_logged_on_request(
    trained_run: Run, tiny_dataset: Path, quick_config, tmp_path: Path
) -> None:
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    data = open_dataset(tiny_dataset)
    out = tmp_path / "run"
    train_sequence(data, data.sequence(), "wifi", [1], quick_config, out, log=True)
    events = EventAccumulator(str(out / "log")).Reload()
    losses = events.Scalars("frame 000001/loss")
    assert [entry.step for entry in losses] == [1, 2, 3, 4]
    assert all(np.isfinite(entry.value) for entry in losses)
    assert [entry.value for entry in events.Scalars("frame 000001/Gaussians")] == [40.0] * 4
    name = "gaussians/000001.ply"
    assert (out / name).read_bytes() == (trained_run.path / name).read_bytes()


def test_antennas_of_two_polarisations_are_refused(
    tiny_dataset: Path, tmp_path: Path, quick_config, monkeypatch: pytest.MonkeyPatch
) -> None:
    """VV and HH of a body have opposite signs: what is summed over both is nothing at all."""
    own = Sequence.radio_spec
    monkeypatch.setattr(
        Sequence, "radio_spec", lambda self, name: replace(own(self, name), polarization="VH")
    )
    dataset = open_dataset(tiny_dataset)
    sequence = dataset.sequence()
    with pytest.raises(RfgsError, match=r"two polarisations \(VH\).*polarization: V or H"):
        train_sequence(dataset, sequence, "wifi", [1], quick_config, tmp_path / "run")
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("part", ["densify", "prune", "feature_gradients"])
def test_parts_of_a_rule_that_is_not_followed_cannot_be_left_out(part) -> None:
    with pytest.raises(RfgsError, match=f"--without {part} .* --density none has others"):
        TrainConfig(objective="paper", density="none", without=(part,))
    assert TrainConfig(objective="paper", density="paper", without=(part,)).without == (part,)
    assert TrainConfig(objective="paper", density="none", without=("rf_weights",))
