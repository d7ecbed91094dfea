# SPDX-License-Identifier: Apache-2.0
"""What else is read: poses of a bundle, a learned background, layouts, packets, reports, cells."""

from __future__ import annotations

import shutil
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import mutations
import numpy as np
from bundle_files import describe_bundle
from formats import Format

from dataset_factory.scene.bundle import read_bundle
from dataset_factory.scene.motion import read_motion, read_velocity
from dataset_factory.scene.outline import Outline, read_outline_file
from dataset_factory.scene.report_rows import read_report
from rfgs_core.arrays import save_arrays
from rfgs_core.articulated.space import SHAPE_SPACE, read_shape_space
from rfgs_core.capture.layout_file import read_layout
from rfgs_core.errors import RfgsFormatError
from rfgs_core.files import read_json
from rfgs_core.live.counts import Counts
from rfgs_core.live.records import READERS, Packets, decode
from rfgs_core.run import open_run
from rfgs_core.seals import write_sealed_json
from rfgs_core.study.cell_rows import method_rows, method_table
from rfgs_core.study.cells import settings_of, stored
from rfgs_core.study.paper_tables import SIZES, TABLES, cells

sys.path.append(str(Path(__file__).resolve().parents[1] / "rfgs_core/live"))
from sending import esp32_stream, feitcsi_stream, picoscenes_stream

LAYOUT = """name: lab
radio: ax210
centre_hz: 5.5e9
fps: 10
bounds_m: [[0, 0, 0], [5, 4, 3]]
rx_spacing_m: 0.03
devices:
  - {name: sender, role: TRANSMITTER, position_m: [0, 0, 1]}
  - name: receiver
    role: RECEIVER
    position_m: [3, 0, 1]
    quat_wxyz: [1, 0, 0, 0]
    file: receiver.csi
    offset_s: 0.5
"""
REPORT = {
    "file": "a.blend",
    "scene": {
        "frames": [1, 2], "frame_start": 1, "frame_end": 2, "fps": 10.0, "unit_scale_m": 1.0,
        "bounds_m": [[0, 0, 0], [1, 1, 1]],
    },
    "objects": [
        {"name": "o", "class": "person", "moving": True, "instance": "p", "triangles": 12,
         "size_m": [1, 1, 1],
         "materials": [{"name": "m", "radio_material": "skin", "why": "said"}]}
    ],
    "cameras": [{"name": "cam00", "made_up": False}], "lights": "its own",
    "instances": [{"name": "p", "person": True, "joints": "17 joints known"}],
    "devices": [{"name": "d", "radio": "wifi", "role": "RECEIVER", "position_m": [0, 0, 1]}],
    "guesses": [{"object": "o", "what": "material", "value": "skin", "why": "armature"}],
    "findings": [
        {"kind": "a", "severity": "warning", "object": "o", "message": "b", "remedy": "c"}
    ],
}  # fmt: skip


def make_others(folder: Path, run: Path, bundle: Path) -> list[Format]:
    """Writes sound files of what is left.

    Args:
        folder: Where to.
        run: A trained run.
        bundle: A scene bundle.
    """
    folder.mkdir(parents=True)
    (folder / "layout.yaml").write_text(LAYOUT)
    space = Path(shutil.copy(SHAPE_SPACE, folder / "people.npz"))
    return [
        _background(Path(shutil.copytree(run, folder.parent / "learned"))),
        *_moving(Path(shutil.copytree(bundle, folder / "bundle"))),
        *_reports(folder),
        _cell(folder),
        Format(
            "layout of a capture", folder / "layout.yaml", mutations.text_of,
            lambda: read_layout(folder / "layout.yaml"), theirs=True,
        ),
        Format("shape space", space, mutations.arrays_of, lambda: read_shape_space(space)),
        *_packets(folder),
    ]  # fmt: skip


def _background(run: Path) -> Format:
    """What a run has learned of the empty room."""
    file = run / "config.json"
    write_sealed_json(file, {**read_json(file), "background": "learned"})
    seen = open_run(run).sequence.csi_static("wifi")
    save_arrays(run / "background.npz", {"empty": np.zeros(seen.shape[-3:], np.complex64)})
    return Format(
        "learned background", run / "background.npz", mutations.arrays_of,
        lambda: open_run(run).as_reported(1),
    )  # fmt: skip


def _moving(bundle: Path) -> list[Format]:
    """Poses between frames, and velocities."""
    file = bundle / "frames/000001.npz"
    with np.load(file) as found:
        arrays = {name: found[name] for name in found.files}
    body = arrays["vertices"]
    more = {
        "pose_offset_s": np.array([0.01, 0.02]),
        "pose_vertices": np.stack([body, body]),
        "vertex_velocity": np.ones_like(body),
    }
    np.savez(file, **{**arrays, **more})
    poses = [{"span_s": 0.02, "offset_s": [0.01, 0.02]}]
    describe_bundle(bundle, {**read_bundle(bundle).info, "poses": poses})

    def read() -> Any:
        opened = read_bundle(bundle)
        motion = read_motion(opened, 1, 0.02)
        at = motion.at(0.015)
        return [motion.offset_s, motion.vertices, at, read_velocity(opened, 1)]

    return [
        Format("poses and velocities", file, mutations.arrays_of, read),
        Format("bundle.json with poses", bundle / "bundle.json", mutations.json_of, read),
    ]


def _reports(folder: Path) -> list[Format]:
    """What the add-on tells of a scene."""
    check, outline = (folder / f"{name}.json" for name in ("check", "outline"))
    write_sealed_json(check, REPORT)
    devices = [{"name": "d", "radio": "wifi", "role": "RECEIVER"}]
    write_sealed_json(outline, asdict(Outline([1, 2], devices, 1, 0.75, 1, 10.0)))
    return [
        Format("scene report", check, mutations.json_of, lambda: read_report(check)),
        Format("outline", outline, mutations.json_of, lambda: read_outline_file(outline)),
    ]


def _cell(folder: Path) -> Format:
    """One method of table 1."""
    size = SIZES["smoke"]
    cell = cells(TABLES["table1"], size, 1)[0]
    groups = {"geometry": {"f05": 0.5, "centroid_m": None}, "rf": {"element_snr_db": 3.0}}
    made = {**asdict(cell), "settings": settings_of(cell, size), "train_s": 1.5}
    file = folder / f"cells/{cell.name}.json"
    write_sealed_json(file, {**made, "methods": {"rfgs": groups, "zero": groups}})

    def read() -> Any:
        found = stored(cell, folder, size)
        if found is None:
            raise RfgsFormatError("made with other settings")
        return [found, method_table(method_rows([found]))]

    return Format("cell of table 1", file, mutations.json_of, read)


def _packets(folder: Path) -> list[Format]:
    """Datagrams of a radio, one of each format."""
    sound: dict[Packets, bytes] = {
        "feitcsi": feitcsi_stream(1)[0][0],
        "picoscenes": picoscenes_stream(1)[0][0],
        "esp32": esp32_stream(1, folder)[0],
    }
    return [_packet(folder / f"{name}.packet", name, data) for name, data in sound.items()]


def _packet(file: Path, name: Packets, data: bytes) -> Format:
    file.write_bytes(data)

    def read() -> Any:
        found, reader, counts = file.read_bytes(), READERS[name], Counts()
        # As `rfgs live` does: only whole records are decoded, and what does not decode is counted.
        heard = decode(reader, [(0.0, found)], counts) if reader.is_record(found) else []
        if not heard:
            raise RfgsFormatError("malformed")
        return heard[0].capture

    return Format(f"packet of {name}", file, mutations.bytes_of, read, theirs=True)
