# SPDX-License-Identifier: GPL-3.0-or-later
"""Played inside Blender: the pictures of docs/blender.md, in the living room.

Arguments: Python program of the environment, Blender program.
"""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from typing import Any

import bpy
import mathutils

#: The frame of the pictures, and those that are traced.
FRAME, FRAMES = 25, "17:33:4"


def play(stage: Any) -> Iterator[float]:
    """Radios, a job, its Gaussians and its paths."""
    bpy.context.scene.frame_set(FRAME)
    yield from tab(stage, "RFGS_PT_devices")
    look_from_above(stage)
    yield from stage.shoot("overview", "VIEW")
    yield from materials(stage)
    yield from check(stage)
    yield from jobs(stage)
    yield from gaussians(stage)
    yield from paths(stage)
    yield from coverage(stage)
    yield from channels(stage)


def tab(stage: Any, *panels: str) -> Iterator[float]:
    """Our tab with these panels, the 3D view in the whole window from the first time on."""
    first = len(stage.window.screen.areas) > 1
    yield from stage.open_tab(*panels, alone=first)


def look_from_above(stage: Any) -> None:
    """Takes the ceiling off, and what only animators want to see."""
    for item in bpy.context.scene.objects:
        if item.name.startswith(("ceiling", "pendant")):
            item.hide_set(True)
    space = stage.view.spaces.active
    for name in ("armature", "camera", "light"):
        setattr(space, f"show_object_viewport_{name}", False)
    space.overlay.show_floor = space.overlay.show_axis_x = space.overlay.show_axis_y = False
    space.shading.show_backface_culling = True
    view = space.region_3d
    view.view_perspective = "PERSP"
    view.view_location = (0.6, 0.0, 0.6)
    view.view_rotation = mathutils.Euler((0.75, 0.0, 0.5)).to_quaternion()
    view.view_distance = 8.5


def materials(stage: Any) -> Iterator[float]:
    """What radio sees of the room."""
    yield from tab(stage, "RFGS_PT_check", "RFGS_PT_material", "RFGS_PT_guesses")
    bpy.context.view_layer.objects.active = bpy.data.objects["wall_north"]
    bpy.context.scene.rfgs.devices.overlay = False
    with stage.override():
        bpy.ops.rfgs.color_materials()
        yield from stage.shoot("materials", "VIEW")
        bpy.ops.rfgs.color_materials()
    bpy.context.scene.rfgs.devices.overlay = True


def check(stage: Any) -> Iterator[float]:
    """A person turned inside out, found and repaired."""
    yield from tab(stage, "RFGS_PT_check")
    bpy.data.objects["person_body"].data.flip_normals()
    bpy.ops.rfgs.check_scene()
    bpy.ops.rfgs.select_finding()
    yield from stage.shoot("check", "VIEW")
    bpy.ops.rfgs.repair_finding()


def jobs(stage: Any) -> Iterator[float]:
    """A dataset with ray paths, and Gaussians fitted to it."""
    yield from tab(stage, "RFGS_PT_jobs", "RFGS_PT_generate", "RFGS_PT_train")
    stored = stage.part("jobs.preferences").preferences()
    stored.python, stored.blender = stage.arguments
    bpy.ops.rfgs.test_environment()
    check = stage.part("jobs.checking").CHECK
    yield from stage.wait(lambda: bool(check.versions), "environment")
    said = bpy.context.scene.rfgs.jobs
    said.frames, said.images, said.paths, said.depth = FRAMES, False, True, 1
    bpy.ops.rfgs.generate_dataset()
    bpy.ops.rfgs.train_gaussians()
    queue = stage.part("jobs.following").QUEUE
    begun = ("trace 1", "done")
    yield from stage.wait(lambda: queue.jobs[0].message.startswith(begun), "tracing")
    yield from stage.shoot("jobs", "SIDEBAR")
    ended = ("Done", "Failed", "Stopped")
    yield from stage.wait(lambda: all(job.state in ended for job in queue.jobs), "jobs")
    told = [(job.state, job.message) for job in queue.jobs]
    assert [state for state, _ in told] == ["Done", "Done"], told
    stored.active_job = 1
    bpy.ops.rfgs.import_result()


def gaussians(stage: Any) -> Iterator[float]:
    """Gaussians beside the person that they were fitted to."""
    names = ("", "_display", "_color")
    yield from tab(stage, *(f"RFGS_PT_gaussians{name}" for name in names))
    said = bpy.context.scene.rfgs.gaussians
    said.path, said.color_by = "//rfgs_run", "FEATURES"
    with stage.override():
        bpy.ops.rfgs.color_solid_view()
    yield from stage.shoot("gaussians", "VIEW")
    bpy.data.collections["RF-GS Gaussians"].hide_viewport = True
    stage.view.spaces.active.shading.color_type = "MATERIAL"


def paths(stage: Any) -> Iterator[float]:
    """The strongest paths of one link."""
    yield from tab(stage, "RFGS_PT_gaussians", "RFGS_PT_paths")
    said = bpy.context.scene.rfgs.paths
    said.tx_device, said.rx_device, said.count, said.radius_m = 0, 2, 40, 0.012
    bpy.ops.rfgs.show_paths()
    yield from stage.shoot("paths", "VIEW")


def coverage(stage: Any) -> Iterator[float]:
    """How loud the loudest access point is at the height of a hand."""
    bpy.ops.rfgs.clear_paths()
    yield from tab(stage, "RFGS_PT_gaussians", "RFGS_PT_coverage")
    command = (stage.arguments[0], "-m", "dataset_factory", "coverage", bpy.data.filepath)
    out = bpy.path.abspath("//coverage.json")
    more = ("--blender", stage.arguments[1], "--frame", str(FRAME), "--out", out)
    # As jobs are started: Blender's own Python would be taken for that of the environment.
    outside = stage.part("jobs.environment").child_environment()
    subprocess.run([*command, *more], check=True, env=outside)
    with stage.override():
        bpy.ops.rfgs.show_coverage()
    yield from stage.shoot("coverage", "VIEW")
    bpy.ops.rfgs.clear_coverage()


def channels(stage: Any) -> Iterator[float]:
    """What was measured of a link above what the Gaussians predict, in an Image Editor."""
    with stage.override():
        bpy.ops.screen.screen_full_area(use_hide_panels=True)
    yield 0.5
    area = next(area for area in stage.window.screen.areas if area.type == "DOPESHEET_EDITOR")
    area.ui_type = "IMAGE_EDITOR"
    said = bpy.context.scene.rfgs.channels
    said.tx_device, said.rx_device = 0, 2
    bpy.ops.rfgs.show_csi()
    with bpy.context.temp_override(window=stage.window, area=area):
        bpy.ops.screen.screen_full_area()
    yield 1.0
    area = next(area for area in stage.window.screen.areas if area.type == "IMAGE_EDITOR")
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=stage.window, area=area, region=region):
        bpy.ops.image.view_all(fit_view=True)
    yield from stage.shoot("channels")
