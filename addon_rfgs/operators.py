# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel's buttons; each does what the command of the same name does."""

from collections.abc import Callable
from pathlib import Path

import bpy

from .bundle import export_bundle
from .errors import AddonError
from .gaussian_nodes import GROUP, set_display
from .gaussians import COLLECTION, Display, import_gaussians
from .groundtruth import render_groundtruth


def _path(text: str) -> Path:
    if not text:
        raise AddonError("no path is set")
    if text.startswith("//") and not bpy.data.filepath:
        raise AddonError("the scene was never saved; save it first")
    return Path(bpy.path.abspath(text))


class _Reporting:
    """Turns user errors into reports of the operator."""

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Runs `work` and reports its one line."""
        manager = context.window_manager
        manager.progress_begin(0, 1)
        try:
            self.report({"INFO"}, self.work(context, self._progress(manager)))
        except AddonError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        finally:
            manager.progress_end()
        return {"FINISHED"}

    @staticmethod
    def _progress(manager: bpy.types.WindowManager) -> Callable[[int, int], None]:
        return lambda done, total: manager.progress_update(done / total)


class RFGS_OT_export_bundle(_Reporting, bpy.types.Operator):
    """Write the scene as a bundle for the dataset factory."""

    bl_idname = "rfgs.export_bundle"
    bl_label = "Export Bundle"

    def work(self, context: bpy.types.Context, progress: Callable[[int, int], None]) -> str:
        """Exports with the panel's settings."""
        settings = context.scene.rfgs
        folder = _path(settings.bundle_folder)
        info = export_bundle(
            context.scene,
            folder,
            settings.frames or None,
            settings.cameras or None,
            settings.resolution or None,
            progress,
        )
        return f"Wrote {len(info['frames'])} frames to {folder}"


class RFGS_OT_render_groundtruth(_Reporting, bpy.types.Operator):
    """Render pictures, and passes if wanted, from every camera with Cycles."""

    bl_idname = "rfgs.render_groundtruth"
    bl_label = "Render Ground Truth"

    def work(self, context: bpy.types.Context, progress: Callable[[int, int], None]) -> str:
        """Renders with the panel's settings."""
        settings = context.scene.rfgs
        folder = _path(settings.pictures_folder)
        count = render_groundtruth(
            context.scene,
            folder,
            settings.frames or None,
            settings.cameras or None,
            settings.resolution or None,
            settings.samples,
            settings.passes,
            progress=progress,
        )
        return f"Wrote {count} pictures to {folder}"


class RFGS_OT_import_gaussians(_Reporting, bpy.types.Operator):
    """Bring the Gaussians of a run, or of one PLY, into the scene."""

    bl_idname = "rfgs.import_gaussians"
    bl_label = "Import Gaussians"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    def work(self, context: bpy.types.Context, _progress: Callable[[int, int], None]) -> str:
        """Imports with the panel's settings."""
        settings = context.scene.rfgs
        display = Display(settings.display_mode, settings.opacity_threshold)
        done = import_gaussians(context.scene, _path(settings.gaussians_path), display)
        return f"Imported {done.count} Gaussians in {len(done.objects)} clouds"


class RFGS_OT_update_display(_Reporting, bpy.types.Operator):
    """Apply mode and opacity threshold to Gaussians that are already here."""

    bl_idname = "rfgs.update_display"
    bl_label = "Update Display"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    def work(self, context: bpy.types.Context, _progress: Callable[[int, int], None]) -> str:
        """Writes the panel's settings into every modifier."""
        collection = bpy.data.collections.get(COLLECTION)
        items = (
            [item for item in collection.objects if GROUP in item.modifiers] if collection else []
        )
        if not items:
            raise AddonError("no imported Gaussians in this file")
        settings = context.scene.rfgs
        for item in items:
            set_display(item, settings.display_mode, settings.opacity_threshold)
        return f"Updated {len(items)} clouds"


OPERATORS = (
    RFGS_OT_export_bundle,
    RFGS_OT_render_groundtruth,
    RFGS_OT_import_gaussians,
    RFGS_OT_update_display,
)


def register() -> None:
    """Adds the operators."""
    for cls in OPERATORS:
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Removes the operators."""
    for cls in reversed(OPERATORS):
        bpy.utils.unregister_class(cls)
