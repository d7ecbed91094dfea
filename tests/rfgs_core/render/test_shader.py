# SPDX-License-Identifier: Apache-2.0
"""The shader: equation 3, its fit to pictures, and that it never touches the Gaussians."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from rfgs_core.arrays import save_arrays
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.gaussians import Gaussians
from rfgs_core.gaussians.ply import cloud_of, write_ply
from rfgs_core.render.shader import Shader, ShaderConfig, fit_shader
from rfgs_core.render.view import (
    SHADER_FILE,
    STATIC_FILE,
    camera_of,
    color_run_files,
    colored_cloud,
    fit_run_shader,
    fitted_shader,
    moving_gaussians,
    pictures_of,
    render_person,
    render_view,
    training_views,
    true_person,
)

QUICK = ShaderConfig(learning_rate=1e-2, steps=60, pictures_per_step=2, seed=3)


def random_shader(seed: int = 0) -> Shader:
    generator = torch.Generator().manual_seed(seed)
    shapes = {"W1": (64, 32), "W2": (64, 64), "W3": (3, 64)}
    return Shader(**{k: torch.randn(v, generator=generator) for k, v in shapes.items()})


def test_equation_3_against_numpy() -> None:
    shader = random_shader()
    features = torch.randn(5, 32, generator=torch.Generator().manual_seed(1))
    w1, w2, w3 = (m.double().numpy() for m in (shader.W1, shader.W2, shader.W3))
    for row, got in zip(features.double().numpy(), shader.colors(features), strict=True):
        logits = w3 @ np.maximum(w2 @ np.maximum(w1 @ row, 0), 0)
        np.testing.assert_allclose(got, 1 / (1 + np.exp(-logits)), atol=1e-5)
    assert torch.equal(shader.colors(torch.zeros(2, 32)), torch.full((2, 3), 0.5))


def test_saved_shader_is_the_same_and_holds_only_three_matrices(tmp_path: Path) -> None:
    shader = random_shader()
    shader.save(tmp_path / "shader.npz")
    again = Shader.load(tmp_path / "shader.npz")
    assert all(torch.equal(getattr(shader, n), getattr(again, n)) for n in ("W1", "W2", "W3"))
    with np.load(tmp_path / "shader.npz", allow_pickle=False) as stored:
        assert sorted(stored.files) == ["W1", "W2", "W3"]


def test_damaged_shader_files_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "shader.npz"
    with pytest.raises(RfgsError, match="no such file"):
        Shader.load(file)
    random_shader().save(file)
    file.write_bytes(file.read_bytes()[:4000])
    with pytest.raises(RfgsFormatError, match=r"shader\.npz"):
        Shader.load(file)
    arrays = {"W1": np.zeros((64, 32)), "W2": np.zeros((64, 64)), "W3": np.zeros((3, 63))}
    save_arrays(file, arrays)
    with pytest.raises(RfgsFormatError, match="W3 has shape"):
        Shader.load(file)
    pickled = np.array([{"pickled": 1}], dtype=object)
    save_arrays(file, {"W1": pickled, "W2": np.ones(1), "W3": np.ones(1)})
    with pytest.raises(RfgsFormatError, match=r"shader\.npz"):
        Shader.load(file)


def test_unknown_recipe_and_no_pictures_are_refused() -> None:
    assert ShaderConfig.for_recipe("paper").learning_rate == 1e-4
    with pytest.raises(RfgsError, match="expected paper or rfgs"):
        ShaderConfig.for_recipe("quick")
    with pytest.raises(RfgsError, match="no training picture"):
        fit_shader([], QUICK)


def test_splits_share_no_picture_and_train_leaves_out_both_kinds(hand_made_run) -> None:
    held = hand_made_run.sequence.splits["images"]
    train, test = pictures_of(hand_made_run, "train"), pictures_of(hand_made_run, "test")
    assert train and test
    assert not set(train) & set(test)
    assert len(train) + len(test) == 4 * len(hand_made_run.frames)
    assert not {name for name, _ in train} & set(held["test_cameras"])
    assert not {frame for _, frame in train} & set(held["test_frames"])


def test_fit_lowers_the_error(hand_made_run) -> None:
    views = training_views(hand_made_run)
    losses: list[float] = []
    fitted = fit_shader(views, QUICK, losses.append)
    assert len(losses) == QUICK.steps
    grey = Shader(torch.zeros(64, 32), torch.zeros(64, 64), torch.zeros(3, 64))
    fitted_loss = sum(float(view.loss(fitted)) for view in views)
    assert fitted_loss < 0.3 * sum(float(view.loss(grey)) for view in views)


def test_same_seed_gives_the_same_shader(hand_made_run) -> None:
    views = training_views(hand_made_run)
    first, second, other = (
        fit_shader(views, ShaderConfig(1e-2, steps=10, seed=seed)) for seed in (3, 3, 4)
    )
    assert torch.equal(first.W1, second.W1) and torch.equal(first.W3, second.W3)
    assert not torch.equal(first.W3, other.W3)


@pytest.mark.parametrize("factor", [1e-6, 1e5])
def test_size_of_the_features_does_not_matter(hand_made_run, factor: float) -> None:
    views = training_views(hand_made_run)
    few = ShaderConfig(1e-2, steps=15, seed=3)
    expected = float(views[0].loss(fit_shader(views, few)))
    for cloud in hand_made_run.clouds.values():
        cloud.features *= factor
    scaled = training_views(hand_made_run)
    assert float(scaled[0].loss(fit_shader(scaled, few))) == pytest.approx(expected, rel=0.05)


def test_pictures_leave_gaussians_untouched(hand_made_run) -> None:
    before = {
        (frame, name): value.numpy().tobytes()
        for frame, cloud in hand_made_run.clouds.items()
        for name, value in cloud.items()
    }
    for cloud in hand_made_run.clouds.values():
        cloud.means.requires_grad_()
        cloud.features.requires_grad_()
    hand_made_run.attributes = lambda frame: {
        "features": np.zeros((len(hand_made_run.clouds[frame]), 32))
    }
    fit_run_shader(hand_made_run, QUICK)
    for (frame, name), content in before.items():
        value = getattr(hand_made_run.clouds[frame], name)
        assert value.grad is None
        assert value.detach().numpy().tobytes() == content
    assert [path.name for path in hand_made_run.path.iterdir()] == [SHADER_FILE]


def test_only_colours_change_in_the_files_of_a_run(hand_made_run) -> None:
    files = {f"gaussians/{frame:06d}.ply": cloud for frame, cloud in hand_made_run.clouds.items()}
    files["point_cloud.ply"] = hand_made_run.clouds[hand_made_run.frames[0]]
    power = {
        name: np.linspace(-70, -50, len(cloud), dtype=np.float32) for name, cloud in files.items()
    }
    for name, cloud in files.items():
        write_ply(hand_made_run.path / name, cloud_of(cloud, None, power[name]))
    shader = fit_run_shader(hand_made_run, QUICK)
    for name, cloud in files.items():
        expected = cloud_of(cloud, shader.colors(cloud.features).numpy(), power[name])
        write_ply(hand_made_run.path / "expected.ply", expected)
        content = (hand_made_run.path / name).read_bytes()
        assert content == (hand_made_run.path / "expected.ply").read_bytes()
    write_ply(hand_made_run.path / "point_cloud.ply", cloud_of(Gaussians.none()))
    with pytest.raises(RfgsFormatError, match="holds 0 Gaussians"):
        color_run_files(hand_made_run, shader)


def test_static_gaussians_come_before_the_moving_ones(hand_made_run, gaussians) -> None:
    moving = hand_made_run.clouds[1]
    attributes = hand_made_run.attributes(1)
    still = gaussians([[9.0, 9.0, 9.0]])
    hand_made_run.clouds[1] = Gaussians.join(still, moving)
    hand_made_run.attributes = lambda frame: attributes
    assert torch.equal(moving_gaussians(hand_made_run, 1).means, moving.means)
    (hand_made_run.path / STATIC_FILE).parent.mkdir(parents=True, exist_ok=True)
    power_db = np.array([-20.0], np.float32)
    write_ply(hand_made_run.path / STATIC_FILE, cloud_of(still, rf_power_db=power_db))
    joined = colored_cloud(hand_made_run, 1, None)
    np.testing.assert_allclose(joined.means[0], 9.0)
    np.testing.assert_array_equal(joined.rf_power_db, [-20.0, *attributes["rf_power_db"]])
    # Where it is not known of the static ones, the joined file does not claim it.
    write_ply(hand_made_run.path / STATIC_FILE, cloud_of(still))
    assert colored_cloud(hand_made_run, 1, None).rf_power_db is None


def test_unseen_pictures_get_better_and_test_pictures_do_not_count(hand_made_run) -> None:
    name, frame = pictures_of(hand_made_run, "test")[0]
    true = true_person(hand_made_run.sequence, camera_of(hand_made_run.sequence, name), frame)
    grey = np.square(render_person(hand_made_run, name, frame).rgb - true).mean()
    opened: list[tuple[str, int]] = []
    original = hand_made_run.sequence.image
    hand_made_run.sequence.image = lambda *which: (opened.append(which), original(*which))[1]
    fit_run_shader(hand_made_run, QUICK)
    assert opened == pictures_of(hand_made_run, "train")
    fitted = np.square(render_person(hand_made_run, name, frame).rgb - true).mean()
    assert fitted < 0.4 * grey


def test_view_stands_in_the_empty_room(hand_made_run) -> None:
    fit_run_shader(hand_made_run, QUICK)
    name, frame = pictures_of(hand_made_run, "test")[0]
    view = render_view(hand_made_run, name, frame)
    empty = hand_made_run.sequence.image_empty(name)[..., :3] / 255.0
    nothing = view.alpha == 0.0
    assert nothing.any() and not nothing.all()
    np.testing.assert_allclose(view.rgb[nothing], empty[nothing], atol=1e-6)
    assert view.rgb.shape == (24, 24, 3) and view.rgb.dtype == np.float32
    true_depth = hand_made_run.sequence.depth(name, frame)
    middle = (view.alpha > 0.95) & (hand_made_run.sequence.mask(name, frame) > 0)
    assert middle.sum() > 5
    # The mean depth of a shell of Gaussians lies a little behind its front.
    assert np.abs(view.depth[middle] - true_depth[middle]).max() < 0.2


def test_colours_reach_the_cloud(hand_made_run) -> None:
    grey = colored_cloud(hand_made_run, 1, fitted_shader(hand_made_run))
    assert np.all(grey.rgb == 0.5)
    fit_run_shader(hand_made_run, QUICK)
    shader = fitted_shader(hand_made_run)
    assert shader is not None
    cloud = colored_cloud(hand_made_run, 1, shader)
    expected = shader.colors(hand_made_run.clouds[1].features)
    np.testing.assert_allclose(cloud.rgb, expected, atol=1e-5)
    assert cloud.rf_power_db is not None
    # The ball is (200, 60, 40); Gaussians that no training camera sees may have any colour.
    assert cloud.rgb.mean(axis=0)[0] > cloud.rgb.mean(axis=0)[2]
