# SPDX-License-Identifier: GPL-3.0-or-later
"""A contact sheet of all scenes: one picture each, halfway through, with its name."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

import bpy
from PIL import Image, ImageDraw
from tqdm import tqdm

import addon_rfgs
from blender_scenes.catalogue import Scene

_COLUMNS, _CAPTION_PX = 4, 22


def contact_sheet(scenes: Sequence[Scene], out: Path, size_px: int, samples: int) -> None:
    """Renders the middle frame of each scene through its first camera.

    Args:
        scenes: Which scenes, in order.
        out: The picture to write, JPEG or PNG by its suffix.
        size_px: Width and height of each scene's picture.
        samples: Samples per pixel.
    """
    rows = -(-len(scenes) // _COLUMNS)
    cell = (size_px, size_px + _CAPTION_PX)
    sheet = Image.new("RGB", (_COLUMNS * cell[0], rows * cell[1]), "white")
    pen = ImageDraw.Draw(sheet)
    addon_rfgs.register()
    try:
        with tempfile.TemporaryDirectory() as folder:
            for index, scene in enumerate(tqdm(scenes, desc="rendering", unit="scene")):
                picture = _render(scene, Path(folder) / "scene.png", size_px, samples)
                x, y = (index % _COLUMNS) * cell[0], (index // _COLUMNS) * cell[1]
                sheet.paste(picture, (x, y))
                pen.text((x + 6, y + size_px + 5), scene.name, fill="black")
    finally:
        addon_rfgs.unregister()
    sheet.save(out, quality=88)


def _render(scene: Scene, file: Path, size_px: int, samples: int) -> Image.Image:
    bpy.ops.wm.open_mainfile(filepath=str(scene.path), use_scripts=False)
    stage = bpy.context.scene
    stage.render.resolution_x = stage.render.resolution_y = size_px
    stage.cycles.samples = samples
    stage.render.filepath = str(file)
    stage.frame_set((scene.frame_start + scene.frame_end) // 2)
    bpy.ops.render.render(write_still=True)
    with Image.open(file) as picture:
        return picture.convert("RGB")
