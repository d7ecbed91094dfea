# SPDX-License-Identifier: Apache-2.0
"""Depth, normals and masks that Blender renders, against a rasteriser of the exported meshes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from dataset_factory.make.encode import encode_frame
from dataset_factory.scene.blender import Blender
from dataset_factory.verify.card import Curve, Group, Plot, at_least, within
from dataset_factory.verify.description import Camera, Description, Part, room, stepping
from dataset_factory.verify.rasteriser import Raster, raster
from dataset_factory.verify.workshop import Workshop
from rfgs_core.dataset.names import SequenceFiles
from rfgs_core.dataset.pictures import read_planes, read_png_u16

#: Largest error of depth [mm] and of normals [deg] off edges; least overlap of masks.
DEPTH_MM, NORMAL_DEG, OVERLAP = 5.0, 1.0, 0.99
SIZE_PX, FRAMES = 160, (1, 3)
SOURCE = "a ray through each pixel's centre, all triangles, in NumPy"

#: A room with furniture, a person-sized box and a ball that move.
SCENE = Description(
    (
        *room((4.0, 3.0, 2.5), "concrete"),
        Part("table top", "box", (1.2, 0.7, 0.05), (3.1, 0.7, 0.72), "wood"),
        Part("cabinet", "box", (0.6, 0.4, 1.6), (0.5, 2.6, 0.81), "metal", turn_deg=(0, 0, 15)),
        Part("globe", "ball", (0.4, 0.4, 0.4), (3.1, 0.7, 0.95), "metal", cells=3),
        stepping(
            Part("person", "box", (0.5, 0.3, 1.7), kind="PERSON", material="skin", cells=3),
            [(1.2, 1.3, 0.88), (1.4, 1.4, 0.88), (1.6, 1.5, 0.88)],
            [0.0, 20.0, 40.0],
        ),
        stepping(
            Part("ball", "ball", (0.5, 0.5, 0.5), kind="AUTO", cells=3),
            [(2.4, 2.2, 0.6), (2.3, 2.1, 0.7), (2.2, 2.0, 0.8)],
        ),
    ),
    cameras=(
        Camera("cam_00", (3.8, 0.2, 2.2), (1.6, 1.8, 0.9), 70.0),
        Camera("cam_01", (0.2, 0.3, 1.3), (2.6, 1.8, 0.8), 75.0),
    ),
    frames=3,
)


def verify(workshop: Workshop) -> Group:
    """Renders two cameras at two frames, encodes them as a dataset does, and reads them back."""
    bundle = workshop.bundle(SCENE)
    files = _rendered(workshop, [row["name"] for row in bundle.cameras])
    depth_mm, normal_deg, shared, either = [], [], {}, {}
    names = {row["id"]: row["name"] for row in bundle.instances}
    for row, camera in zip(bundle.cameras, SCENE.cameras, strict=True):
        for frame in FRAMES:
            true = raster(bundle, camera, frame, SIZE_PX)
            (depth,) = read_planes(files.depth(row["name"], frame), "Z")
            normal = np.stack(read_planes(files.normal(row["name"], frame), "XYZ"), axis=-1)
            mask = read_png_u16(files.mask(row["name"], frame))
            depth_mm.append(1e3 * np.abs(depth - true.depth)[true.inner])
            normal_deg.append(_angle_deg(normal, true)[true.inner])
            for number in names:
                found, exact = mask == number, true.instance == number
                shared[number] = shared.get(number, 0) + int((found & exact).sum())
                either[number] = either.get(number, 0) + int((found | exact).sum())
    depths, normals = np.concatenate(depth_mm), np.concatenate(normal_deg)
    rows = [
        within("depth off edges, worst pixel", float(depths.max()), DEPTH_MM, "mm", SOURCE),
        within("normals off edges, worst pixel", float(normals.max()), NORMAL_DEG, "°", SOURCE),
    ]
    for number, name in names.items():
        overlap = shared[number] / max(either[number], 1)
        rows.append(
            at_least(f"mask of the {name}, intersection over union", overlap, OVERLAP, SOURCE)
        )
    return Group(
        "pictures",
        "Depth, normals and masks",
        f"A furnished room, two cameras, two frames, {SIZE_PX} × {SIZE_PX} pixels, rendered by "
        "Blender and encoded as in a dataset, beside a rasteriser of its own that shares nothing "
        "with Blender but the exported meshes. Pixels whose neighbours see another plane or "
        f"another mesh are edges: {len(depths):,} pixels are not.",
        rows,
        [_plot(depths, normals)],
    )


def _rendered(workshop: Workshop, cameras: list[str]) -> SequenceFiles:
    """Renders and encodes the frames."""
    rendered, files = workshop.folder / "rendered", SequenceFiles(workshop.folder / "pictures")
    size = ["--resolution", str(SIZE_PX), "--samples", "1", "--passes"]
    step = FRAMES[1] - FRAMES[0]
    frames = ["--frames", f"{FRAMES[0]}:{FRAMES[1]}:{step}"]
    blender = Blender(workshop.blend(SCENE))
    blender.run("groundtruth", "--out", str(rendered), *size, *frames)
    for frame in FRAMES:
        encode_frame(Path(rendered), files, cameras, frame)
    return files


def _angle_deg(normal: np.ndarray, true: Raster) -> np.ndarray:
    """Angle between normals, whichever side a sheet shows [deg], shape (h, w)."""
    length = np.maximum(np.linalg.norm(normal, axis=2), 1e-6)
    cosine = np.abs(np.sum(normal * true.normal, axis=2)) / length
    return np.degrees(np.arccos(np.clip(cosine, 0.0, 1.0)))


def _plot(depth_mm: np.ndarray, normal_deg: np.ndarray) -> Plot:
    """Shares of pixels below an error."""
    share = np.linspace(0.0, 1.0, 60)
    curves = [
        Curve("depth [mm]", np.quantile(depth_mm, share), 100 * share, "measured"),
        Curve("normals [°]", np.quantile(normal_deg, share), 100 * share, "measured"),
    ]
    return Plot("Pixels off edges below an error", "error", "share [%]", curves)
