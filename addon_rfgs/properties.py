# SPDX-License-Identifier: GPL-3.0-or-later
"""What the add-on stores in a .blend: one property group each on objects, materials, scenes."""

import zlib

import bpy

from .devices.properties import RFGS_PG_radio, search_radios
from .devices.settings import RFGS_PG_devices
from .export.settings import RFGS_PG_export
from .gaussians.settings import RFGS_PG_gaussians
from .jobs.settings import RFGS_PG_jobs
from .paths.settings import RFGS_PG_paths
from .removal.stored import prune_properties
from .tables import MATERIALS

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


def _material_items() -> list[tuple[str, str, str, int]]:
    """Enum rows whose stored numbers follow from the name, so a longer table shifts nothing."""
    items = [("AUTO", "Guess", "Guess the material from names and shape", 0)]
    for name, row in MATERIALS.items():
        band = f"{row['freq_min_hz'] / 1e9:g}–{row['freq_max_hz'] / 1e9:g} GHz"
        number = zlib.crc32(name.encode()) & 0x7FFFFFFF
        label = name.replace("_", " ").capitalize()
        items.append((name, label, f"Valid {band}, {row['thickness_m']:g} m thick", number))
    return items


class RFGS_PG_object(bpy.types.PropertyGroup):
    """Radio meaning of an object."""

    role: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Role",
        description="What this Empty is in the radio scene; its local +X is the boresight",
        items=ROLES,
        default="NONE",
    )
    radio: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Radio",
        description="Preset this device belongs to, 'any' for every radio, or 'scene' for the one "
        "described below",
        default="any",
        search=search_radios,
    )
    rf: bpy.props.PointerProperty(type=RFGS_PG_radio)  # type: ignore[valid-type]
    object_class: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Class",
        description="What this mesh is to the radio",
        items=CLASSES,
        default="AUTO",
    )
    instance: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Instance",
        description="Objects of one name form one instance in masks; empty: the object itself",
        default="",
    )
    surface_m2: bpy.props.FloatProperty(  # type: ignore[valid-type]
        name="Nominal surface",
        description="Outer surface of its whole instance [m²], by which evaluation sizes "
        "predictions; 0: the standard body for people, the box around it for vehicles",
        default=0.0,
        min=0.0,
        soft_max=100.0,
        precision=1,
    )


class RFGS_PG_material(bpy.types.PropertyGroup):
    """Radio meaning of a material."""

    radio_material: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Radio material",
        description="Electrical model of this surface",
        items=_material_items(),
        default="AUTO",
    )
    thickness_m: bpy.props.FloatProperty(  # type: ignore[valid-type]
        name="Thickness",
        description="Thickness of the slab behind this surface [m]; 0 takes the material's own",
        default=0.0,
        min=0.0,
        soft_max=1.0,
        precision=4,
        step=0.1,
    )
    scattering_coefficient: bpy.props.FloatProperty(  # type: ignore[valid-type]
        name="Scattering",
        description="Share of the reflected field's amplitude that is scattered diffusely, 0 to 1",
        default=0.0,
        min=0.0,
        max=1.0,
    )


class RFGS_PG_scene(bpy.types.PropertyGroup):
    """Settings of the panels, a group for each."""

    devices: bpy.props.PointerProperty(type=RFGS_PG_devices)  # type: ignore[valid-type]
    export: bpy.props.PointerProperty(type=RFGS_PG_export)  # type: ignore[valid-type]
    gaussians: bpy.props.PointerProperty(type=RFGS_PG_gaussians)  # type: ignore[valid-type]
    jobs: bpy.props.PointerProperty(type=RFGS_PG_jobs)  # type: ignore[valid-type]
    paths: bpy.props.PointerProperty(type=RFGS_PG_paths)  # type: ignore[valid-type]


CLASSES_TO_REGISTER = (
    RFGS_PG_radio,
    RFGS_PG_object,
    RFGS_PG_material,
    RFGS_PG_devices,
    RFGS_PG_export,
    RFGS_PG_gaussians,
    RFGS_PG_jobs,
    RFGS_PG_paths,
    RFGS_PG_scene,
)


def register() -> None:
    """Adds `rfgs` to objects, materials and scenes."""
    for cls in CLASSES_TO_REGISTER:
        bpy.utils.register_class(cls)
    bpy.types.Object.rfgs = bpy.props.PointerProperty(type=RFGS_PG_object)
    bpy.types.Material.rfgs = bpy.props.PointerProperty(type=RFGS_PG_material)
    bpy.types.Scene.rfgs = bpy.props.PointerProperty(type=RFGS_PG_scene)


def unregister() -> None:
    """Takes everything back that `register` added."""
    del bpy.types.Scene.rfgs
    del bpy.types.Material.rfgs
    del bpy.types.Object.rfgs
    for cls in reversed(CLASSES_TO_REGISTER):
        bpy.utils.unregister_class(cls)
    prune_properties()
