# SPDX-License-Identifier: GPL-3.0-or-later
"""How fast Gaussians are imported and played, beside a loop over points in the same run."""

from __future__ import annotations

import itertools
import json
import struct
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np

from .attributes import positions
from .clouds import Imported, Inspection, import_gaussians
from .display import Display
from .ply import write_columns
from .splats import COLOR, POSITION, ROTATION, SCALE

#: Properties of the files: what a run's PLY holds.
_NAMES = (*POSITION, "nx", "ny", "nz", *COLOR, "opacity", *SCALE, *ROTATION)
#: The same file is imported at least so many times, and until so many seconds of it were timed:
#: what takes a moment is easily doubled by other work on the machine.
_TIMES, _SPAN_S = 3, 1.0


def bench_gaussians(
    out: Path, count: int, frame_count: int, frames: int, loop_count: int, seed: int = 0
) -> None:
    """Times import and playback in an emptied file and writes the numbers as JSON.

    The loop does what importers without NumPy do: it unpacks one row after the other and sets
    one value after the other. It runs on `loop_count` points, and its time is scaled up.

    Args:
        out: JSON file to write.
        count: Gaussians of the one file that is imported.
        frame_count: Gaussians per frame of the sequence that is played.
        frames: Frames of that sequence.
        loop_count: Points of the loop.
        seed: Seed of the random Gaussians.
    """
    rng = np.random.default_rng(seed)
    result: dict[str, float | int | str] = {"blender": bpy.app.version_string}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        _write(folder / "one.ply", count, rng)
        import_s = _quickest(lambda: _import(folder / "one.ply", Display())[1])
        # The file was emptied before each import: what the last one made is all there is.
        (one,) = bpy.data.objects
        num_gaussians = len(one.data.vertices)
        loop_s = _quickest(lambda: _loop_import(folder / "one.ply", loop_count))
        loop_s *= count / loop_count
        result |= {"num_gaussians": num_gaussians}
        result |= {"import_s": import_s, "import_loop_s": loop_s}
        result["import_ratio"] = loop_s / import_s
        for frame in range(1, frames + 1):
            _write(folder / "run" / f"{frame:06d}.ply", frame_count, rng)
        for mode, display in (
            ("solid", Display(solid_view=True)),
            ("ellipsoids", Display("ellipsoids")),
            ("points", Display()),
        ):
            done, _ = _import(folder / "run", display)
            result[f"{mode}_fps"] = _play(done, frames)
        loop_fps = loop_count / frame_count / _loop_frame(done.objects[0].data, loop_count)
        result |= {"loop_fps": loop_fps, "points_ratio": result["points_fps"] / loop_fps}
        result["gaussians_per_frame"] = len(done.objects[-1].data.vertices)
        result |= {"frames": len(done.objects), "loop_points": loop_count}
    out.write_text(json.dumps(result))


def _quickest(once: Callable[[], float]) -> float:
    """Other work on the machine only ever adds to a time [s]: the least of several counts."""
    times = [once() for _ in range(_TIMES)]
    while sum(times) < _SPAN_S:
        times.append(once())
    return min(times)


def _write(path: Path, count: int, rng: np.random.Generator) -> None:
    columns = {name: rng.normal(size=count).astype(np.float32) for name in _NAMES}
    for name in SCALE:
        columns[name] -= 4
    write_columns(path, columns)


def _import(path: Path, display: Display) -> tuple[Imported, float]:
    """Imports into an empty file and evaluates what is then seen; returns the seconds too."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    start = time.perf_counter()
    done = import_gaussians(bpy.context.scene, path, Inspection(display))
    bpy.context.view_layer.update()
    return done, time.perf_counter() - start


def _play(done: Imported, frames: int) -> float:
    """Frames per second of the first time through: every cloud is evaluated for the first time."""
    scene = bpy.context.scene
    scene.frame_set(-1)
    for item in done.objects:
        item.data.update_tag()
    start = time.perf_counter()
    for frame in range(1, frames + 1):
        scene.frame_set(frame)
        bpy.context.evaluated_depsgraph_get()
    return frames / (time.perf_counter() - start)


def _loop_import(path: Path, count: int) -> float:
    """Point by point what `import_gaussians` does with arrays: positions, colour, shape.

    Returns:
        Seconds it took.
    """
    start = time.perf_counter()
    mesh = bpy.data.meshes.new("loop")
    mesh.vertices.add(count)
    for name, kind in (
        ("opacity", "FLOAT"), ("scale", "FLOAT_VECTOR"), ("rotation", "QUATERNION"),
        ("color", "FLOAT_COLOR"),
    ):  # fmt: skip
        mesh.attributes.new(name, kind, "POINT")
    made = mesh.attributes  # A new attribute moves those before it: none is held until now.
    opacity, scale, rotation, color = (
        made[name].data for name in ("opacity", "scale", "rotation", "color")
    )
    row = struct.Struct(f"<{len(_NAMES)}f")
    data = path.read_bytes()
    first = data.index(b"end_header\n") + len(b"end_header\n")
    for index in range(count):
        values = dict(zip(_NAMES, row.unpack_from(data, first + index * row.size), strict=True))
        mesh.vertices[index].co = [values[name] for name in POSITION]
        opacity[index].value = 1 / (1 + np.exp(-values["opacity"]))
        scale[index].vector = [np.exp(values[name]) for name in SCALE]
        rotation[index].value = [values[name] for name in ROTATION]
        color[index].color = [*(0.5 + 0.28 * values[name] for name in COLOR), 1.0]
    bpy.data.meshes.remove(mesh)
    return time.perf_counter() - start


def _loop_frame(mesh: bpy.types.Mesh, count: int) -> float:
    """Seconds to write one frame of `count` points into a mesh, point by point."""
    places = positions(mesh)[:count].tolist()
    start = time.perf_counter()
    for vertex, place in zip(itertools.islice(mesh.vertices, count), places, strict=True):
        vertex.co = place
    mesh.update()
    bpy.context.view_layer.update()
    return time.perf_counter() - start
