# SPDX-License-Identifier: Apache-2.0
"""Static Gaussians: found from their own background, kept in a run, nothing of what moves."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from scipy.spatial import KDTree

from rfgs_core.background.static_set import NEAREST_M, StaticSet, fit_static_set
from rfgs_core.cli import main
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.evaluate.background import Backgrounds, background_metrics
from rfgs_core.evaluate.scene import Scene
from rfgs_core.gaussians import Gaussians
from rfgs_core.gaussians.ply import cloud_of, read_ply, write_ply
from rfgs_core.model.first_gaussians import gaussians_at
from rfgs_core.model.head import RadioHead
from rfgs_core.predict.prediction import predict_channel
from rfgs_core.radio import layout, place_devices
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.render.shader import ShaderConfig
from rfgs_core.render.view import colored_cloud, fit_run_shader
from rfgs_core.run import Run, open_run
from rfgs_core.run import static as static_files
from rfgs_core.run.static import has_static_set, read_static_set, write_static_set
from rfgs_core.view.frame import still_values
from tests import tiny_dataset as tiny

#: Five reflectors, apart from each other by far more than the wide band resolves.
PLACES = np.array(
    [[0.6, 1.8, 1.4], [3.4, 1.7, 0.8], [2.0, 0.4, 1.6], [1.9, 3.1, 1.0], [2.1, 1.6, 2.2]]
)
#: On a wall of the tiny room.
REFLECTOR = np.array([2.95, 1.2, 1.3])
BARE_CHANNELS = tiny.channels


@pytest.fixture
def room(make_observations):
    """Direct paths and five reflectors, a fifth of the array and of the band hidden."""
    subcarriers = np.ones(32, bool)
    subcarriers[24:28] = False
    band = {"freq_min_hz": 5.5e9, "freq_max_hz": 6.1e9, "num_subcarriers": 32}
    elements = make_observations(**band).layout
    links = elements.rx_column < elements.rx_column.max()
    bare = make_observations(None, elements.measured & links, subcarriers, **band)
    normals = np.array([2.0, 1.75, 1.25]) - PLACES
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    head = RadioHead.create(0, 0.06, 0.04, 1.0)
    gamma = torch.polar(torch.full((5,), 0.5), torch.arange(5.0))
    gaussians = gaussians_at(PLACES, normals)
    features = head.with_gamma(gaussians.features, gamma)
    truth = StaticSet(replace(gaussians, features=features), head)
    seen = links[..., None] & subcarriers
    whole = truth.background(bare)
    return replace(bare, static=np.where(seen, whole, 0)), whole, truth


def with_a_reflector(frame: int | None) -> np.ndarray:
    """The tiny room with a strong reflector on a wall, in all frames and without anybody."""
    elements = layout(tiny.RADIO, place_devices(tiny.RADIO, tiny.BOUNDS_M))
    out = np.linalg.norm(elements.tx_xyz - REFLECTOR, axis=1)[:, None, None]
    back = np.linalg.norm(elements.rx_xyz - REFLECTOR, axis=1)[:, None]
    wavelength = SPEED_OF_LIGHT / tiny.RADIO.freq_hz
    turn = np.exp(-2j * np.pi * (out + back) / wavelength)
    echo = 2.0 * wavelength / ((4 * np.pi) ** 1.5 * out * back) * turn
    whole = BARE_CHANNELS(frame) + echo * elements.measured[..., None]
    return whole.astype(np.complex64)


@pytest.fixture(scope="module")
def walled(tmp_path_factory) -> Path:
    """The tiny dataset with a reflector on a wall."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tiny, "channels", with_a_reflector)
        return tiny.write_tiny_dataset(tmp_path_factory.mktemp("walled") / "dataset")


@pytest.fixture(scope="module")
def static_run(walled: Path, tmp_path_factory, train, quick_config) -> Run:
    """A run of two frames with sixty static Gaussians."""
    out = tmp_path_factory.mktemp("static") / "run"
    return train(walled, out, replace(quick_config, static_set=60))


@pytest.fixture
def own_run(static_run: Run, walled: Path, tmp_path: Path) -> Run:
    """A copy that a test may damage."""
    shutil.copytree(walled, tmp_path / "dataset")
    shutil.copytree(static_run.path, tmp_path / "run")
    return open_run(tmp_path / "run").with_dataset(tmp_path / "dataset")


def error_db(got: np.ndarray, true: np.ndarray) -> float:
    return float(10 * np.log10(np.sum(np.abs(got - true) ** 2) / np.sum(np.abs(true) ** 2)))


def test_known_reflectors_are_found_in_their_own_background(room) -> None:
    observations, whole, truth = room
    # Of 400 drawn, as few as five fall on one reflector; of 1600, 25 or more with any seed.
    found = fit_static_set(observations, 1600, seed=3)
    assert len(found.gaussians) == 1600
    means = found.gaussians.means.numpy().astype(np.float64)
    distance_m, nearest = (np.asarray(found) for found in KDTree(PLACES).query(means))
    low, high = observations.bounds_m
    power = np.abs(found.gamma) ** 2
    # The band resolves 25 cm, and places anywhere in this room are 1 m away on average.
    anywhere = np.random.default_rng(0).uniform(low, high, (400, 3))
    assert np.average(distance_m, weights=power) < 0.6
    assert np.mean(KDTree(PLACES).query(anywhere)[0]) > 0.95
    near = np.bincount(nearest[distance_m < 0.4], power[distance_m < 0.4], len(PLACES))
    # The five balls of 40 cm fill 4 % of the room, each of them 0.8 %.
    assert near.sum() > 0.35 * power.sum()
    assert near.min() > 0.02 * power.sum()
    # What they scatter, with the direct paths taken off: on what was seen, and on hidden columns.
    straight = StaticSet(Gaussians.none(), truth.head).background(observations)
    seen = observations.links[..., None] & observations.subcarriers
    hidden = (observations.layout.measured & ~observations.links)[
        ..., None
    ] & observations.subcarriers
    scattered, got = whole - straight, found.background(observations) - straight
    assert error_db(got[seen], scattered[seen]) < -11
    assert error_db(got[hidden], scattered[hidden]) < -3


def test_a_room_of_direct_paths_alone_has_no_static_gaussians(make_observations) -> None:
    observations = make_observations()
    assert len(fit_static_set(observations, 50, seed=0).gaussians) == 0
    assert len(fit_static_set(observations, 0, seed=0).gaussians) == 0


def test_nothing_stands_on_an_antenna_and_all_face_their_devices(static_run: Run) -> None:
    observations, found = static_run.observations(1), read_static_set(static_run.path)
    antennas = np.concatenate([observations.layout.tx_xyz, observations.layout.rx_xyz])
    means = found.gaussians.means.numpy().astype(np.float64)
    assert KDTree(antennas).query(means)[0].min() > NEAREST_M
    normals = found.gaussians.rotations[:, :, 2].numpy()
    own = [observations.layout.rx_device == device for device in range(4)]
    devices = [observations.layout.rx_xyz[rows].mean(axis=0) for rows in own]
    cosine = np.stack([np.sum(normals * (place - means), axis=1) for place in devices])
    assert (cosine > 0).any(axis=0).all()
    assert (means >= observations.bounds_m[0]).all() and (means <= observations.bounds_m[1]).all()


def test_a_run_keeps_its_static_set(
    static_run: Run, walled: Path, train, quick_config, tmp_path: Path
) -> None:
    static = read_static_set(static_run.path)
    assert 0 < len(static.gaussians) <= 60
    cloud = read_ply(static_run.path / "gaussians/static.ply")
    np.testing.assert_array_equal(cloud.means, static.gaussians.means.numpy())
    assert cloud.rf_power_db is not None
    np.testing.assert_allclose(cloud.rf_power_db, static.power_db, rtol=1e-5)
    both = static_run.gaussians(1)
    assert torch.equal(both.means[: len(static.gaussians)], static.gaussians.means)
    without = train(walled, tmp_path / "without", quick_config)
    assert len(read_ply(without.path / "gaussians/static.ply")) == 0
    # It plays no part in the moving ones where an empty room was recorded.
    for frame in (1, 2):
        name = f"gaussians/{frame:06d}.ply"
        assert (static_run.path / name).read_bytes() == (without.path / name).read_bytes()
    whole = read_ply(static_run.path / "point_cloud.ply")
    assert len(whole) == len(both)
    np.testing.assert_array_equal(whole.means, both.means.numpy())
    assert whole.rf_power_db is not None
    np.testing.assert_allclose(whole.rf_power_db[: len(cloud)], cloud.rf_power_db)


def test_static_gaussians_have_power_phase_and_no_colour(own_run: Run) -> None:
    static = read_static_set(own_run.path)
    count = len(static.gaussians)
    shader = fit_run_shader(own_run, ShaderConfig(learning_rate=0.1, steps=2))
    cloud = colored_cloud(own_run, 1, shader)
    assert cloud.rf_power_db is not None
    np.testing.assert_allclose(cloud.rf_power_db[:count], static.power_db, rtol=1e-5)
    np.testing.assert_allclose(cloud.rgb[:count], 0.5, atol=1e-6)
    assert np.ptp(cloud.rgb[count:]) > 0
    stored = read_ply(own_run.path / "point_cloud.ply")
    np.testing.assert_allclose(stored.f_dc[:count], 0, atol=1e-6)
    values = still_values(own_run, count)
    np.testing.assert_allclose(values[1], np.angle(static.gamma), atol=1e-6)


def test_resuming_gives_the_same_bytes(own_run: Run, train, quick_config) -> None:
    config = replace(quick_config, static_set=60)
    names = ["static_head.npz", "gaussians/static.ply", "gaussians/static.features.npz"]
    before = [(own_run.path / name).read_bytes() for name in names]
    (own_run.path / "static_head.npz").unlink()
    (own_run.path / "gaussians/static.ply").unlink()
    train(own_run.path.parent / "dataset", own_run.path, config)
    assert [(own_run.path / name).read_bytes() for name in names] == before


def test_the_empty_room_is_told_better_than_by_direct_paths(own_run: Run) -> None:
    scene = Scene.of(own_run)
    own = Backgrounds.of(scene)
    assert own is not None
    metrics = background_metrics(scene, own)
    rows = metrics["rows"]
    assert rows["zero"]["visible_snr_db"] == pytest.approx(0.0)
    for name in ("visible_snr_db", "element_snr_db", "subcarrier_snr_db"):
        assert rows["static_set"][name] > rows["direct paths"][name] + 1, name
    # Both know what was visible exactly.
    assert rows["static_set, with residual"]["visible_snr_db"] > 60
    assert set(metrics["surface_m"]) == {"power_median", "median", "chance_median"}


def test_new_positions_hear_the_room_on_request(own_run: Run) -> None:
    static = read_static_set(own_run.path)
    moving = own_run.head.radio_gaussians(own_run.moving(1))
    room = static.head.radio_gaussians(static.gaussians)
    radio = own_run.sequence.radio_spec("wifi")
    place = (np.array([0.5, 0.5, 1.0]), np.array([[[2.6, 0.4, 1.5]]]), radio.freq_hz)
    without, with_room = predict_channel(moving, *place), predict_channel(moving, *place, room)
    assert without.csi_room is None and with_room.csi_room is not None
    np.testing.assert_array_equal(with_room.csi, without.csi + with_room.csi_room)
    near = static.away_from(static.gaussians.means[:1].numpy().astype(np.float64))
    assert len(near.gaussians) < len(static.gaussians)


def test_what_does_not_fit_is_refused(own_run: Run, train, tiny_dataset, quick_config) -> None:
    with pytest.raises(RfgsError, match="--static-set -1: expected at least 0"):
        replace(quick_config, static_set=-1)
    config = replace(quick_config, static_set=5, observe="power")
    with pytest.raises(RfgsError, match="expected the phases"):
        train(tiny_dataset, own_run.path.parent / "new", config)
    static = read_static_set(own_run.path)
    write_ply(own_run.path / "gaussians/static.ply", cloud_of(Gaussians.none()))
    with pytest.raises(RfgsFormatError, match="holds 0 Gaussians, but there are features of"):
        own_run.gaussians(1)
    write_static_set(own_run.path, static)
    assert has_static_set(own_run.path)
    (own_run.path / static_files.HEAD_FILE).write_bytes(b"no")
    with pytest.raises(RfgsFormatError, match=r"delete static_head\.npz"):
        own_run.gaussians(1)


def test_a_lost_file_of_the_set_is_named_with_what_to_do(own_run: Run, train, quick_config) -> None:
    ply, dataset = own_run.path / "gaussians/static.ply", own_run.path.parent / "dataset"
    config = replace(quick_config, static_set=60)
    ply.unlink()
    for read in (lambda: own_run.gaussians(1), lambda: train(dataset, own_run.path, config)):
        with pytest.raises(RfgsFormatError, match=r"static\.ply: no such file.*delete static_head"):
            read()
    (own_run.path / static_files.HEAD_FILE).unlink()
    assert len(train(dataset, own_run.path, config).gaussians(1)) > 60


def test_a_run_without_a_set_needs_no_file_of_one(
    own_dataset, tmp_path, train, quick_config
) -> None:
    run = train(own_dataset, tmp_path / "run", quick_config, [1])
    (run.path / "gaussians/static.ply").unlink()
    train(own_dataset, run.path, quick_config, [1])
    assert len(read_ply(run.path / "point_cloud.ply")) == len(run.moving(1))


def test_a_calibrated_run_tells_the_room_as_its_devices_hear_it(
    walled: Path, train, quick_config, tmp_path: Path
) -> None:
    config = replace(quick_config, static_set=30, calibrate="both")
    run = train(walled, tmp_path / "run", config, [1])
    scene = Scene.of(run)
    own = Backgrounds.of(scene)
    assert own is not None
    # What the capture's offsets take out before the fit comes back afterwards.
    visible = scene.held_out.visible
    room = scene.csi_static[visible]
    assert np.abs(run.observations(1).static[visible] - room).max() > 1e-3 * np.abs(room).max()
    np.testing.assert_allclose(own.evidence.static[visible], room, atol=1e-5 * np.abs(room).max())
    np.testing.assert_allclose(own.best[visible], room, atol=1e-4 * np.abs(room).max())


def test_predict_hears_the_room_where_there_is_one(own_run: Run, tmp_path: Path, capsys) -> None:
    out = tmp_path / "new.npz"
    command = ["predict", str(own_run.path), "--tx", "0.5,0.5,1.0", "--rx", "2.6,0.4,1.5"]
    command += ["--room", "--out", str(out)]
    assert main(command) == 0
    assert "what the static Gaussians scatter" in capsys.readouterr().out
    with np.load(out, allow_pickle=False) as stored:
        parts = stored["csi_scatter"] + stored["csi_direct"]
        np.testing.assert_allclose(stored["csi"], parts + stored["csi_room"], rtol=1e-5)
        assert np.abs(stored["csi_room"]).max() > 0
        assert "guess it elsewhere" in str(stored["note"])
    (own_run.path / static_files.HEAD_FILE).unlink()
    assert main(command) != 0
    assert "has no static Gaussians; train it with --static-set" in capsys.readouterr().err
