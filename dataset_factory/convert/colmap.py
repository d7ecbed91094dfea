# SPDX-License-Identifier: Apache-2.0
"""COLMAP: a text model (cameras, images, points3D) with the first frame's pictures.

Format: https://colmap.github.io/format.html. COLMAP knows no time, so one instant is written;
poses take the world to cameras with +x right, +y down, +z forward, quaternions w first.
"""

from __future__ import annotations

from pathlib import Path

from scipy.spatial.transform import Rotation

from dataset_factory.convert.pictures import copy_picture, static_points
from rfgs_core.dataset import Sequence
from rfgs_core.files import write_text
from rfgs_core.render.cameras import Camera


def write(sequence: Sequence, out: Path) -> None:
    """Writes `images/` and `sparse/0/`; points lie on surfaces and carry no track."""
    frame, model = sequence.frames[0], out / "sparse" / "0"
    cameras, images = [], []
    for number, row in enumerate(sequence.cameras, start=1):
        camera, name = Camera.from_dict(row), f"{row['name']}.png"
        copy_picture(sequence, row["name"], frame, out / "images" / name)
        lens = " ".join(repr(row[key]) for key in ("fl_x", "fl_y", "cx", "cy"))
        cameras.append(f"{number} PINHOLE {camera.width} {camera.height} {lens}\n")
        matrix = camera.view_from_world
        x, y, z, w = Rotation.from_matrix(matrix[:3, :3]).as_quat()
        pose = " ".join(repr(float(value)) for value in (w, x, y, z, *matrix[:3, 3]))
        # The second line of an image lists its key points: there are none.
        images.append(f"{number} {pose} {number} {name}\n\n")
    points, colours = static_points(sequence)
    rows = [
        f"{index} {' '.join(f'{value:.6f}' for value in point)} {r} {g} {b} 0\n"
        for index, (point, (r, g, b)) in enumerate(zip(points, colours, strict=True), start=1)
    ]
    write_text(model / "cameras.txt", "# id, model, width, height, parameters\n" + "".join(cameras))
    heading = "# id, qw, qx, qy, qz, tx, ty, tz, camera, name; then key points\n"
    write_text(model / "images.txt", heading + "".join(images))
    heading = "# id, x, y, z, red, green, blue, error, track\n"
    write_text(model / "points3D.txt", heading + "".join(rows))
