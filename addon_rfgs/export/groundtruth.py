# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures, depth, normals and instance ids of a scene, rendered with Cycles.

Colour is rendered with as many samples as asked for. Depth, normals and ids come from a second
render of one sample through each pixel's centre, because averages over a silhouette are neither.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import bpy
import numpy as np

from ..errors import AddonError
from ..files import replacing
from ..ownership import is_shown_by_us
from ..scene.cameras import View, find_views, place_camera
from ..scene.content import Content, content_ready
from ..scene.findings import refuse
from ..scene.frames import file_label, unit_scale
from ..scene.lights import lights_ready
from ..scene.outlines import give_to_renders
from ..scene.overrides import Overrides
from ..scene.state import Keeper, free_camera
from .exr import read_exr, write_exr

#: Depths above this are misses; Cycles writes 1e10 [Blender units].
_MISS = 1e9


def render_groundtruth(
    scene: bpy.types.Scene,
    folder: Path,
    frames: str | None = None,
    cameras: int | None = None,
    resolution: int | None = None,
    samples: int = 16,
    passes: bool = False,
    empty: bool = False,
    progress: Callable[[int, int], None] | None = None,
    overrides: Overrides | None = None,
) -> int:
    """Writes `cam00/000001.png` and so on; with `passes` also `.exr`.

    The EXR holds `ViewLayer.Depth.Z` (planar depth [m], infinite where nothing is hit),
    `ViewLayer.Normal.X/Y/Z` (world) and `ViewLayer.IndexOB.X` (instance id).

    Args:
        scene: Scene of the open file.
        folder: Where to.
        frames: `A:B[:STEP]`, None for the scene's range.
        cameras: The first so many cameras by name, None for all.
        resolution: Longer side [px], None for the scene's.
        samples: Samples per pixel of the colour picture.
        passes: Whether to write depth, normals and ids.
        empty: Instead, render each camera once without anything that moves, as `empty.png`.
        progress: Called with (pictures done, pictures in all).
        overrides: What the user says about the scene beside the file.

    Returns:
        Number of pictures.

    Raises:
        AddonError: The scene cannot be rendered as asked; the message says why.
    """
    if samples < 1:
        raise AddonError(f"samples: expected at least 1, got {samples}")
    with content_ready(scene, frames, overrides or Overrides()) as content:
        refuse(file_label(), content.findings)
        keeper, numbers = content.keeper, content.frames
        with lights_ready(scene, content.space is not None and content.space.walled):
            views = find_views(scene, cameras, resolution, content.ring)[0]
            _number_instances(keeper, content)
            give_to_renders(keeper, (surface.source for surface in content.moving))
            _configure(keeper, scene, views[0])
            for item in scene.objects:
                if item.rfgs.object_class == "IGNORE" and is_shown_by_us(item):
                    keeper.make_invisible(item)
            if empty:
                for surface in content.moving:
                    keeper.make_invisible(surface.source)
                numbers = [scene.frame_start]
            names = ["empty"] if empty else [f"{number:06d}" for number in numbers]
            stems = dict(zip(numbers, names, strict=True))
            draw = partial(_render, scene, samples=samples, passes=passes and not empty)
            return _render_all(scene, views, stems, folder, draw, progress)


def _render_all(
    scene: bpy.types.Scene,
    views: list[View],
    stems: dict[int, str],
    folder: Path,
    draw: Callable[[Path], None],
    progress: Callable[[int, int], None] | None,
) -> int:
    """Calls `draw` for each frame of `stems` and each view; returns the number of pictures."""
    total, done = len(stems) * len(views), 0
    stands = [place_camera(scene, view) for view in views]
    try:
        for number, name in stems.items():
            scene.frame_set(number)
            for view, stand in zip(views, stands, strict=True):
                scene.camera = stand
                draw(folder / view.name / name)
                done += 1
                if progress:
                    progress(done, total)
    finally:
        for stand in stands:
            bpy.data.cameras.remove(stand.data)
    return total


def _number_instances(keeper: Keeper, content: Content) -> None:
    for item in bpy.data.objects:
        keeper.set(item, "pass_index", 0)
    for instance in content.instances:
        for surface in instance.surfaces:
            keeper.set(surface.source, "pass_index", instance.id)


def _configure(keeper: Keeper, scene: bpy.types.Scene, view: View) -> None:
    """Settings shared by both renders; the view transform stays the file's own."""
    render = scene.render
    for name, value in {
        "engine": "CYCLES",
        "resolution_x": int(view.intrinsics["width"]),
        "resolution_y": int(view.intrinsics["height"]),
        "resolution_percentage": 100,
        "pixel_aspect_x": 1.0,
        "pixel_aspect_y": 1.0,
        "film_transparent": True,
        "use_motion_blur": False,
        "use_border": False,
        "use_compositing": False,
        "use_sequencer": False,
        "use_multiview": False,
        "dither_intensity": 0.0,
        "use_file_extension": False,
        "use_overwrite": True,
        "use_placeholder": False,
    }.items():
        keeper.set(render, name, value)
    for name in dir(render):
        if name.startswith("use_stamp"):
            keeper.set(render, name, False)
    keep_format(keeper, scene)
    free_camera(keeper, scene)
    layer = bpy.context.view_layer
    for other in scene.view_layers:
        keeper.set(other, "use", other == layer)
    for name in ("use_pass_z", "use_pass_normal", "use_pass_object_index", "use_pass_combined"):
        keeper.set(layer, name, True)
    keeper.set(layer, "material_override", None)
    keeper.set(layer, "samples", 0)
    keeper.set(scene.cycles, "device", "CPU")
    keeper.set(scene.cycles, "seed", 0)
    keeper.set(scene.cycles, "use_animated_seed", False)
    keeper.set(scene.cycles, "use_adaptive_sampling", False)


def keep_format(keeper: Keeper, scene: bpy.types.Scene) -> None:
    """Notes output path and format; the medium is noted last because it comes back first."""
    keeper.remember(scene.render, "filepath")
    settings = scene.render.image_settings
    for name in ("compression", "exr_codec", "color_depth", "color_mode", "file_format"):
        keeper.remember(settings, name)
    if hasattr(settings, "media_type"):
        keeper.remember(settings, "media_type")


def set_format(scene: bpy.types.Scene, file_format: str) -> None:
    """Chooses PNG (8-bit RGBA) or OPEN_EXR_MULTILAYER (32-bit float)."""
    settings, picture = scene.render.image_settings, file_format == "PNG"
    if hasattr(settings, "media_type"):  # Blender 5 sorts formats by medium.
        settings.media_type = "IMAGE" if picture else "MULTI_LAYER_IMAGE"
    settings.file_format = file_format
    settings.color_depth = "8" if picture else "32"
    if picture:
        settings.color_mode = "RGBA"
        settings.compression = 15
    else:
        settings.exr_codec = "ZIP"


def can_denoise() -> bool:
    """Whether this Blender was built with Open Image Denoise."""
    try:
        import _cycles
    except ImportError:
        return False
    return bool(getattr(_cycles, "with_openimagedenoise", False))


def noise_note() -> str:
    """What to say of pictures that nothing denoises; empty where something does."""
    if can_denoise():
        return ""
    return "this Blender has no denoiser, so pictures are noisy; more samples make them less so"


def _render(scene: bpy.types.Scene, stem: Path, samples: int, passes: bool) -> None:
    with kept_sampling() as keeper:
        keeper.set(scene.cycles, "samples", samples)
        keeper.set(scene.cycles, "use_denoising", can_denoise())
        render_to(scene, stem.with_name(stem.name + ".png"))
    if passes:
        with kept_sampling() as keeper:
            keeper.set(scene.cycles, "samples", 1)
            keeper.set(scene.cycles, "use_denoising", False)
            keeper.set(scene.cycles, "pixel_filter_type", "BOX")
            keeper.set(scene.cycles, "filter_width", 0.01)
            keeper.set(scene.cycles, "max_bounces", 0)
            set_format(scene, "OPEN_EXR_MULTILAYER")
            path = stem.with_name(stem.name + ".exr")
            with replacing(path) as temporary:
                _write_still(scene, temporary)
                channels = _fixed_channels(read_exr(temporary), unit_scale(scene))
                write_exr(temporary, channels)


@contextmanager
def kept_sampling() -> Iterator[Keeper]:
    """Yields a keeper for one render's settings."""
    keeper = Keeper()
    try:
        yield keeper
    finally:
        keeper.restore()


def render_to(scene: bpy.types.Scene, path: Path) -> None:
    """Renders the scene's camera to a PNG."""
    set_format(scene, "PNG")
    with replacing(path) as temporary:
        _write_still(scene, temporary)
        strip_metadata(temporary)


def _write_still(scene: bpy.types.Scene, path: Path) -> None:
    scene.render.filepath = str(path.resolve())
    bpy.ops.render.render(write_still=True, scene=scene.name)
    if not path.exists():
        raise AddonError(f"{path}: Blender could not write the picture; is the disk full?")


def _fixed_channels(found: dict[str, np.ndarray], unit: float) -> dict[str, np.ndarray]:
    """Channels under the same names in every version of Blender, depth in metres."""
    short = {".".join(name.split(".")[-2:]): values for name, values in found.items()}
    depth = next(short[name] for name in ("Depth.Z", "Depth.V", "Z.V") if name in short)
    index = next(short[name] for name in ("IndexOB.X", "Object Index.X") if name in short)
    out = {f"ViewLayer.Normal.{axis}": short[f"Normal.{axis}"] for axis in "XYZ"}
    out["ViewLayer.Depth.Z"] = np.where(depth > _MISS, np.inf, depth * unit)
    out["ViewLayer.IndexOB.X"] = np.where(depth > _MISS, 0, index)
    return out


_SIGNATURE = b"\x89PNG\r\n\x1a\n"


def strip_metadata(path: Path) -> None:
    """Keeps only the chunks that hold the picture, so equal pictures are equal bytes.

    Chunks are critical if their name starts with a capital (PNG specification, 5.4).

    Raises:
        AddonError: The file is not a whole PNG.
    """
    data = path.read_bytes()
    kept, at, name = [_SIGNATURE], len(_SIGNATURE), b""
    while data.startswith(_SIGNATURE) and at + 12 <= len(data):
        size, name = struct.unpack_from(">I4s", data, at)
        if name[:1].isupper():
            kept.append(data[at : at + size + 12])
        at += size + 12
    if name != b"IEND":
        raise AddonError(f"{path}: expected a whole PNG; is the disk full?")
    path.write_bytes(b"".join(kept))
