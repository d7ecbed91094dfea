# SPDX-License-Identifier: Apache-2.0
"""A random world as a dataset's files."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from dataset_factory.make.sequence import instance_row
from dataset_factory.plan.contents import versions
from rfgs_core.dataset.csi_store import create_csi, write_csi
from rfgs_core.dataset.mesh_ply import write_mesh
from rfgs_core.dataset.names import SequenceFiles
from rfgs_core.dataset.schema import DatasetInfo, SequenceInfo
from rfgs_core.dataset.splits import radio_split
from rfgs_core.dataset.writer import finish_dataset, write_arrays, write_sequence_info
from rfgs_core.radio import layout
from rfgs_core.radio.files import radio_values
from rfgs_core.radio.materials import MATERIALS
from rfgs_core.worlds.world import Sounding, World, WorldSettings


def name_of(index: int) -> str:
    """Folder of a world, and name of its sequence."""
    return f"world_{index:07d}"


def write_world(folder: Path, heard: Sounding, settings: WorldSettings, seed: int) -> None:
    """Writes a world and its channels as a whole dataset.

    Args:
        folder: Folder of the dataset.
        heard: The world and what was heard there.
        settings: What worlds have in common.
        seed: Root seed.
    """
    world = heard.world
    name = name_of(world.index)
    files, frames = SequenceFiles(folder / name), list(range(1, settings.frames + 1))
    info = _describe(world, settings, seed, frames)
    write_sequence_info(files, info)
    radio, devices = world.radio, world.devices
    store = files.csi(radio.name)
    create_csi(store, radio, layout(radio, devices), frames, heard.time_s.tolist())
    write_csi(store, None, heard.csi_static, files.csi_done(radio.name, None))
    for row, frame in enumerate(frames):
        write_csi(store, row, heard.csi[row], files.csi_done(radio.name, frame))
    _write_geometry(files, heard, settings, frames)
    config = {"worlds": asdict(settings), "radio": radio.name, "index": world.index}
    has = ["csi", "csi_static", "geometry"]
    finish_dataset(folder, DatasetInfo(versions(), config, seed, has, [name]))


def _write_geometry(
    files: SequenceFiles, heard: Sounding, settings: WorldSettings, frames: list[int]
) -> None:
    world, movers = heard.world, heard.world.movers
    write_mesh(files.static_mesh, *world.setting.mesh())
    write_arrays(
        files.topology,
        faces=movers.faces.astype(np.int32),
        material=movers.material,
        instance=movers.instance,
        segment=movers.segment,
        rest_vertices=movers.rest_vertices,
    )
    for frame, time_s in zip(frames, heard.time_s.tolist(), strict=True):
        write_arrays(
            files.geometry(frame),
            vertices=world.vertices(time_s),
            joints=world.joints(time_s),
            segment_velocity=world.segment_velocity(time_s, 1.0 / settings.fps),
            person_instance=np.arange(1, len(world.actors) + 1, dtype=np.int32),
            action=np.array([actor.motion.family for actor in world.actors], np.str_),
        )


def _describe(world: World, settings: WorldSettings, seed: int, frames: list[int]) -> SequenceInfo:
    radio, devices, setting = world.radio, world.devices, world.setting
    people = [
        instance_row({"id": number, "name": f"person_{number}", "class": "person", "person": True})
        for number in range(1, len(world.actors) + 1)
    ]
    still = [{"name": part.name, "class": "static", "instance": 0} for part in setting.parts]
    moving = [{"name": row["name"], "class": "person", "instance": row["id"]} for row in people]
    split = radio_split(radio, layout(radio, devices), seed)
    return SequenceInfo(
        scene=name_of(world.index),
        blend_sha256="",
        frames=frames,
        frame_start=1,
        fps=settings.fps,
        bounds_m=setting.bounds_m.tolist(),
        cameras=[],
        devices={radio.name: [asdict(device) for device in devices]},
        radios={radio.name: radio_values(radio)},
        splits={
            "rf": {radio.name: split},
            "images": {"test_cameras": [], "test_frames": []},
        },
        materials=_materials(world),
        instances=people,
        objects=[{"id": number, **row} for number, row in enumerate([*still, *moving], start=1)],
        trace_depth=min(settings.depth, radio.deepest),
        tracer="fast",
    )


def _materials(world: World) -> list[dict[str, Any]]:
    """The world's materials as datasets name them."""
    return [
        {
            "name": slab.name, "source": slab.name, "radio_material": slab.name, "guessed": False,
            "thickness_m": slab.thickness_m, "scattering_coefficient": 0.0,
            "color": list(MATERIALS[slab.name].colour),
        }
        for slab in world.setting.materials
    ]  # fmt: skip
