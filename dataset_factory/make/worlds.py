# SPDX-License-Identifier: Apache-2.0
"""Random worlds as datasets: one small folder each, whole or not there."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from dataset_factory.make.sequence import instance_row
from dataset_factory.plan.contents import make_plan, versions
from dataset_factory.scene.builder import build_scene
from dataset_factory.scene.catalogue import find_scene
from rfgs_core.dataset.csi_store import create_csi, write_csi
from rfgs_core.dataset.mesh_ply import write_mesh
from rfgs_core.dataset.names import SequenceFiles
from rfgs_core.dataset.schema import DatasetInfo, SequenceInfo
from rfgs_core.dataset.splits import radio_split
from rfgs_core.dataset.writer import finish_dataset, write_arrays, write_sequence_info
from rfgs_core.errors import RfgsError
from rfgs_core.files import read_json, replacing_folder, write_json
from rfgs_core.links import refuse_link
from rfgs_core.locks import alone_in
from rfgs_core.radio import layout
from rfgs_core.radio.files import radio_values
from rfgs_core.radio.materials import MATERIALS
from rfgs_core.worlds.settings_file import SETTINGS_FILE, WorldsFile
from rfgs_core.worlds.world import (
    Sounding,
    World,
    WorldSettings,
    random_world,
    refuse_radio,
    sounded,
)

#: Folder of the worlds' scenes, where they are rendered or traced by Sionna RT.
SCENES = "scenes"
#: Worlds of one folder at most.
MOST = 10_000_000
_SHARD = re.compile(r"(\d{1,6})/(\d{1,6})", re.ASCII)


def parse_shard(text: str) -> tuple[int, int]:
    """Number of a shard, from 1, and how many there are.

    Raises:
        RfgsError: It is not of the form K/N with K from 1 to N.

    Example:
        >>> parse_shard("2/8")
        (2, 8)
    """
    match = _SHARD.fullmatch(text)
    number, count = (int(match[1]), int(match[2])) if match else (0, 0)
    if not 1 <= number <= count:
        raise RfgsError(f"--shard {text!r}: expected K/N with K from 1 to N, as in 2/8")
    return number, count


def claim(out: Path, shared: WorldsFile) -> None:
    """Makes the folder, or checks that its worlds are of the same settings.

    Raises:
        RfgsError: The folder holds something else, or worlds made with other settings.
    """
    asked = {**shared.as_json(), "rfgs": versions()["rfgs"]}
    file = out / SETTINGS_FILE
    refuse_link(file)
    if file.is_file():
        if read_json(file) != asked:
            raise RfgsError(f"{file}: made with other settings; choose another --out")
        return
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise RfgsError(f"{out}: not empty and no worlds; choose another --out")
    write_json(file, asked)


def missing(out: Path, indices: range) -> list[int]:
    """Worlds that are not there yet."""
    return [index for index in indices if not (out / name_of(index) / "dataset.json").is_file()]


def _tidy(out: Path, indices: range) -> None:
    """Removes what a killed run of these worlds left; others may be at work on others."""
    for old in out.glob(".tmp-*-world_*"):
        if int(old.name.rpartition("_")[2]) in indices:
            shutil.rmtree(old, ignore_errors=True)


def name_of(index: int) -> str:
    """Folder of a world, and name of its sequence."""
    return f"world_{index:07d}"


def make_worlds(out: Path, shared: WorldsFile, named: str, indices: range) -> Iterator[World]:
    """Makes the worlds that are missing, each a dataset of its own below a folder.

    Args:
        out: The folder.
        shared: What the worlds have in common.
        named: How `--radio` names their radio.
        indices: Which worlds.

    Yields:
        Every world that was made, when it is whole.

    Raises:
        RfgsError: The folder holds something else, somebody else makes the same worlds, or a
            radio cannot be traced in such rooms.
    """
    shared.settings.check()
    refuse_radio(shared.radio)
    claim(out, shared)
    lock = out / f".lock-{indices.start}-{indices.step}"
    refuse_link(lock)
    lock.touch()
    with alone_in(lock, out, "rfgs-factory worlds"):
        _tidy(out, indices)
        for index in missing(out, indices):
            world = random_world(shared.radio, shared.settings, shared.seed, index)
            with replacing_folder(out / name_of(index)) as folder:
                if shared.in_blender:
                    _generate(folder, _scene(out, index), shared, named)
                else:
                    heard = sounded(world, shared.settings, shared.seed)
                    _write(folder, heard, shared.settings, shared.seed)
            yield world


def _scene(out: Path, index: int) -> Path:
    """Builds a world as a scene of Blender."""
    scenes = out / SCENES
    refuse_link(scenes)
    scenes.mkdir(exist_ok=True)
    blend = scenes / f"{name_of(index)}.blend"
    refuse_link(blend)
    source = str(out / SETTINGS_FILE)
    build_scene("a world", "world", source, "--index", str(index), "--out", str(blend))
    return blend


def _generate(folder: Path, blend: Path, shared: WorldsFile, named: str) -> None:
    """Makes the dataset of a world's scene."""
    # Worlds without Blender do without what traces and renders scenes, Dask among it.
    from dataset_factory.make.generate import generate
    from dataset_factory.plan.job import Job
    from dataset_factory.scene.blender import Blender

    settings, pictures = shared.settings, shared.pictures
    plan = make_plan(
        find_scene(str(blend)),
        (named,),
        f"1:{settings.frames}",
        cameras=pictures.cameras if pictures else 0,
        resolution=pictures.resolution_px if pictures else 16,
        samples=pictures.samples if pictures else 1,
        depth=min(settings.depth, shared.radio.deepest),
        seed=shared.seed,
        shadow="kirchhoff",
        tracer=shared.tracer,
        images=pictures is not None,
        impairments=None,
        packets_per_frame=1,
        paths=False,
        overrides={},
    )
    generate(Job(folder, plan, Blender(blend, None), workers=1))


def _write(folder: Path, heard: Sounding, settings: WorldSettings, seed: int) -> None:
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
