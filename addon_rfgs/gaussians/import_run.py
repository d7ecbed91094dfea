# SPDX-License-Identifier: GPL-3.0-or-later
"""Gaussians into the open file, a .blend and a picture out."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import bpy
import numpy as np

from ..errors import AddonError
from ..export.groundtruth import can_denoise, keep_format, render_to
from ..files import replacing
from ..saving import save_copy
from ..scene.cameras import picture_size
from ..scene.frames import file_label
from ..scene.lights import lights_ready
from ..scene.state import Keeper, free_camera, kept, show_what_renders
from ..scene.survey import survey
from .clouds import Imported, Inspection, import_gaussians
from .compare import compare_with_mesh, keep_result
from .display import Display, set_display
from .opening import show_at_opening
from .viewpoint import cameras_of, choose_camera


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
    frame: int | None = None,
) -> str:
    """Imports, compares, saves and renders; returns one line about it.

    The file opens at, and the picture is of, `frame`, by default the one in the middle.

    Raises:
        AddonError: Nothing to import, nothing to write, an unknown camera, or a frame without
            Gaussians.
    """
    if blend is None and picture is None:
        raise AddonError("import: give --out FILE.blend, --picture FILE.png or both")
    if picture and picture.camera and picture.camera not in cameras_of(scene):
        raise AddonError(
            f"{file_label()}: no camera {picture.camera!r}; it has "
            f"{', '.join(sorted(cameras_of(scene))) or 'none'}"
        )
    if compare and wanted.coloring.mode == "ERROR":
        # Distances are known only after the import; until then any colours will do.
        wanted = replace(wanted, coloring=replace(wanted.coloring, mode="AUTO"))
    imported = import_gaussians(scene, path, wanted)
    if frame is not None and frame not in imported.frames:
        raise AddonError(
            f"--frame {frame}: expected a frame with Gaussians: "
            f"{', '.join(map(str, imported.frames)) or 'these have none'}"
        )
    done = [f"imported {imported.count} Gaussians in {len(imported.objects)} clouds"]
    if compare:
        found = compare_with_mesh(scene, imported.objects, wanted.display, every_frame=True)
        scene.rfgs.gaussians.color_by = "ERROR"  # acts at once
        keep_result(scene, found)
        done.append(found.sentence())
    if imported.frames:
        middle = imported.frames[len(imported.frames) // 2]
        scene.frame_set(middle if frame is None else frame)
    if picture is not None:
        camera = render_picture(scene, imported, wanted.display, picture)
        done.append(f"wrote {picture.path} (camera {camera}, frame {scene.frame_current})")
    if blend is not None:
        frame, moving = scene.frame_current, _moving_sources(scene)
        scene.frame_set(frame)
        show_at_opening(scene, imported, wanted.display, moving, picture and picture.camera)
        save_copy(blend)
        done.append(f"wrote {blend}")
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
        camera = choose_camera(scene, imported, display, picture.camera)
        scene.camera = camera
        _configure(keeper, scene, (width, height), picture.samples)
        halves = []
        with lights_ready(scene), replacing(picture.path) as temporary, _fine(imported, display):
            for hidden in (imported.objects, moving):
                with _invisible(hidden):
                    render_to(scene, temporary)
                halves.append(_read_pixels(temporary))
            _save_pixels(temporary, np.concatenate(halves, axis=1))
    name = camera.name
    if camera.name not in cameras_of(scene):
        bpy.data.cameras.remove(camera.data)
        name = "made for the picture"
    return name


@contextmanager
def _fine(imported: Imported, display: Display) -> Iterator[None]:
    """Shows Gaussians in fine shapes: those of the Solid view have eight faces each."""
    for item in imported.objects:
        set_display(item, replace(display, solid_view=False))
    yield
    for item in imported.objects:
        set_display(item, display)


def _moving_sources(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Objects the Gaussians stand in for; none where the scene has nothing that moves."""
    return [surface.source for surface in survey(scene)[0] if surface.moving]


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
    free_camera(keeper, scene)
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
            keeper.make_invisible(item)
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
