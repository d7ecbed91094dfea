# SPDX-License-Identifier: Apache-2.0
"""Pictures of a trained run through the cameras of its dataset, and the shader's training views."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, NamedTuple, Protocol

import numpy as np
import torch
from jaxtyping import Bool, Float32, UInt8

from rfgs_core.dataset.sequence import Sequence
from rfgs_core.device import Device, on_device
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.gaussians.model import Gaussians
from rfgs_core.gaussians.ply import GaussianCloud, cloud_of, read_ply, write_ply
from rfgs_core.render.cameras import Camera
from rfgs_core.render.rasterizer import plan_splats, splat
from rfgs_core.render.shader import MID_GREY, Shader, ShaderConfig, TrainingView, fit_shader
from rfgs_core.render.splat import ALPHA_MIN

Split = Literal["train", "test"]

#: File of the fitted shader inside a run.
SHADER_FILE = "shader.npz"
#: Static Gaussians inside a run; the shader knows only what moves, so that they are grey.
STATIC_FILE = Path("gaussians", "static.ply")


class TrainedRun(Protocol):
    """What rendering needs of a run; `rfgs_core.run.Run` has it."""

    @property
    def path(self) -> Path:
        """Folder of the run."""
        ...

    @property
    def frames(self) -> list[int]:
        """Frames the run was trained on."""
        ...

    @property
    def sequence(self) -> Sequence:
        """The data."""
        ...

    def gaussians(self, frame: int) -> Gaussians:
        """Static Gaussians, then the moving ones of a frame."""
        ...

    def attributes(self, frame: int) -> Mapping[str, np.ndarray]:
        """Per-Gaussian arrays of the moving ones, `features` among them."""
        ...


class View(NamedTuple):
    """A rendered picture of a run."""

    rgb: Float32[np.ndarray, "H W 3"]
    """Colours, sRGB in [0, 1], background included."""
    alpha: Float32[np.ndarray, "H W"]
    """Share of each pixel that Gaussians cover."""
    depth: Float32[np.ndarray, "H W"]
    """Expected planar depth of the Gaussians [m], +inf where there is none."""


def camera_of(sequence: Sequence, name: str) -> Camera:
    """A camera of a sequence by name.

    Raises:
        RfgsError: There is no such camera.
    """
    for row in sequence.cameras:
        if row.get("name") == name:
            return Camera.from_dict(row)
    names = ", ".join(str(row.get("name")) for row in sequence.cameras)
    raise RfgsError(f"{sequence.path}: no camera {name!r}; it holds {names}")


def pictures_of(run: TrainedRun, split: Split) -> list[tuple[str, int]]:
    """Camera and frame of each picture of a split, in order.

    `train` is what the shader may see: training cameras at training frames. `test` is every other
    picture of the run's frames.
    """
    return split_pictures(run.sequence, run.frames, split)


def split_pictures(sequence: Sequence, frames: list[int], split: Split) -> list[tuple[str, int]]:
    """What `pictures_of` says of a run on these frames, also before there is one."""
    held_out = sequence.splits["images"]
    pictures = []
    for row in sequence.cameras:
        for frame in frames:
            unseen = row["name"] in held_out["test_cameras"] or frame in held_out["test_frames"]
            if unseen == (split == "test"):
                pictures.append((str(row["name"]), frame))
    return pictures


def fitted_shader(run: TrainedRun) -> Shader | None:
    """The run's shader, None while it is not fitted."""
    path = run.path / SHADER_FILE
    return Shader.load(path) if path.is_file() else None


def moving_gaussians(run: TrainedRun, frame: int) -> Gaussians:
    """The Gaussians of a frame without the static ones."""
    everything = run.gaussians(frame).detach()
    return everything.select(~static_rows(everything, run.attributes(frame)))


def static_rows(
    everything: Gaussians, attributes: Mapping[str, np.ndarray]
) -> Bool[torch.Tensor, "M"]:
    """Which of a frame's Gaussians stand still: those without attributes, which come first."""
    count = len(everything)
    return torch.arange(count) < count - len(attributes["features"])


def render_view(run: TrainedRun, camera: str | Camera, frame: int, device: Device = "cpu") -> View:
    """The run's Gaussians in the room.

    Where the dataset has a picture of the empty room, the moving Gaussians are drawn over it (the
    room's own Gaussians would paint it twice); otherwise all Gaussians over mid-grey.

    Args:
        run: A trained run; colours are grey until its shader is fitted.
        camera: A camera or the name of one of the dataset's.
        frame: Blender frame number.
        device: Where it is drawn.

    Returns:
        Picture, coverage and depth.
    """
    eye = camera if isinstance(camera, Camera) else camera_of(run.sequence, camera)
    file = run.sequence.files.image_empty(eye.name)
    if not file.is_file():
        everything = run.gaussians(frame).detach()
        still = static_rows(everything, run.attributes(frame))
        return _render(run, everything, eye, MID_GREY, device, still)
    empty = _colors(run.sequence.image_empty(eye.name), eye, file)
    return _render(run, moving_gaussians(run, frame), eye, torch.from_numpy(empty), device)


def render_person(
    run: TrainedRun, camera: str | Camera, frame: int, device: Device = "cpu"
) -> View:
    """The moving Gaussians alone on mid-grey; arguments and result as in `render_view`."""
    eye = camera if isinstance(camera, Camera) else camera_of(run.sequence, camera)
    return _render(run, moving_gaussians(run, frame), eye, MID_GREY, device)


def true_person(sequence: Sequence, camera: Camera, frame: int) -> Float32[np.ndarray, "H W 3"]:
    """What moves, cut out of the true picture with the mask, on mid-grey; sRGB in [0, 1]."""
    rgb = _colors(sequence.image(camera.name, frame), camera, sequence.files.root)
    mask = sequence.mask(camera.name, frame)
    return np.where(mask[..., None] > 0, rgb, np.float32(MID_GREY)).astype(np.float32)


def training_views(run: TrainedRun, device: Device = "cpu") -> list[TrainingView]:
    """The pictures the shader may see, with the frozen Gaussians in front of each camera."""
    moving = {frame: on_device(moving_gaussians(run, frame), device) for frame in run.frames}
    views = []
    for name, frame in pictures_of(run, "train"):
        camera = camera_of(run.sequence, name)
        plan = plan_splats(moving[frame], camera)
        mask = torch.from_numpy(run.sequence.mask(name, frame) > 0).to(device)
        views.append(
            TrainingView(
                plan=plan,
                features=moving[frame].features,
                target=torch.from_numpy(true_person(run.sequence, camera, frame)).to(device),
                region=mask | (plan.alpha >= ALPHA_MIN),
            )
        )
    return views


def fit_run_shader(run: TrainedRun, config: ShaderConfig, device: Device = "cpu") -> Shader:
    """Fits the shader to the run's training pictures and stores it in the run.

    Writes `shader.npz` and the colours in the run's PLY files; everything else in them keeps its
    bytes.
    """
    shader = on_device(fit_shader(training_views(run, device), config), "cpu")
    shader.save(run.path / SHADER_FILE)
    color_run_files(run, shader)
    return shader


def color_run_files(run: TrainedRun, shader: Shader | None) -> None:
    """Sets the colours of the run's PLY files, those that exist; grey without a shader.

    Raises:
        RfgsFormatError: A file holds another number of Gaussians than the run.
    """
    first = run.frames[0]
    everything = run.gaussians(first).detach()
    static = static_rows(everything, run.attributes(first))
    sets = {"point_cloud.ply": everything}
    for frame in run.frames:
        sets[f"gaussians/{frame:06d}.ply"] = moving_gaussians(run, frame)
    for name, gaussians in sets.items():
        path = run.path / name
        if not path.is_file():
            continue
        stored = read_ply(path, "delete what is damaged and run the same `rfgs train` again")
        if len(stored) != len(gaussians):
            raise RfgsFormatError(
                f"{path}: holds {len(stored)} Gaussians, the run {len(gaussians)}"
            )
        still = static if name == "point_cloud.ply" else None
        colored = cloud_of(gaussians, _shade(shader, gaussians, still).numpy())
        write_ply(path, replace(stored, f_dc=colored.f_dc))


def colored_cloud(run: TrainedRun, frame: int, shader: Shader | None) -> GaussianCloud:
    """Static and moving Gaussians of a frame with colours, ready for a PLY file.

    The reflected power is added where the run knows it for every Gaussian.
    """
    everything, attributes = run.gaussians(frame).detach(), run.attributes(frame)
    still = static_rows(everything, attributes)
    moving, static = everything.select(~still), cloud_of(everything.select(still))
    rgb = _shade(shader, moving).numpy()
    if len(static):
        static = replace(static, rf_power_db=read_ply(run.path / STATIC_FILE).rf_power_db)
    return GaussianCloud.join(static, cloud_of(moving, rgb, attributes.get("rf_power_db")))


def _render(
    run: TrainedRun,
    gaussians: Gaussians,
    camera: Camera,
    background: torch.Tensor | float,
    device: Device,
    still: Bool[torch.Tensor, "M"] | None = None,
) -> View:
    colours = _shade(fitted_shader(run), gaussians, still).to(device)
    drawn = on_device(splat(on_device(gaussians, device), colours, camera), "cpu")
    picture = drawn.over(background).clamp(0.0, 1.0)
    return View(picture.numpy(), drawn.alpha.numpy(), drawn.depth.numpy())


def _shade(
    shader: Shader | None, gaussians: Gaussians, still: Bool[torch.Tensor, "M"] | None = None
) -> torch.Tensor:
    """Colours; grey without a shader, and where Gaussians stand still."""
    if shader is None:
        return torch.full((len(gaussians), 3), MID_GREY)
    colors = shader.colors(gaussians.features.float())
    return colors if still is None else torch.where(still[:, None], MID_GREY, colors)


def _colors(picture: UInt8[np.ndarray, "H W 4"], camera: Camera, file: Any) -> np.ndarray:
    if picture.shape[:2] != (camera.height, camera.width):
        raise RfgsFormatError(
            f"{file}: picture of {picture.shape[1]}×{picture.shape[0]} px, camera {camera.name} "
            f"has {camera.width}×{camera.height}"
        )
    return picture[..., :3].astype(np.float32) / np.float32(255.0)
