# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from bundle_files import describe_bundle

from dataset_factory.scene.bundle import Bundle, read_bundle
from dataset_factory.trace.setup import prepare
from rfgs_core.files import write_json
from rfgs_core.radio import DevicePose, Radio, preset

prepare()

ROOM_M = (4.0, 4.0, 2.6)
#: Of everything that moves, from its first to its second place in a tenth of a second.
VELOCITY_M_S = (5.0, -3.0, 0.0)
Mesh = tuple[np.ndarray, np.ndarray]
MakeBundle = Callable[..., Bundle]


def sheet(corner: tuple[float, ...], side_u: tuple[float, ...], side_v: tuple[float, ...]) -> Mesh:
    p, u, v = (np.asarray(x, dtype=np.float32) for x in (corner, side_u, side_v))
    return np.stack([p, p + u, p + u + v, p + v]), np.array([[0, 1, 2], [0, 2, 3]], np.int32)


def room() -> list[Mesh]:
    x, y, z = ROOM_M
    return [
        sheet((0, 0, 0), (x, 0, 0), (0, y, 0)),
        sheet((0, 0, z), (x, 0, 0), (0, y, 0)),
        sheet((0, 0, 0), (x, 0, 0), (0, 0, z)),
        sheet((0, y, 0), (x, 0, 0), (0, 0, z)),
        sheet((0, 0, 0), (0, y, 0), (0, 0, z)),
        sheet((x, 0, 0), (0, y, 0), (0, 0, z)),
    ]


def capsule(subdivisions: int = 4) -> Mesh:
    """A person-sized ellipsoid that stands on the floor at the origin."""
    ball = trimesh.creation.icosphere(subdivisions=subdivisions, radius=1.0)
    vertices = ball.vertices * [0.25, 0.18, 0.8] + [0.0, 0.0, 0.85]
    return vertices.astype(np.float32), ball.faces.astype(np.int32)


def _description(files: list[str], material: str, scattering: float) -> dict[str, Any]:
    """What `bundle.json` says of a room, somebody who moves and a car."""
    row = {"id": 1, "name": "room", "class": "static", "instance": 0, "moving": False}
    moving = {"id": 2, "name": "mover", "class": "person", "instance": 1, "moving": True}
    driven = {"id": 3, "name": "car", "class": "vehicle", "instance": 2, "moving": True}
    wall = {"name": "wall", "radio_material": material, "thickness_m": 0.0125}
    skin = {"name": "skin", "radio_material": "skin", "thickness_m": 0.3}
    steel = {"name": "steel", "radio_material": "metal", "thickness_m": 0.002}
    common = {"color": [0.5, 0.5, 0.5], "guessed": False}
    return {
        "schema": "rfgs-bundle/2",
        "blend_name": "test",
        "blend_sha256": "0" * 64,
        "blender_version": "4.5.0",
        "addon_version": "0.1.0",
        "fps": 10,
        "frame_start": 1,
        "frame_end": 2,
        "frames": [1, 2],
        "bounds_m": [[0.0, 0.0, 0.0], list(ROOM_M)],
        "devices": [],
        "cameras": [],
        "materials": [
            {**wall, **common, "scattering_coefficient": scattering},
            {**skin, **common, "scattering_coefficient": 0.0},
            {**steel, **common, "scattering_coefficient": 0.0},
        ],
        "objects": [{**row, "files": files}, {**moving, "files": []}, {**driven, "files": []}],
        "instances": [
            {"id": 1, "name": "mover", "class": "person", "person": True},
            {"id": 2, "name": "car", "class": "vehicle", "person": False},
        ],
    }


def write_bundle(
    folder: Path,
    static: list[Mesh],
    mover: Mesh | None,
    *,
    material: str = "plasterboard",
    scattering: float = 0.0,
    vehicle: Mesh | None = None,
) -> Bundle:
    (folder / "static").mkdir(parents=True)
    (folder / "frames").mkdir()
    files = []
    for index, (vertices, faces) in enumerate(static):
        files.append(f"static/wall{index}__wall.ply")
        data = trimesh.Trimesh(vertices, faces, process=False).export(file_type="ply")
        (folder / files[-1]).write_bytes(data)
    nothing = np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int32)
    (body, body_faces), (metal, metal_faces) = mover or nothing, vehicle or nothing
    vertices = np.concatenate([body, metal])
    # Instance and material of the same number: 1 a person of skin, 2 a vehicle of metal.
    kind = np.repeat(np.array([1, 2], np.int32), [len(body_faces), len(metal_faces)])
    np.savez(
        folder / "topology.npz",
        faces=np.concatenate([body_faces, metal_faces + len(body)]).astype(np.int32),
        material=kind,
        instance=kind,
        segment=np.full(len(kind), -1, np.int32),
        rest_vertices=vertices,
    )
    for frame, place in enumerate([(1.7, 2.1, 0.0), (2.2, 1.8, 0.0)], start=1):
        np.savez(
            folder / "frames" / f"{frame:06d}.npz",
            vertices=vertices + np.float32(place),
            joints=np.zeros((1, 17, 3), np.float32),
            segment_velocity=np.zeros((1, 17, 3), np.float32),
            vertex_velocity=np.full((len(vertices), 3), VELOCITY_M_S, np.float32),
            person_instance=np.array([1], np.int32),
            action=np.array(["walk"]),
        )
    write_json(folder / "guesses.json", [])
    describe_bundle(folder, _description(files, material, scattering))
    return read_bundle(folder)


@pytest.fixture(scope="session")
def make_bundle(tmp_path_factory: pytest.TempPathFactory) -> MakeBundle:
    """Writes a bundle of a room and one mover to disk and reads it back."""

    def make(static: list[Mesh] | None = None, mover: Mesh | None = None, **options) -> Bundle:
        folder = tmp_path_factory.mktemp("bundle") / "bundle"
        return write_bundle(folder, room() if static is None else static, mover, **options)

    return make


@pytest.fixture(scope="session")
def person_bundle(make_bundle: MakeBundle) -> Bundle:
    return make_bundle(mover=capsule())


@pytest.fixture(scope="session")
def velocity_m_s() -> np.ndarray:
    """Velocity of everything that moves in these bundles."""
    return np.array(VELOCITY_M_S)


@pytest.fixture
def metal_floor() -> list[Mesh]:
    """A floor alone, in the middle of which reflections lie."""
    return [sheet((-10, -10, 0), (24, 0, 0), (0, 24, 0))]


@pytest.fixture
def coarse_capsule() -> Mesh:
    """A person-sized ellipsoid of few faces."""
    return capsule(3)


@pytest.fixture
def steel_sheet() -> Mesh:
    """An upright square of steel, 3 m wide, that faces along y."""
    return sheet((-1.5, 0, 0.2), (3, 0, 0), (0, 0, 2.4))


@pytest.fixture(scope="session")
def make_sheet() -> Callable[..., Mesh]:
    """Makes parallelograms from a corner and two sides."""
    return sheet


@pytest.fixture
def three_sheets() -> list[Mesh]:
    """Three sheets of the room."""
    return room()[:3]


@pytest.fixture
def small_radio() -> Radio:
    """Two devices of one transmitter and 2 by 2 receivers; long waves keep points few."""
    return replace(
        preset("wifi"),
        freq_min_hz=2.40e9,
        freq_max_hz=2.48e9,
        num_subcarriers=16,
        rx_rows=2,
        rx_cols=2,
        num_devices=2,
    )


@pytest.fixture
def two_devices() -> list[DevicePose]:
    """Two upright devices that face each other across the room, at different heights."""
    return [
        DevicePose("a", (0.4, 0.5, 1.2), (0.9238795, 0.0, 0.0, 0.3826834)),
        DevicePose("b", (3.5, 3.6, 2.1), (0.3826834, 0.0, 0.0, -0.9238795)),
    ]
