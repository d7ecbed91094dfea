# SPDX-License-Identifier: Apache-2.0
"""A small synthetic dataset whose every value follows from a closed form."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import numpy as np

from rfgs_core.dataset.csi_store import create_csi, write_csi
from rfgs_core.dataset.mesh_ply import write_mesh
from rfgs_core.dataset.names import SequenceFiles
from rfgs_core.dataset.pictures import write_png
from rfgs_core.dataset.schema import PERSON_SURFACE_M2, DatasetInfo, SequenceInfo
from rfgs_core.dataset.splits import image_split, radio_split
from rfgs_core.dataset.writer import (
    finish_dataset,
    write_arrays,
    write_picture,
    write_sequence_info,
    write_transforms,
)
from rfgs_core.files import write_json
from rfgs_core.radio import Radio, layout, place_devices
from rfgs_core.radio.constants import SPEED_OF_LIGHT

FRAMES = [1, 2]
FPS = 10.0
BOUNDS_M = np.array([[0.0, 0.0, 0.0], [3.0, 3.0, 2.5]])
RADIUS_M = 0.3
PIXELS = 24
FOCAL_PX = 16.0
RADIO = Radio(
    name="wifi",
    freq_min_hz=5.72e9,
    freq_max_hz=5.88e9,
    num_subcarriers=16,
    tx_rows=1,
    tx_cols=1,
    rx_rows=2,
    rx_cols=4,
    tx_offset_m=(0.0, 0.0, -0.3),
)


#: Of the sphere, by its way from frame to frame.
VELOCITY_M_S = (0.2 * FPS, 0.0, 0.0)


def centre_m(frame: int) -> np.ndarray:
    """Centre of the sphere that stands for a person."""
    return np.array([1.1 + 0.2 * frame, 1.4, 1.0])


def sphere() -> tuple[np.ndarray, np.ndarray]:
    """A unit sphere of 10 x 16 quads, outward normals."""
    rows, cols = 11, 16
    polar, azimuth = np.meshgrid(
        np.linspace(0, np.pi, rows), np.arange(cols) * 2 * np.pi / cols, indexing="ij"
    )
    points = np.stack(
        [np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], -1
    )
    i, j = np.meshgrid(np.arange(rows - 1), np.arange(cols), indexing="ij")
    a, b = i * cols + j, i * cols + (j + 1) % cols
    c, d = a + cols, b + cols
    faces = np.concatenate([np.stack([a, c, d], -1), np.stack([a, d, b], -1)], 1).reshape(-1, 3)
    return points.reshape(-1, 3), faces.astype(np.int32)


def channels(frame: int | None) -> np.ndarray:
    """Line of sight, plus the lit vertices of the sphere as point scatterers."""
    elements = layout(RADIO, place_devices(RADIO, BOUNDS_M))
    k = 2 * np.pi * RADIO.freq_hz / SPEED_OF_LIGHT
    wavelength = SPEED_OF_LIGHT / RADIO.freq_hz
    direct = np.linalg.norm(elements.tx_xyz[:, None] - elements.rx_xyz[None], axis=-1)
    total = wavelength / (4 * np.pi * direct[..., None]) * np.exp(-1j * k * direct[..., None])
    if frame is not None:
        unit, _ = sphere()
        points = centre_m(frame) + RADIUS_M * unit
        out = np.linalg.norm(elements.tx_xyz[:, None] - points, axis=-1)
        back = np.linalg.norm(elements.rx_xyz[:, None] - points, axis=-1)
        for index in range(len(points)):
            path = out[:, index, None, None] + back[None, :, index, None]
            gain = 0.02 * wavelength / (4 * np.pi) ** 1.5
            spread = out[:, index, None, None] * back[None, :, index, None]
            total = total + gain / spread * np.exp(-1j * k * path)
    return (total * elements.measured[..., None]).astype(np.complex64)


def look_at(eye: np.ndarray, target: np.ndarray) -> np.ndarray:
    """world_from_camera with OpenGL axes."""
    back = (eye - target) / np.linalg.norm(eye - target)
    right = np.cross([0.0, 0.0, 1.0], back)
    right = right / np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([right, np.cross(back, right), back], axis=1)
    matrix[:3, 3] = eye
    return matrix


def camera_rows() -> list[dict]:
    """Four cameras in the corners under the ceiling."""
    rows = []
    for index, (x, y) in enumerate([(0.2, 0.2), (2.8, 0.2), (2.8, 2.8), (0.2, 2.8)]):
        pose = look_at(np.array([x, y, 2.0]), np.array([1.4, 1.4, 1.0]))
        rows.append(
            {
                "name": f"cam{index:02d}",
                "source": f"Camera {index}",
                "width": PIXELS,
                "height": PIXELS,
                "fl_x": FOCAL_PX,
                "fl_y": FOCAL_PX,
                "cx": PIXELS / 2,
                "cy": PIXELS / 2,
                "world_from_camera": pose.tolist(),
            }
        )
    return rows


def picture(camera: dict, frame: int | None) -> dict[str, np.ndarray]:
    """The sphere inside the box, by exact ray intersection."""
    world = np.asarray(camera["world_from_camera"])
    v, u = np.mgrid[0:PIXELS, 0:PIXELS] + 0.5
    local = np.stack(
        [(u - PIXELS / 2) / FOCAL_PX, -(v - PIXELS / 2) / FOCAL_PX, -np.ones_like(u)], -1
    )
    rays = local @ world[:3, :3].T
    origin = world[:3, 3]
    # The box is seen from inside: the far side of each slab, whichever comes first.
    walls = np.where(rays > 0, BOUNDS_M[1] - origin, BOUNDS_M[0] - origin)
    depth_axis = walls / np.where(np.abs(rays) < 1e-9, 1e-9, rays)
    axis = depth_axis.argmin(-1)
    depth = depth_axis.min(-1)
    normal = -np.sign(np.take_along_axis(rays, axis[..., None], -1)) * np.eye(3)[axis]
    colour = 90 + 60 * np.abs(normal)
    mask = np.zeros((PIXELS, PIXELS), np.uint16)
    if frame is not None:
        offset = origin - centre_m(frame)
        a, b = (rays**2).sum(-1), (rays * offset).sum(-1)
        root = b * b - a * ((offset**2).sum() - RADIUS_M**2)
        near = (-b - np.sqrt(np.maximum(root, 0))) / a
        hit = (root > 0) & (near > 0)
        mask[hit] = 1
        depth = np.where(hit, near, depth)
        surface = (origin + near[..., None] * rays - centre_m(frame)) / RADIUS_M
        normal = np.where(hit[..., None], surface, normal)
        colour = np.where(hit[..., None], [200, 60, 40], colour)
    rgba = np.concatenate([colour, np.full((*mask.shape, 1), 255)], -1).astype(np.uint8)
    return {
        "image": rgba,
        "depth": depth.astype(np.float32),
        "normal": normal.astype(np.float32),
        "mask": mask,
    }


def box() -> tuple[np.ndarray, np.ndarray]:
    """The room's walls, normals inwards."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [tri for a, b, c, d in quads for tri in ((a, b, c), (a, c, d))]
    vertices = BOUNDS_M[0] + corners * (BOUNDS_M[1] - BOUNDS_M[0])
    return vertices.astype(np.float32), np.array(faces, np.int32)


def sequence_info(cameras: list[dict]) -> SequenceInfo:
    """Everything `sequence.json` holds."""
    devices = place_devices(RADIO, BOUNDS_M)
    images = image_split([row["name"] for row in cameras], FRAMES)
    for row in cameras:
        row["split"] = "test" if row["name"] in images["test_cameras"] else "train"
    return SequenceInfo(
        scene="tiny",
        blend_sha256="0" * 64,
        frames=FRAMES,
        frame_start=1,
        fps=FPS,
        bounds_m=BOUNDS_M.tolist(),
        cameras=cameras,
        devices={RADIO.name: [asdict(device) for device in devices]},
        radios={RADIO.name: asdict(RADIO)},
        splits={
            "rf": {RADIO.name: radio_split(RADIO, layout(RADIO, devices), 0)},
            "images": images,
        },
        materials=[{"name": "skin", "radio_material": "skin", "thickness_m": 0.3}],
        instances=[
            {"id": 1, "name": "ball", "class": "person", "nominal_surface_m2": PERSON_SURFACE_M2}
        ],
        trace_depth=1,
        shadow="none",
    )


def write_tiny_dataset(root: Path) -> Path:
    """Writes the dataset below `root` and returns its folder.

    One sphere (instance 1, radius 0.3 m) moves 0.2 m along x in a 3 x 3 x 2.5 m box, seen by
    four cameras of 24 x 24 px and four Wi-Fi devices of 1 TX and 2 x 4 RX elements.
    """
    files = SequenceFiles(root / "tiny")
    cameras = camera_rows()
    info = sequence_info(cameras)
    write_sequence_info(files, info)
    elements = layout(RADIO, place_devices(RADIO, BOUNDS_M))
    times = [(frame - 1) / FPS for frame in FRAMES]
    create_csi(files.csi("wifi"), RADIO, elements, FRAMES, times)
    write_csi(files.csi("wifi"), None, channels(None), files.csi_done("wifi", None))
    unit, faces = sphere()
    instance = np.ones(len(faces), np.int32)
    write_arrays(files.topology, faces=faces, instance=instance)
    write_mesh(files.static_mesh, *box())
    for index, frame in enumerate(FRAMES):
        write_csi(files.csi("wifi"), index, channels(frame), files.csi_done("wifi", frame))
        height = np.linspace(-RADIUS_M, RADIUS_M, 17)[:, None] * [0.0, 0.0, 1.0]
        write_arrays(
            files.geometry(frame),
            vertices=(centre_m(frame) + RADIUS_M * unit).astype(np.float32),
            joints=(centre_m(frame) + height).astype(np.float32)[None],
            segment_velocity=np.full((1, 17, 3), VELOCITY_M_S, np.float32),
            person_instance=np.array([1], np.int32),
            action=np.array(["stand"]),
        )
        for camera in cameras:
            write_picture(files, camera["name"], frame, **picture(camera, frame))
        write_json(files.images_done(frame), {})
    for camera in cameras:
        write_png(files.image_empty(camera["name"]), picture(camera, None)["image"])
    write_transforms(files, info)
    has = ["csi", "csi_static", "images", "depth", "normal", "mask", "geometry"]
    finish_dataset(root, DatasetInfo({"rfgs": "test"}, {"scene": "tiny"}, 0, has, ["tiny"]))
    return root
