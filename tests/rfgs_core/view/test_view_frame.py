# SPDX-License-Identifier: Apache-2.0
"""What a frame holds: values of known Gaussians, distances to a sphere, thresholds."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from known_run import OUTSIDE_M, STATIC

from rfgs_core.arrays import save_arrays
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.render.side_by_side import WIDTH_PX
from rfgs_core.render.view import fitted_shader
from rfgs_core.run import Run
from rfgs_core.view.frame import Mesh, ShownFrame, distance_m, load_frame
from rfgs_core.view.frames import Frames, finished_frames, fitted_bones, where_people_are
from rfgs_core.view.pictures import rendered_and_true
from rfgs_core.view.radios import radio_shapes
from rfgs_core.view.room import cut_open, room_of
from rfgs_core.view.stage import level_lines


@pytest.fixture(scope="module")
def shown(known_run: Run) -> ShownFrame:
    return load_frame(known_run, 1, fitted_shader(known_run))


def test_values_stand_behind_unknown_ones_of_the_static_set(
    known_run: Run, shown: ShownFrame
) -> None:
    gaussians = known_run.gaussians(1)
    np.testing.assert_array_equal(shown.means, gaussians.means.numpy())
    np.testing.assert_allclose(shown.opacities, gaussians.opacities.numpy(), rtol=1e-6)
    round_one = np.broadcast_to(0.05**2 * np.eye(3), shown.covariances.shape)
    np.testing.assert_allclose(shown.covariances, round_one, atol=1e-8)
    shader = fitted_shader(known_run)
    assert shader is not None
    np.testing.assert_allclose(shown.rgb, shader.colors(gaussians.features).numpy(), atol=1e-6)
    for values in (shown.power_db, shown.phase_rad, shown.error_m):
        assert np.isnan(values[:STATIC]).all()
        assert np.isfinite(values[STATIC:]).all()
    assert shown.power_db[[STATIC, -1]].tolist() == [-90.0, -60.0]
    phase_rad = np.linspace(-np.pi, np.pi, len(shown) - STATIC, endpoint=False)
    # The first lies on the cut between −π and π.
    np.testing.assert_allclose(shown.phase_rad[STATIC + 1 :], phase_rad[1:], atol=1e-4)


def test_error_is_the_distance_to_the_true_surface(shown: ShownFrame) -> None:
    expected = np.resize(OUTSIDE_M, len(shown) - STATIC)
    too_far = shown.error_m[STATIC:] - expected
    # The nearest point of the mesh is a corner. Of n samples on the area A, none is within r
    # of it with probability exp(−n π r² / A): 1e-7 for 17 mm, less where half the disc is cut.
    assert too_far.min() > -1e-5
    assert too_far.max() < 0.017 and too_far.mean() < 0.004


def test_whatever_is_farther_than_a_metre_is_a_metre_away(shown: ShownFrame) -> None:
    assert shown.truth is not None
    top = shown.truth.vertices[shown.truth.vertices[:, 2].argmax()]
    above = top + np.array([[0.0, 0.0, 0.9], [0.0, 0.0, 1.1], [0.0, 0.0, 50.0]])
    np.testing.assert_allclose(distance_m(above, shown.truth), [0.9, 1.0, 1.0], atol=0.003)


def test_the_truth_moves_with_the_frame(known_run: Run, shown: ShownFrame) -> None:
    other = load_frame(known_run, 2, None)
    assert shown.truth is not None and other.truth is not None
    shift = other.truth.vertices.mean(axis=0) - shown.truth.vertices.mean(axis=0)
    np.testing.assert_allclose(shift, [0.2, 0.0, 0.0], atol=1e-5)
    np.testing.assert_array_equal(other.rgb, 0.5)


def test_without_truth_no_distance_is_claimed() -> None:
    assert np.isnan(distance_m(np.zeros((4, 3)), None)).all()


@pytest.mark.parametrize("least", [0.0, 0.3, 0.8, 0.95])
def test_the_opacity_threshold_hides_the_thinner_ones(shown: ShownFrame, least: float) -> None:
    expected = np.concatenate([np.full(STATIC, 0.9), np.linspace(0.1, 0.8, len(shown) - STATIC)])
    np.testing.assert_array_equal(shown.rows(least - 1e-6), expected >= least - 1e-6)


def test_the_power_threshold_keeps_what_it_cannot_judge(shown: ShownFrame) -> None:
    rows = shown.rows(0.0, -70.0)
    assert rows[:STATIC].all()
    np.testing.assert_array_equal(rows[STATIC:], shown.power_db[STATIC:] >= -70.0)


def test_an_unfinished_run_shows_its_finished_frames(known_run: Run, tmp_path: Path) -> None:
    (tmp_path / "gaussians").mkdir()
    run = replace(known_run, path=tmp_path)
    for name in ("gaussians/000002.ply", "gaussians/000002.features.npz", "radio_head.npz"):
        # As they are written; a viewer may look in between.
        with pytest.raises(RfgsError, match="no frame has been fitted yet"):
            finished_frames(run)
        shutil.copy(known_run.path / name, run.path / name)
    assert finished_frames(run) == [2]


def test_links_and_boresights_follow_the_layout(known_run: Run) -> None:
    sequence = known_run.sequence
    radio, elements = radio_shapes(sequence, "wifi"), sequence.layout("wifi")
    assert radio.names == [device.name for device in sequence.devices("wifi")]
    centre = sequence.bounds_m.mean(axis=0)
    # Devices in corners face the room.
    assert (np.einsum("ij,ij->i", radio.boresights, centre - radio.places) > 0.0).all()
    np.testing.assert_allclose(np.linalg.norm(radio.boresights, axis=1), 1.0)
    assert radio.links.shape == (12, 2, 3)
    np.testing.assert_allclose(radio.links[0, 0], elements.tx_xyz[0], atol=1e-12)
    mean = elements.rx_xyz[elements.rx_device == 1].mean(axis=0)
    np.testing.assert_allclose(radio.links[0, 1], mean)
    # One unordered pair is hidden from training.
    assert radio.held_out.sum() == 2
    first, second = radio.links[radio.held_out]
    np.testing.assert_allclose(first[:, :2], second[::-1, :2], atol=1e-9)


def test_a_box_is_cut_open_to_its_floor_and_twelve_edges(known_run: Run) -> None:
    room = room_of(known_run.sequence)
    assert room is not None
    corners = room.low.vertices[room.low.faces]
    assert len(corners) == 2 and (corners[..., 2] == 0.0).all()
    lengths = np.sort(np.linalg.norm(room.edges[:, 1] - room.edges[:, 0], axis=1))
    np.testing.assert_allclose(lengths, [2.5] * 4 + [3.0] * 8, rtol=1e-6)


def test_a_smooth_mesh_has_no_edges(shown: ShownFrame) -> None:
    assert shown.truth is not None
    assert len(cut_open(shown.truth).edges) == 0


def test_the_rendered_picture_stands_left_of_the_true_one(known_run: Run) -> None:
    seen = {
        row["name"]: rendered_and_true(known_run, row["name"], 1)
        for row in known_run.sequence.cameras
    }
    held = known_run.sequence.splits["images"]
    for name, beside in seen.items():
        unseen = name in held["test_cameras"] or 1 in held["test_frames"]
        assert beside.caption.endswith("never saw it" if unseen else "was fitted to it")
    picture = seen["cam00"].picture
    assert picture.shape[1] >= WIDTH_PX
    # The gap is white and the true half holds the ball, which is red.
    width = picture.shape[1]
    assert (picture[:, width // 2] > 240).all()
    true = picture[:, width // 2 + width // 26 :].astype(int)
    assert ((true[..., 0] > 150) & (true[..., 1] < 100)).any()


def test_level_lines_of_a_box_go_round_it_at_every_level() -> None:
    from trimesh.creation import box

    solid = box(extents=(0.4, 0.6, 1.0))
    mesh = Mesh(solid.vertices.astype(np.float32), solid.faces.astype(np.int32))
    lines = level_lines(mesh, spacing_m=0.25)
    assert lines[..., 2].min() == lines[..., 2].max() - 0.75, "four planes, none at an end"
    np.testing.assert_array_equal(lines[:, 0, 2], lines[:, 1, 2])
    length_m = np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1).sum()
    assert length_m == pytest.approx(4 * 2 * (0.4 + 0.6), rel=1e-5)
    assert len(level_lines(Mesh(mesh.vertices, mesh.faces[:0]))) == 0


def test_bones_go_from_each_parent_to_its_joint(tmp_path: Path) -> None:
    joints = np.random.default_rng(2).normal(size=(2, 1, 17, 3))
    arrays = {"frames": np.array([4, 9]), "time_s": np.zeros(2), "centroid": np.zeros((2, 1, 3))}
    assert fitted_bones(tmp_path) == {}
    save_arrays(tmp_path / "pose.npz", {**arrays, "joints": joints})
    bones = fitted_bones(tmp_path)
    assert list(bones) == [4, 9] and bones[4].shape == (16, 2, 3)
    # Pelvis to right hip is the first, thorax to right shoulder the fourteenth.
    np.testing.assert_allclose(bones[9][0], joints[1, 0, [0, 1]], rtol=1e-6)
    np.testing.assert_allclose(bones[9][13], joints[1, 0, [8, 14]], rtol=1e-6)
    save_arrays(tmp_path / "pose.npz", {**arrays, "joints": joints[:, :, :5]})
    with pytest.raises(RfgsFormatError, match="run `rfgs pose` again"):
        fitted_bones(tmp_path)


def test_a_page_looks_at_people_and_not_at_what_stands_still(known_run: Run) -> None:
    frames = Frames(known_run)
    low, high = where_people_are(frames.samples(), known_run.sequence.bounds_m)
    moving = np.concatenate([known_run.moving(frame).means.numpy() for frame in (1, 2)])
    np.testing.assert_allclose(low, np.percentile(moving, 5, axis=0), atol=1e-5)
    np.testing.assert_allclose(high, np.percentile(moving, 95, axis=0), atol=1e-5)
    still = replace(frames.read(1), static=len(frames.read(1)))
    bounds_m = known_run.sequence.bounds_m
    np.testing.assert_array_equal(where_people_are([still], bounds_m), bounds_m)
