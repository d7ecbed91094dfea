# SPDX-License-Identifier: Apache-2.0
"""Describes a traced scene in the dataset's own terms."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from dataset_factory.plan.contents import Plan
from dataset_factory.scene.bundle import Bundle
from dataset_factory.scene.report_rows import read_guesses
from rfgs_core.dataset.mesh_ply import write_mesh
from rfgs_core.dataset.names import SequenceFiles
from rfgs_core.dataset.schema import PERSON_SURFACE_M2, SequenceInfo
from rfgs_core.dataset.splits import image_split, radio_split
from rfgs_core.dataset.writer import write_arrays
from rfgs_core.radio import DevicePose, layout


def describe_sequence(
    plan: Plan,
    bundle: Bundle,
    devices: dict[str, list[DevicePose]],
    guesses: list[dict[str, Any]],
) -> SequenceInfo:
    """Everything `sequence.json` holds; a function of the plan and the bundle alone."""
    radios = [plan.radio(name) for name in plan.radios]
    cameras = [dict(row) for row in bundle.cameras] if plan.images else []
    images = image_split([row["name"] for row in cameras], bundle.frames)
    for row in cameras:
        row["split"] = "test" if row["name"] in images["test_cameras"] else "train"
    return SequenceInfo(
        scene=plan.scene,
        blend_sha256=plan.blend_sha256,
        frames=bundle.frames,
        frame_start=int(bundle.info["frame_start"]),
        fps=bundle.fps,
        bounds_m=bundle.bounds_m.tolist(),
        cameras=cameras,
        devices={name: [asdict(device) for device in rows] for name, rows in devices.items()},
        radios={radio.name: asdict(radio) for radio in radios},
        splits={
            "rf": {
                radio.name: radio_split(radio, layout(radio, devices[radio.name]), plan.seed)
                for radio in radios
            },
            "images": images,
        },
        materials=bundle.materials,
        instances=[instance_row(row) for row in bundle.instances],
        objects=bundle.path_objects,
        guesses=[*read_guesses(bundle.file("guesses.json")), *guesses],
        trace_depth=plan.depth,
        shadow=plan.shadow,
        tracer=plan.tracer,
    )


def write_geometry(files: SequenceFiles, bundle: Bundle) -> None:
    """Writes the meshes that the channels were traced in.

    Raises:
        RfgsError: A frame of the bundle does not fit its topology.
    """
    meshes = bundle.static_meshes()
    offsets = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    faces = [mesh.faces + offset for mesh, offset in zip(meshes, offsets, strict=False)]
    # A scene without a room has an empty mesh.
    write_mesh(
        files.static_mesh,
        np.concatenate([np.zeros((0, 3), np.float32), *(mesh.vertices for mesh in meshes)]),
        np.concatenate([np.zeros((0, 3), np.int32), *faces]).astype(np.int32),
    )
    topology = bundle.topology
    write_arrays(
        files.topology,
        faces=topology.faces,
        material=topology.material,
        instance=topology.instance,
        segment=topology.segment,
        rest_vertices=topology.rest_vertices,
    )
    for number in bundle.frames:
        frame = bundle.frame(number)
        write_arrays(
            files.geometry(number),
            vertices=frame.vertices,
            joints=frame.joints,
            segment_velocity=frame.segment_velocity,
            person_instance=frame.person_instance,
            action=frame.action,
        )


def instance_row(row: dict[str, Any]) -> dict[str, Any]:
    """A bundle's row with the nominal surface [m²] that evaluation goes by.

    It comes from the scene's configuration, for people from the standard body, and never from
    the mesh of a frame, since it sizes predictions.
    """
    standard = PERSON_SURFACE_M2 if row["person"] else None
    return {**row, "nominal_surface_m2": row.get("nominal_surface_m2") or standard}
