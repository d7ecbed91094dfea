# SPDX-License-Identifier: Apache-2.0
"""What `rfgs render` and `rfgs export` write for an opened run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from plyfile import PlyData

from rfgs_core.cli import render as render_command
from rfgs_core.cli.export import ExportArgs, export_run
from rfgs_core.cli.render import RenderArgs, render_run, render_video
from rfgs_core.dataset.pictures import read_png_rgba
from rfgs_core.errors import RfgsError
from rfgs_core.render.shader import ShaderConfig
from rfgs_core.render.view import fit_run_shader, pictures_of

QUICK = ShaderConfig(learning_rate=1e-2, steps=20, seed=0)


def written(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*.*")}


def test_render_writes_each_picture_alone_and_beside_the_true_one(hand_made_run, tmp_path) -> None:
    fit_run_shader(hand_made_run, QUICK)
    out = tmp_path / "pictures"
    render_run(hand_made_run, RenderArgs(hand_made_run.path, out))
    expected = set()
    for name, frame in pictures_of(hand_made_run, "test"):
        expected |= {f"{name}/{frame:06d}.png", f"{name}/{frame:06d}_beside_true.png"}
    assert written(out) == expected
    name, frame = pictures_of(hand_made_run, "test")[0]
    alone = read_png_rgba(out / name / f"{frame:06d}.png")
    pair = read_png_rgba(out / name / f"{frame:06d}_beside_true.png")
    true = hand_made_run.sequence.image(name, frame)
    np.testing.assert_array_equal(pair[:, :24], alone)
    np.testing.assert_array_equal(pair[:, -24:], true)
    # The rendered ball stands where the true one does, with a soft border.
    empty = hand_made_run.sequence.image_empty(name)
    moved = np.abs(alone.astype(int) - empty).max(axis=-1) > 8
    mask = hand_made_run.sequence.mask(name, frame) > 0
    assert (moved & mask).sum() > 0.8 * mask.sum()
    middle, true_middle = (np.argwhere(pixels).mean(axis=0) for pixels in (moved, mask))
    np.testing.assert_allclose(middle, true_middle, atol=1.0)


def test_person_only_stands_on_mid_grey(hand_made_run, tmp_path, caplog) -> None:
    args = RenderArgs(hand_made_run.path, tmp_path / "p", "train", frames=("1",), person_only=True)
    render_run(hand_made_run, args)
    assert "no shader has been fitted" in caplog.text
    pictures = [row for row in pictures_of(hand_made_run, "train") if row[1] == 1]
    assert len(written(args.out)) == 2 * len(pictures)
    pair = read_png_rgba(args.out / pictures[0][0] / "000001_beside_true.png")
    assert (pair[:, :24, :3] == 128).all()
    mask = hand_made_run.sequence.mask(*pictures[0]) > 0
    assert (pair[:, -24:, :3][~mask] == 128).all()
    assert (pair[:, -24:, 0][mask] == 200).all()


def test_frames_that_are_not_there_are_named(hand_made_run, tmp_path: Path) -> None:
    with pytest.raises(RfgsError, match=r"'7': none of these is there; there are \[1, 2\]"):
        render_run(hand_made_run, RenderArgs(hand_made_run.path, tmp_path, frames=("1:2", "7")))
    with pytest.raises(RfgsError, match=r"no frame 7; the run has 1, 2$"):
        export_run(hand_made_run, ExportArgs(hand_made_run.path, tmp_path / "a.ply", frame=7))
    with pytest.raises(RfgsError, match=r"ending in \.ply"):
        export_run(hand_made_run, ExportArgs(hand_made_run.path, tmp_path / "a.obj"))


def test_export_reads_back_under_3dgs_conventions(hand_made_run, tmp_path, capsys) -> None:
    shader = fit_run_shader(hand_made_run, QUICK)
    export_run(hand_made_run, ExportArgs(hand_made_run.path, tmp_path / "two.ply", frame=2))
    cloud = hand_made_run.clouds[2]
    vertex = PlyData.read(str(tmp_path / "two.ply"))["vertex"]
    np.testing.assert_array_equal(np.stack([vertex[k] for k in "xyz"], 1), cloud.means.numpy())
    shown = np.stack([0.5 + 0.28209479177 * vertex[f"f_dc_{i}"] for i in range(3)], 1)
    np.testing.assert_allclose(shown, shader.colors(cloud.features), atol=1e-5)
    np.testing.assert_allclose(1 / (1 + np.exp(-vertex["opacity"])), 0.8, rtol=1e-5)
    np.testing.assert_allclose(np.exp(vertex["scale_2"]), 0.06, rtol=1e-5)
    assert vertex["rf_power_db"][0] == -90.0
    assert f"{len(cloud)} Gaussians of frame 2" in capsys.readouterr().out


def test_a_video_plays_rendered_beside_true_in_the_runs_own_time(hand_made_run, tmp_path) -> None:
    fit_run_shader(hand_made_run, QUICK)
    file, name = tmp_path / "run.webp", str(hand_made_run.sequence.cameras[1]["name"])
    render_video(hand_made_run, RenderArgs(hand_made_run.path, video=file, camera=name), file)
    times_s = [hand_made_run.sequence.time_s(frame) for frame in hand_made_run.frames]
    with Image.open(file) as video:
        assert video.n_frames == len(hand_made_run.frames)
        for place, frame in enumerate(hand_made_run.frames):
            video.seek(place)
            video.load()
            assert video.info["duration"] == round(1e3 * (times_s[1] - times_s[0]))
            true = hand_made_run.sequence.image(name, frame)[..., :3].astype(int)
            factor = video.height // true.shape[0]
            half = np.asarray(video.convert("RGB")).astype(int)[:, -true.shape[1] * factor :]
            small = half.reshape(*true.shape[:1], factor, true.shape[1], factor, 3).mean((1, 3))
            assert np.abs(small - true).mean() < 8


def test_a_render_without_anything_to_write_says_what_to_give(tmp_path) -> None:
    with pytest.raises(RfgsError, match="give --out FOLDER for pictures, --video FILE, or both"):
        render_command.run(RenderArgs(tmp_path))
    with pytest.raises(RfgsError, match="--camera: chooses the camera of a --video"):
        render_command.run(RenderArgs(tmp_path, tmp_path, camera="cam00"))
