# SPDX-License-Identifier: GPL-3.0-or-later
"""Gaussians into the open file, a .blend and a picture out."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import bpy
import mathutils
import numpy as np

from ..errors import AddonError
from ..export.groundtruth import can_denoise, keep_format, render_to
from ..files import replacing
from ..saving import save_copy
from ..scene.cameras import look_at, picture_size
from ..scene.frames import file_label
from ..scene.lights import lights_ready
from ..scene.state import Keeper, kept, show_what_renders
from ..scene.survey import survey
from .attributes import positions
from .clouds import Imported, Inspection, import_gaussians
from .compare import compare_with_mesh
from .display import Display, shown

#: Gaussians that vote for the picture's camera.
_VOTERS = 200
#: Marks a camera that is not the scene's own.
_MADE = "rfgs_made"
#: Kinds of rays that may see an object.
_RAYS = ("camera", "diffuse", "glossy", "transmission", "volume_scatter", "shadow")


@dataclass(frozen=True)
class Picture:
    """The picture of an import."""

    path: Path
    """PNG to write."""
    camera: str | None = None
    """Name of a camera object; None chooses one."""
    resolution: int = 480
    """Longer side of each half [px]."""
    samples: int = 16
    """Samples per pixel."""


def import_run(
    scene: bpy.types.Scene,
    path: Path,
    wanted: Inspection,
    blend: Path | None = None,
    picture: Picture | None = None,
    compare: bool = False,
) -> str:
    """Imports, compares, saves and renders; returns one line about it.

    Raises:
        AddonError: Nothing to import, nothing to write, or an unknown camera.
    """
    if blend is None and picture is None:
        raise AddonError("import: give --out FILE.blend, --picture FILE.png or both")
    if picture and picture.camera and picture.camera not in _cameras(scene):
        raise AddonError(
            f"{file_label()}: no camera {picture.camera!r}; it has "
            f"{', '.join(sorted(_cameras(scene))) or 'none'}"
        )
    imported = import_gaussians(scene, path, wanted)
    done = [f"imported {imported.count} Gaussians in {len(imported.objects)} clouds"]
    if compare:
        found = compare_with_mesh(scene, imported.objects, wanted.display, every_frame=True)
        scene.rfgs.gaussians.color_by = "ERROR"  # acts at once
        done.append(found.sentence())
    if imported.frames:
        scene.frame_set(imported.frames[len(imported.frames) // 2])
    if blend is not None:
        save_copy(blend)
        done.append(f"wrote {blend}")
    if picture is not None:
        camera = render_picture(scene, imported, wanted.display, picture)
        done.append(f"wrote {picture.path} (camera {camera}, frame {scene.frame_current})")
    return "; ".join(done)


def render_picture(
    scene: bpy.types.Scene, imported: Imported, display: Display, picture: Picture
) -> str:
    """Renders the scene and, beside it, the same room with Gaussians for what moves.

    Returns:
        Name of the camera.
    """
    width, height = picture_size(scene, picture.resolution)
    with kept(scene) as keeper:
        show_what_renders(keeper, scene)
        keep_format(keeper, scene)
        frame = scene.frame_current
        moving = _moving_sources(scene)
        scene.frame_set(frame)
        camera = _choose_camera(scene, imported, display, picture.camera)
        scene.camera = camera
        _configure(keeper, scene, (width, height), picture.samples)
        halves = []
        with lights_ready(scene), replacing(picture.path) as temporary:
            for hidden in (imported.objects, moving):
                with _invisible(hidden):
                    render_to(scene, temporary)
                halves.append(_read_pixels(temporary))
            _save_pixels(temporary, np.concatenate(halves, axis=1))
    name = camera.name
    if camera.name not in _cameras(scene):
        bpy.data.cameras.remove(camera.data)
        name = "made for the picture"
    return name


def _cameras(scene: bpy.types.Scene) -> dict[str, bpy.types.Object]:
    return {
        item.name: item
        for item in scene.objects
        if item.type == "CAMERA" and item.data.type == "PERSP" and not item.get(_MADE)
    }


def _moving_sources(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Objects the Gaussians stand in for; none where the scene has nothing that moves."""
    return [surface.source for surface in survey(scene)[0] if surface.moving]


def _choose_camera(
    scene: bpy.types.Scene, imported: Imported, display: Display, wanted: str | None
) -> bpy.types.Object:
    """The wanted camera, else the one that sees most of the visible cloud, and sees it large."""
    cameras = _cameras(scene)
    if wanted:
        return cameras[wanted]
    points = _shown_points(imported, display)
    scores = {name: _score(scene, item, points) for name, item in cameras.items()}
    best = max(sorted(scores), key=lambda name: scores[name], default=None)
    if best is not None and scores[best] > 0:
        return cameras[best]
    low, high = points.min(axis=0), points.max(axis=0)
    centre, reach = 0.5 * (low + high), max(float(np.linalg.norm(high - low)), 0.5)
    camera = bpy.data.objects.new("RFGS picture", bpy.data.cameras.new("RFGS picture"))
    camera[_MADE] = True
    camera.data.angle = np.radians(60)
    place = centre + 1.6 * reach * np.array([0.6, -0.74, 0.3])
    camera.matrix_world = mathutils.Matrix(look_at(place, centre).tolist())
    scene.collection.objects.link(camera)
    return camera


def _shown_points(imported: Imported, display: Display) -> np.ndarray:
    """World positions [M, 3] of some Gaussians of the current frame, what moves before what not."""
    moving = [item for item in imported.objects if item.animation_data]
    for items in ([item for item in moving if not item.hide_viewport], imported.objects):
        found = [np.zeros((0, 3))]
        for item in items:
            visible = positions(item.data)[shown(item, display)]
            found.append(visible * np.array(item.scale))
        points = np.concatenate(found)
        if len(points):
            return points[:: max(1, len(points) // _VOTERS)]
    raise AddonError(
        "no Gaussian is left by opacity threshold "
        f"{display.opacity_threshold}, power threshold and crop box; lower them"
    )


def _score(scene: bpy.types.Scene, camera: bpy.types.Object, points: np.ndarray) -> float:
    """Share of points in view and in sight, times the square root of the area they cover."""
    graph = bpy.context.evaluated_depsgraph_get()
    matrix = np.array(camera.matrix_world, dtype=np.float64)
    size = (scene.render.resolution_x, scene.render.resolution_y)
    lens = np.array(camera.calc_matrix_camera(graph, x=size[0], y=size[1]), dtype=np.float64)
    local = np.linalg.inv(matrix) @ np.concatenate([points, np.ones((len(points), 1))], 1).T
    clip = lens @ local
    plane = clip[:2] / np.where(clip[3] > 1e-6, clip[3], np.inf)
    inside = (clip[3] > 1e-6) & (np.abs(plane) < 0.95).all(axis=0)
    if not inside.any():
        return 0.0
    seen = 0
    eye = mathutils.Vector(matrix[:3, 3])
    for point in points[inside]:
        line = mathutils.Vector(point) - eye
        start = eye + line.normalized() * 0.05
        # Half a unit is left free, so that the person does not hide its own Gaussians.
        hit = scene.ray_cast(graph, start, line.normalized(), distance=max(line.length - 0.5, 0.01))
        seen += not hit[0]
    area = float(np.prod(np.ptp(plane[:, inside], axis=1) / 2))
    return seen / len(points) * np.sqrt(min(area, 0.5))


def _configure(keeper: Keeper, scene: bpy.types.Scene, size: tuple[int, int], samples: int) -> None:
    for name, value in {
        "engine": "CYCLES",
        "resolution_x": size[0],
        "resolution_y": size[1],
        "resolution_percentage": 100,
        "use_compositing": False,
        "use_sequencer": False,
        "use_file_extension": False,
        "film_transparent": False,
    }.items():
        keeper.set(scene.render, name, value)
    keeper.set(scene.cycles, "device", "CPU")
    keeper.set(scene.cycles, "samples", samples)
    keeper.set(scene.cycles, "use_adaptive_sampling", False)
    keeper.set(scene.cycles, "use_denoising", can_denoise())


@contextmanager
def _invisible(items: list[bpy.types.Object]) -> Iterator[None]:
    """Hides objects from every ray; their visibility itself may be keyed."""
    keeper = Keeper()
    try:
        for item in items:
            for kind in _RAYS:
                keeper.set(item, f"visible_{kind}", False)
        yield
    finally:
        keeper.restore()


def _read_pixels(path: Path) -> np.ndarray:
    """Stored values [height, width, 4] of a PNG, bottom row first."""
    image = bpy.data.images.load(str(path.resolve()))
    try:
        flat = np.zeros(4 * image.size[0] * image.size[1], np.float32)
        image.pixels.foreach_get(flat)
        return flat.reshape(image.size[1], image.size[0], 4)
    finally:
        bpy.data.images.remove(image)


def _save_pixels(path: Path, pixels: np.ndarray) -> None:
    image = bpy.data.images.new("RFGS picture", pixels.shape[1], pixels.shape[0], alpha=True)
    try:
        image.pixels.foreach_set(np.ascontiguousarray(pixels, np.float32).ravel())
        image.filepath_raw, image.file_format = str(path.resolve()), "PNG"
        image.save()
    finally:
        bpy.data.images.remove(image)
