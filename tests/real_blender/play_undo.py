# SPDX-License-Identifier: GPL-3.0-or-later
"""Played inside Blender: every operator that changes the file is undone and done again.

Arguments: folder with `cloud.ply`, `dataset/`, `run/`, the captures `a.csi` and `b.csi` and their
layout `radios.yaml`; Python program of the environment. The file is the small room of
`build_scenes.py`.
"""

from __future__ import annotations

import json
import socket
import sys
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

#: Operators whose undo and redo another script plays, as they need the environment outside.
ELSEWHERE = {"show_csi": "play_channels.py"}

#: Two receivers, as the panel asks for them.
CAPTURE = {
    "captures": "{folder}/a.csi, {folder}/b.csi",
    "layout": "{folder}/radios.yaml",
    "dataset": "{folder}/captured",
}


@dataclass
class Step:
    """An operator, its properties, and what it needs before."""

    operator: str
    properties: dict[str, Any] = field(default_factory=dict)
    prepare: Callable[[Any, Path], None] = lambda _stage, _folder: None
    label: str = ""


def play(stage: Any) -> Iterator[float]:
    """Tells for each step what it changed, and what undo and redo left different."""
    from file_state import changes, file_state

    folder = Path(stage.arguments[0])
    yield from stage.open_tab("RFGS_PT_file")
    told: dict[str, Any] = {"walked": {}, "elsewhere": ELSEWHERE}
    bpy.context.scene.frame_set(bpy.context.scene.frame_current)
    for step in steps():
        with stage.override():
            step.prepare(stage, folder)
            bpy.context.view_layer.update()
            bpy.ops.ed.undo_push(message="prepared")
        yield 0.1
        before = file_state()
        with stage.override():
            call(step, folder)
        yield 0.2
        after = file_state()
        left = []
        for go, wanted in ((bpy.ops.ed.undo, before), (bpy.ops.ed.redo, after)):
            with stage.override():
                go()
            yield 0.2
            left.append(changes(wanted, file_state()))
        told["walked"][step.label or step.operator] = [changes(before, after)[:20], *left]
    extension = [kind for kind in all_below(bpy.types.Operator) if hasattr(kind, "bl_idname")]
    told["undoable"] = sorted(
        kind.bl_idname.removeprefix("rfgs.")
        for kind in extension
        if kind.bl_idname.startswith("rfgs.") and "UNDO" in getattr(kind, "bl_options", ())
    )
    told["operators"] = sorted({step.operator for step in steps()} | ELSEWHERE.keys())
    told["repairable"] = sorted(stage.part("check.repairs").REPAIRABLE)
    (stage.out / "undo.json").write_text(json.dumps(told, indent=1))


def call(step: Step, folder: Path) -> None:
    given = {
        key: value.format(folder=folder) if isinstance(value, str) else value
        for key, value in step.properties.items()
    }
    if step.operator == "repair_finding":
        bpy.ops.rfgs.check_scene()
        rows = bpy.context.window_manager.rfgs.check.rows
        given["index"] = [row.kind for row in rows].index(given.pop("kind"))
    assert getattr(bpy.ops.rfgs, step.operator)("EXEC_DEFAULT", True, **given) == {"FINISHED"}


def all_below(base: type) -> set[type]:
    return {base, *(deeper for kind in base.__subclasses__() for deeper in all_below(kind))}


def steps() -> list[Step]:
    """In an order in which each finds what it needs."""
    repairs = [
        Step("repair_finding", {"kind": kind}, prepare, f"repair {kind}")
        for kind, prepare in BREAK.items()
    ]
    return [
        Step("place_radio", {"radio": "mmwave"}),
        Step("add_device", {"role": "RECEIVER", "radio": "scene"}),
        Step("duplicate_device"),
        Step("mirror_device"),
        Step("match_devices", prepare=differing),
        Step("remove_device"),
        Step("assign_material", {"radio_material": "brick"}, activate_crate),
        Step("apply_guesses", prepare=lambda *_: bpy.ops.rfgs.guess_materials()),
        Step("color_materials", label="color"),
        Step("color_materials", label="put colours back"),
        *repairs,
        Step("select_finding", prepare=find_something),
        Step("import_gaussians", prepare=name_files),
        Step("add_crop_box"),
        Step("update_display", prepare=spoil_display),
        Step("color_solid_view", prepare=show_points),
        Step("compare_gaussians", prepare=drop_crop),
        Step("import_result", prepare=finish_job),
        Step("show_paths"),
        Step("clear_paths"),
        Step("show_coverage", prepare=write_map),
        Step("clear_coverage"),
        Step("remove_data"),
        Step("import_ply", {"filepath": "{folder}/cloud.ply"}),
        Step("import_devices", {"directory": "{folder}/dataset"}),
        Step("import_capture", CAPTURE, name_environment),
        Step("follow_live", {"updates": 1}, send_an_update),
    ]


def item(name: str) -> bpy.types.Object:
    return bpy.data.objects[name]


def differing(_stage: Any, _folder: Path) -> None:
    chosen = bpy.context.view_layer.objects.active
    chosen.rfgs.rf.rx_cols = 3


def activate_crate(_stage: Any, _folder: Path) -> None:
    bpy.context.view_layer.objects.active = item("crate")


def name_environment(stage: Any, _folder: Path) -> None:
    stage.part("jobs.preferences").preferences().python = stage.arguments[1]


def send_an_update(stage: Any, _folder: Path) -> None:
    """Four Gaussians for whoever connects, once."""
    columns = list(stage.part("live.feed").NEEDED)
    data = np.full((4, len(columns)), 0.5, "<f4").tobytes()
    head = {"rfgs": 1, "time_s": 0.0, "count": 4, "columns": columns, "bytes": len(data)}
    server = socket.create_server(("127.0.0.1", 0))
    bpy.context.scene.rfgs.live.port = server.getsockname()[1]

    def answer() -> None:
        with server, server.accept()[0] as reader:
            reader.sendall(json.dumps(head).encode() + b"\n" + data)
            reader.recv(1)  # Until the reader goes.

    threading.Thread(target=answer, daemon=True).start()


def write_map(_stage: Any, folder: Path) -> None:
    """A map of four cells and one transmitter."""
    info = {"radio": "wifi", "cell_m": 0.5, "corner_m": [0.0, 0.0, 1.0], "devices": ["ap"]}
    bpy.context.scene.rfgs.coverage.path = str(folder / "coverage.json")
    (folder / "coverage.json").write_text(json.dumps({**info, "gain_db": [[[-40.0, -50.0]] * 2]}))


def find_something(_stage: Any, _folder: Path) -> None:
    for other in bpy.context.selected_objects:
        other.select_set(False)
    item("ap").location = (-5, 1, 1.2)
    bpy.context.view_layer.update()
    bpy.ops.rfgs.check_scene()
    window = bpy.context.window_manager.rfgs.check
    window.active = [row.kind for row in window.rows].index("device_outside")


def name_files(_stage: Any, folder: Path) -> None:
    said = bpy.context.scene.rfgs
    said.gaussians.path, said.paths.dataset = str(folder / "cloud.ply"), str(folder / "dataset")


def spoil_display(stage: Any, _folder: Path) -> None:
    display = stage.part("gaussians.display")
    display.set_display(item("Gaussians static"), display.Display(size=3.0))


def show_points(_stage: Any, _folder: Path) -> None:
    bpy.context.scene.rfgs.gaussians.solid_view = False


def drop_crop(_stage: Any, _folder: Path) -> None:
    bpy.context.scene.rfgs.gaussians.use_crop = False


def finish_job(stage: Any, folder: Path) -> None:
    queue, plans = stage.part("jobs.queue"), stage.part("jobs.plans")
    job = queue.Job(plans.TrainPlan(str(folder / "run"), str(folder / "dataset")), None)
    job.state = queue.DONE
    following = stage.part("jobs.following")
    following.QUEUE.jobs.append(job)
    following.show()
    stage.part("jobs.preferences").preferences().active_job = 0


def thin_wall(_stage: Any, _folder: Path) -> None:
    low, high = (-1.5, 1.9, 0), (1.5, 1.906, 2.5)
    x, y, z = zip(low, high, strict=True)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    mesh = bpy.data.meshes.new("wall")
    mesh.from_pydata([(a, b, c) for a in x for b in y for c in z], [], quads)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("wall", mesh))


def split(_stage: Any, _folder: Path) -> None:
    bpy.context.view_layer.objects.active = item("body")
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.edge_split()
    bpy.ops.object.mode_set(mode="OBJECT")
    # Further apart than the tracer closes by itself.
    for index, vertex in enumerate(item("body").data.vertices):
        vertex.co.x += 2e-5 * (index % 3 - 1)


def two_radios(_stage: Any, _folder: Path) -> None:
    for index in range(2):
        bpy.ops.rfgs.add_device(role="ACCESS_POINT", location=(index - 0.5, -1, 1.2))
    bpy.context.view_layer.objects.active.rfgs.rf.rx_cols = 5


def floorboard(_stage: Any, _folder: Path) -> None:
    bpy.data.materials["Concrete Floor"].rfgs.radio_material = "floorboard"


def hundredfold(_stage: Any, _folder: Path) -> None:
    bpy.context.scene.unit_settings.scale_length = 100.0


def move_device(place: tuple[float, float, float]) -> Callable[[Any, Path], None]:
    def move(_stage: Any, _folder: Path) -> None:
        item("ap").location = place

    return move


#: Kind of finding → what brings it about.
BREAK: dict[str, Callable[[Any, Path], None]] = {
    "double_sheet": thin_wall,
    "split_body": split,
    "inside_out": lambda *_: item("body").data.flip_normals(),
    "device_inside": move_device((1.6, 1.2, 0.3)),
    "device_outside": move_device((-5, 1, 1.2)),
    "devices_differ": two_radios,
    "material_band": floorboard,
    "unit_scale": hundredfold,
}
