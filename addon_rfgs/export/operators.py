# SPDX-License-Identifier: GPL-3.0-or-later
"""Buttons that write bundles and ground truth."""

import bpy

from ..command import Command
from ..errors import AddonError
from ..reporting import Progress, Reporting, chosen_path, note
from ..scene_choice import chosen_overrides
from .bundle import export_bundle
from .groundtruth import noise_note, render_groundtruth

_BOTH = ("frames", "overrides", "cameras", "resolution")


class RFGS_OT_export_bundle(Reporting, bpy.types.Operator):
    """Write the scene as a bundle for the dataset factory."""

    bl_label = "Export Bundle"
    command = Command(
        "export",
        reads={"export": ("bundle_folder", *_BOTH, "spans", "velocities")},
        anew=True,
        words={"bundle_folder": "--out", "spans": "--span SECONDS"},
        needs=("bundle_folder",),
        repeated=("spans",),
    )

    def work(self, context: bpy.types.Context, progress: Progress) -> str:
        """Exports with the panel's settings."""
        settings = context.scene.rfgs.export
        folder = chosen_path(settings.bundle_folder)
        info = export_bundle(
            context.scene,
            folder,
            settings.frames or None,
            settings.cameras or None,
            settings.resolution or None,
            progress,
            _seconds(settings.spans),
            chosen_overrides(settings),
            settings.velocities,
        )
        names = ("frames", "objects", "instances", "devices", "cameras")
        return f"Wrote {folder}: {', '.join(f'{len(info[name])} {name}' for name in names)}"


class RFGS_OT_render_groundtruth(Reporting, bpy.types.Operator):
    """Render pictures, and passes if wanted, from every camera with Cycles."""

    bl_label = "Render Ground Truth"
    command = Command(
        "groundtruth",
        reads={"export": ("pictures_folder", *_BOTH, "samples", "passes", "empty")},
        anew=True,
        words={"pictures_folder": "--out"},
        needs=("pictures_folder",),
        unsaid={"passes": False},
    )

    def work(self, context: bpy.types.Context, progress: Progress) -> str:
        """Renders with the panel's settings."""
        settings = context.scene.rfgs.export
        folder = chosen_path(settings.pictures_folder)
        noise = "" if settings.empty else noise_note()
        if noise:
            note(noise)
        count = render_groundtruth(
            context.scene,
            folder,
            settings.frames or None,
            settings.cameras or None,
            settings.resolution or None,
            settings.samples,
            settings.passes,
            settings.empty,
            progress,
            chosen_overrides(settings),
        )
        return f"Wrote {folder}: {count} pictures" + (f"; {noise}" if noise else "")


def _seconds(text: str) -> list[float]:
    """Times with commas between [s].

    Raises:
        AddonError: One is no number.
    """
    try:
        return [float(part) for part in text.split(",") if part.strip()]
    except ValueError as error:
        raise AddonError(f"spans: expected seconds with commas between, got {text!r}") from error
