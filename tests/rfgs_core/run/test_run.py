# SPDX-License-Identifier: Apache-2.0
"""Opening a run: what it predicts, and what is refused with a clear line."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
import zarr

from rfgs_core.arrays import load_arrays, save_arrays
from rfgs_core.dataset.names import SequenceFiles
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.files import read_json, write_json
from rfgs_core.gaussians import Gaussians
from rfgs_core.gaussians.ply import cloud_of, write_ply
from rfgs_core.measure import observations
from rfgs_core.measure.observations import observe, visible_channel
from rfgs_core.model.channel import Channel
from rfgs_core.run import Run, open_run
from rfgs_core.seals import write_sealed_json


@pytest.fixture
def own_run(trained_run: Run, own_dataset: Path) -> Path:
    """A copy of the run beside a copy of its dataset; both may be damaged."""
    folder = Path(shutil.copytree(trained_run.path, own_dataset.parent / "run"))
    return open_run(folder).with_dataset(own_dataset).path


def test_the_opened_run_is_the_trained_one(trained_run: Run) -> None:
    opened = open_run(trained_run.path)
    assert opened.config == trained_run.config
    assert opened.frames == [1, 2]
    assert opened.sequence.name == "tiny"
    moving, everything = opened.moving(2), opened.gaussians(2)
    for name, value in moving.items():
        assert torch.equal(value, getattr(everything, name))


def test_prediction_covers_held_out_links_and_subcarriers(trained_run: Run) -> None:
    seen = observe(trained_run.sequence, "wifi", 2)
    predicted = trained_run.predict(2)
    assert predicted.shape == seen.delta.shape
    assert predicted.dtype == np.complex64
    hidden = ~(seen.links[..., None] & seen.subcarriers)
    assert hidden.mean() > 0.3
    assert (predicted[hidden] != 0).all()
    # Where training looked it is what training compared with the data.
    channel = Channel.of(seen, seen.links, seen.subcarriers)
    with torch.no_grad():
        expected = channel.change(trained_run.head, trained_run.moving(2)).numpy()
    got = predicted[seen.links][:, seen.subcarriers]
    np.testing.assert_allclose(got, expected, rtol=1e-4, atol=1e-9)


def test_training_explains_what_it_saw_and_some_of_what_it_did_not(
    tiny_dataset: Path, train, quick_config, tmp_path: Path
) -> None:
    """Power of the error against the power of the change; silence has one."""
    config = replace(
        quick_config, num_gaussians=300, iterations=80, solver_steps=8, batch_entries=8192
    )
    run = train(tiny_dataset, tmp_path / "run", config, [1])
    seen = observe(run.sequence, "wifi", 1)
    true = run.sequence.csi("wifi", 1) - run.sequence.csi_static("wifi")
    error, power = np.abs(run.predict(1) - true) ** 2, np.abs(true) ** 2
    visible = seen.links[..., None] & seen.subcarriers
    assert error[visible].sum() < 0.1 * power[visible].sum()
    assert error[~visible].sum() < power[~visible].sum()


def test_a_refit_knows_no_more_than_what_is_left(
    trained_run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Other values at left-out entries change nothing; at the others they do."""
    seen = trained_run.observations(1)
    links, subcarriers = seen.links.copy(), seen.subcarriers.copy()
    links[:, np.flatnonzero(links.any(axis=0))[::2]] = False
    subcarriers[: len(subcarriers) // 4] = False
    kept = links[..., None] & subcarriers
    less = trained_run.observations(1, (links, subcarriers))
    first = trained_run.refitted(1, less)
    assert np.vdot(first[kept], seen.delta[kept]).real > 0
    change = trained_run.visible_change(1, less)
    np.testing.assert_array_equal(np.isfinite(change), kept)
    np.testing.assert_array_equal(change[kept], seen.delta[kept])

    def after(factor: np.ndarray) -> np.ndarray:
        def altered(*args: Any, **options: Any) -> Any:
            elements, links, subcarriers, csi = visible_channel(*args, **options)
            return elements, links, subcarriers, (csi * factor).astype(np.complex64)

        monkeypatch.setattr(observations, "visible_channel", altered)
        return trained_run.refitted(1, trained_run.observations(1, (links, subcarriers)))

    np.testing.assert_array_equal(after(np.where(kept, 1.0, -3.0)), first)
    assert not np.allclose(after(np.where(kept, -1.0, 1.0)), first, rtol=0.1)


def test_a_refit_from_everything_is_the_fit_before_it_is_refined(
    tiny_dataset: Path, train, quick_config, tmp_path: Path
) -> None:
    run = train(tiny_dataset, tmp_path / "run", replace(quick_config, iterations=0), [1])
    again = run.refitted(1, run.observations(1))
    np.testing.assert_allclose(again, run.predict(1), rtol=1e-2, atol=1e-3 * np.abs(again).max())


def test_prediction_is_zero_on_links_that_the_radio_lacks(trained_run: Run, own_run: Path) -> None:
    files = SequenceFiles(own_run.parent / "dataset" / "tiny")
    store = files.csi("wifi")
    devices = [
        zarr.open_array(str(store / name), mode="r")[...] for name in ("tx_device", "rx_device")
    ]
    own = devices[0][:, None] == devices[1]
    zarr.open_array(str(store / "measured"), mode="r+")[...] = ~own
    predicted = open_run(own_run).predict(1)
    assert (predicted[own] == 0).all()
    before = trained_run.predict(1)
    assert np.abs(before[own]).max() > 0
    np.testing.assert_allclose(predicted[~own], before[~own], rtol=1e-4, atol=1e-9)


def test_run_and_dataset_move_together(own_run: Path, trained_run: Run, tmp_path: Path) -> None:
    moved = tmp_path / "elsewhere"
    moved.mkdir()
    shutil.move(own_run, moved / "run")
    shutil.move(own_run.parent / "dataset", moved / "dataset")
    run = open_run(moved / "run")
    np.testing.assert_array_equal(run.predict(1), trained_run.predict(1))


def test_static_gaussians_come_first(own_run: Path, make_gaussians) -> None:
    static = make_gaussians(3)
    write_ply(own_run / "gaussians/static.ply", cloud_of(static))
    run = open_run(own_run)
    everything = run.gaussians(1)
    assert len(everything) == 3 + 40
    torch.testing.assert_close(everything.means[:3], static.means)
    assert (everything.features[:3] == 0).all()
    assert torch.equal(everything.means[3:], run.moving(1).means)
    (own_run / "gaussians/static.ply").unlink()
    assert len(run.gaussians(1)) == 40
    joined = Gaussians.join(Gaussians.none(), run.moving(1))
    assert len(joined) == 40


def test_bodies_are_those_of_the_checkpoint(own_run: Path) -> None:
    path = own_run / "checkpoints" / "000001.npz"
    arrays = load_arrays(path, "try again", unknown=("velocity_xy", "knees_rad"))
    save_arrays(path, {**arrays, "knees_rad": np.array([0.5])})
    bodies = open_run(own_run).bodies(1)
    assert bodies is not None
    np.testing.assert_array_equal(bodies.axes_xy, arrays["axes_xy"])
    assert bodies.knees_rad.tolist() == [0.5]
    assert not bodies.lies.any()
    lying = np.array([[0.3, 0.13]])
    save_arrays(path, {**arrays, "lying": lying})
    bodies = open_run(own_run).bodies(1)
    assert bodies is not None and bodies.lies.all()
    np.testing.assert_array_equal(bodies.ways, lying)
    # Versions that told no postures kept none.
    save_arrays(path, {name: value for name, value in arrays.items() if name != "knees_rad"})
    with pytest.raises(
        RfgsFormatError,
        match=r"000001\.npz: .*missing knees_rad; delete what is damaged and run",
    ):
        open_run(own_run).bodies(1)
    path.unlink()
    assert open_run(own_run).bodies(1) is None


def test_a_folder_without_a_run_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RfgsError, match=r"is not a run: it has no config\.json"):
        open_run(tmp_path)


@pytest.mark.parametrize("text", ['{"schema": "rfgs-run/2"}', "{}", "[]", "7", "{"])
def test_newer_and_damaged_settings_are_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "config.json").write_text(text)
    with pytest.raises(RfgsFormatError, match=r"config\.json: expected"):
        open_run(tmp_path)


def test_settings_without_a_needed_entry_are_refused(own_run: Path) -> None:
    config = read_json(own_run / "config.json")
    del config["frames"]
    write_sealed_json(own_run / "config.json", config)
    with pytest.raises(RfgsFormatError, match=r"config\.json: .*frames"):
        open_run(own_run)


def test_a_run_with_options_that_are_gone_is_refused_by_their_names(own_run: Path) -> None:
    old = {"power_trust": 0.0, "coarse_share": 0.0}
    write_sealed_json(own_run / "config.json", {**read_json(own_run / "config.json"), **old})
    expected = r"config\.json: .*found coarse_share, power_trust unknown; .*or train again"
    with pytest.raises(RfgsFormatError, match=expected):
        open_run(own_run)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("seed", "x"),
        ("unexplained", None),
        ("without", "prune"),
        ("frames", []),
        ("frames", ["../../elsewhere"]),
        ("frames", 7),
        ("frames", [1.5]),
        ("radio", 3),
        ("dataset", None),
    ],
)
def test_settings_of_another_type_are_refused(own_run: Path, name: str, value: object) -> None:
    write_sealed_json(own_run / "config.json", {**read_json(own_run / "config.json"), name: value})
    with pytest.raises(RfgsFormatError, match=rf"config\.json: {name}(\[0\])?: expected"):
        open_run(own_run)


def test_features_of_other_gaussians_are_refused(own_run: Path) -> None:
    file = own_run / "gaussians" / "000001.features.npz"
    arrays = load_arrays(file, "")
    save_arrays(file, {name: value[:-1] for name, value in arrays.items()})
    with pytest.raises(RfgsFormatError, match=r"000001\.ply: holds \d+ Gaussians, but .* of \d+"):
        open_run(own_run).moving(1)
    save_arrays(file, {**arrays, "features": arrays["features"][:, :5]})
    with pytest.raises(
        RfgsFormatError,
        match=r"features has shape .*; delete what is damaged and run the same `rfgs train`",
    ):
        open_run(own_run).moving(1)


def test_a_head_without_an_array_is_refused(own_run: Path) -> None:
    file = own_run / "radio_head.npz"
    arrays = load_arrays(file, "")
    del arrays["rho_logit"]
    save_arrays(file, arrays)
    with pytest.raises(RfgsFormatError, match=r"radio_head\.npz: .*missing rho_logit; delete"):
        _ = open_run(own_run).head


def test_a_changed_dataset_is_refused(own_run: Path) -> None:
    place = own_run.parent / "dataset"
    info = read_json(place / "dataset.json")
    write_json(place / "dataset.json", {**info, "root_seed": 12})
    run = open_run(own_run)
    with pytest.raises(
        RfgsError, match=r"was trained on another dataset than .*/dataset holds now"
    ):
        run.predict(1)


def test_a_missing_dataset_is_refused(own_run: Path) -> None:
    shutil.rmtree(own_run.parent / "dataset")
    with pytest.raises(RfgsError, match=r"is no longer at .*dataset; bring it back, or run"):
        _ = open_run(own_run).sequence


def test_a_frame_that_was_not_trained_is_refused(trained_run: Run) -> None:
    with pytest.raises(RfgsError, match=r"holds no frame 9; it has \[1, 2\]"):
        trained_run.gaussians(9)


@pytest.mark.parametrize("name", ["gaussians/000001.features.npz", "radio_head.npz"])
@pytest.mark.parametrize("size", [0, 20, -40])
def test_damaged_arrays_are_refused(own_run: Path, name: str, size: int) -> None:
    file = own_run / name
    file.write_bytes(file.read_bytes()[:size])
    with pytest.raises(RfgsFormatError, match=rf"{Path(name).name}: .*damaged.*train"):
        open_run(own_run).predict(1)


def test_a_missing_head_is_refused(own_run: Path) -> None:
    (own_run / "radio_head.npz").unlink()
    with pytest.raises(
        RfgsError,
        match=r"radio_head\.npz: no such file; delete what is damaged",
    ):
        open_run(own_run).predict(1)
