# SPDX-License-Identifier: GPL-3.0-or-later
"""What the add-on stores: one property group each on objects, materials, scenes, windows."""

import bpy
from bpy.app.handlers import persistent

from .channels.settings import RFGS_PG_channels
from .check.settings import RFGS_PG_check
from .coverage.settings import RFGS_PG_coverage
from .devices.properties import RFGS_PG_radio, search_radios
from .devices.settings import RFGS_PG_devices
from .export.settings import RFGS_PG_export
from .gaussians.settings import RFGS_PG_gaussians
from .jobs.settings import RFGS_PG_jobs
from .live.settings import RFGS_PG_live
from .materials.coloring import restore
from .materials.properties import RFGS_PG_guesses, RFGS_PG_material, RFGS_PG_materials
from .paths.settings import RFGS_PG_paths
from .steps import RFGS_PG_steps, fold_by_themselves

ROLES = [
    ("NONE", "None", "Not a radio device", 0),
    ("ACCESS_POINT", "Access point", "Transmits and receives", 1),
    ("TRANSMITTER", "Transmitter", "Only transmits", 2),
    ("RECEIVER", "Receiver", "Only receives", 3),
]

CLASSES = [
    ("AUTO", "Automatic", "Person if skinned to an armature, else static or other", 0),
    ("STATIC", "Static", "Part of the environment; must not move", 1),
    ("PERSON", "Person", "A moving human body", 2),
    ("VEHICLE", "Vehicle", "A rigid moving metal object", 3),
    ("IGNORE", "Ignore", "Invisible to radio and left out of the bundle", 4),
]


class RFGS_PG_object(bpy.types.PropertyGroup):
    """Radio meaning of an object."""

    role: bpy.props.EnumProperty(
        name="Role",
        description="What this Empty is in the radio scene; its local +X is the boresight",
        items=ROLES,
        default="NONE",
    )
    radio: bpy.props.StringProperty(
        name="Radio",
        description="Preset this device belongs to, 'any' for every radio, or 'scene' for the one "
        "described below",
        default="any",
        search=search_radios,
    )
    rf: bpy.props.PointerProperty(type=RFGS_PG_radio)
    object_class: bpy.props.EnumProperty(
        name="Class", description="What this mesh is to the radio", items=CLASSES, default="AUTO"
    )
    instance: bpy.props.StringProperty(
        name="Instance",
        description="Objects of one name form one instance in masks; empty: the object itself",
    )
    surface_m2: bpy.props.FloatProperty(
        name="Surface [m²]",
        description="Outer surface of its whole instance [m²], by which evaluation sizes "
        "predictions; 0: the standard body for people, the box around it for vehicles",
        min=0.0,
        soft_max=100.0,
        precision=1,
    )


class RFGS_PG_scene(bpy.types.PropertyGroup):
    """Settings of the panels, a group for each."""

    devices: bpy.props.PointerProperty(type=RFGS_PG_devices)
    export: bpy.props.PointerProperty(type=RFGS_PG_export)
    gaussians: bpy.props.PointerProperty(type=RFGS_PG_gaussians)
    channels: bpy.props.PointerProperty(type=RFGS_PG_channels)
    coverage: bpy.props.PointerProperty(type=RFGS_PG_coverage)
    jobs: bpy.props.PointerProperty(type=RFGS_PG_jobs)
    live: bpy.props.PointerProperty(type=RFGS_PG_live)
    paths: bpy.props.PointerProperty(type=RFGS_PG_paths)
    materials: bpy.props.PointerProperty(type=RFGS_PG_materials)


class RFGS_PG_window(bpy.types.PropertyGroup):
    """What lasts as long as the file is open, and is not saved in it."""

    check: bpy.props.PointerProperty(type=RFGS_PG_check)
    guesses: bpy.props.PointerProperty(type=RFGS_PG_guesses)
    steps: bpy.props.PointerProperty(type=RFGS_PG_steps)


@persistent
def _forget(_path: object) -> None:
    """Empties the lists about a file that is open no more."""
    window = bpy.context.window_manager.rfgs
    for name in ("check", "guesses"):
        window.property_unset(name)
    fold_by_themselves()


def register() -> None:
    """Adds `rfgs` to objects, materials and scenes."""
    bpy.types.Object.rfgs = bpy.props.PointerProperty(type=RFGS_PG_object)
    bpy.types.Material.rfgs = bpy.props.PointerProperty(type=RFGS_PG_material)
    bpy.types.Scene.rfgs = bpy.props.PointerProperty(type=RFGS_PG_scene)
    bpy.types.WindowManager.rfgs = bpy.props.PointerProperty(type=RFGS_PG_window)
    bpy.app.handlers.load_post.append(_forget)


def unregister() -> None:
    """Takes everything back that `register` added."""
    restore()
    bpy.app.handlers.load_post.remove(_forget)
    fold_by_themselves()
    del bpy.types.WindowManager.rfgs
    del bpy.types.Scene.rfgs
    del bpy.types.Material.rfgs
    del bpy.types.Object.rfgs
