# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of datasets and trainings."""

import bpy

from ..path_options import path_setting
from ..tables import RADIOS


def _search_radios(_self: object, _context: object, text: str) -> list[str]:
    return [name for name in ("scene", *RADIOS) if text.lower() in name]


class RFGS_PG_jobs(bpy.types.PropertyGroup):
    """What is generated and trained, and where to."""

    radios: bpy.props.StringProperty(
        name="Radios",
        description="Presets to trace, with commas between; 'scene' is the one that the Empties "
        "describe. Empty: 'scene' where some device is of that radio, else wifi, or the presets of "
        "the devices where none takes part in wifi",
        search=_search_radios,
        search_options={"SUGGESTION"},
    )
    frames: bpy.props.StringProperty(
        name="Frames",
        description="First:last or first:last:step, both ends included; empty: the whole range",
    )
    depth: bpy.props.IntProperty(
        name="Depth",
        description="Interactions of a path that meets a person: 1 the person alone (fast), "
        "2 also one wall, 3 two (slow); 0: what the scene needs",
        min=0,
        max=3,
    )
    workers: bpy.props.IntProperty(
        name="Workers",
        description="Tracing processes; each keeps one core busy",
        default=2,
        min=1,
        max=256,
    )
    images: bpy.props.BoolProperty(
        name="Pictures",
        description="Also render colour, depth, normals and masks from the cameras",
        default=True,
    )
    cameras: bpy.props.IntProperty(
        name="Cameras", description="First N cameras by name; 0: all", min=0
    )
    resolution: bpy.props.IntProperty(
        name="Resolution",
        description="Longer side of the pictures [px]",
        default=256,
        min=16,
        max=16384,
        subtype="PIXEL",
    )
    samples: bpy.props.IntProperty(
        name="Samples", description="Light samples per pixel", default=16, min=1
    )
    paths: bpy.props.BoolProperty(
        name="Ray paths",
        description="Also store the paths behind every channel, to be shown as curves",
    )
    seed: bpy.props.IntProperty(
        name="Seed", description="The same seed gives the same bytes", min=0
    )
    dataset_folder: path_setting(
        "Dataset", "Folder of the dataset; one that is half-made is continued", "//rfgs_dataset"
    )
    save_first: bpy.props.BoolProperty(
        name="Save file first",
        description="Save this file before a dataset is made: what is traced is the file on disk",
        default=True,
    )
    train_radio: bpy.props.StringProperty(
        name="Radio",
        description="Which of the dataset's radios to train on; empty: the first of those above",
        search=_search_radios,
        search_options={"SUGGESTION"},
    )
    train_frames: bpy.props.StringProperty(
        name="Frames", description="First:last or first:last:step of the dataset; empty: all"
    )
    iterations: bpy.props.IntProperty(
        name="Steps", description="Optimisation steps per frame; 0: the recipe's own number", min=0
    )
    gaussians: bpy.props.IntProperty(
        name="Gaussians",
        description="Moving Gaussians at the start; 0: the recipe's own number",
        min=0,
    )
    run_folder: path_setting(
        "Run", "Folder of the training; one that is half-done is continued", "//rfgs_run"
    )
