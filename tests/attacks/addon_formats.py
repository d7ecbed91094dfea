# SPDX-License-Identifier: Apache-2.0
"""What the add-on reads, in Blender's own Python: Gaussians, records of jobs, paths, overrides."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import mutations
import numpy as np
from formats import Format, write_path_table

from addon_rfgs.devices.recorded import FORM, recorded_devices
from addon_rfgs.gaussians.features import read_features
from addon_rfgs.gaussians.ply import read_columns, write_columns
from addon_rfgs.jobs.plans import GeneratePlan
from addon_rfgs.jobs.record import Record, read_record, record_file, write_record
from addon_rfgs.paths.dataset import open_path_dataset, read_paths, read_sequence, recorded_frames
from addon_rfgs.scene.override_file import read_overrides
from addon_rfgs.tables import RADIO_FIELDS


def make_addon(folder: Path) -> list[Format]:
    """Writes sound files of all formats that the add-on reads."""
    folder.mkdir(parents=True)
    ply, names = folder / "a.ply", ("x", "y", "z", "opacity", "rot_0", "f_dc_0")
    write_columns(ply, {name: np.arange(5, dtype=np.float32) for name in names})
    np.savez(
        ply.with_suffix(".features.npz"), features=np.ones((5, 32), np.float32),
        gamma=np.ones((5, 1), np.complex64), rf_power_db=np.ones(5, np.float32),
        track_id=np.arange(5), body=np.zeros(5, np.int64),
    )  # fmt: skip
    plan = GeneratePlan(str(folder / "out"), "/a.blend")
    write_record(Record(plan, 1234, "99"))
    overrides = folder / "overrides.json"
    overrides.write_text(
        json.dumps(
            {"fps": 30, "unit_scale": 1.0, "people": ["A"], "room": "box", "label": "x",
             "cameras": {"ring": 3}, "materials": {"Wall*": "concrete"},
             "bounds_m": [[0, 0, 0], [1, 2, 3]], "frame_range": "1:9"}
        )
    )  # fmt: skip

    def described() -> Any:
        found = read_overrides(overrides)
        return {spec.name: repr(getattr(found, spec.name)) for spec in dataclasses.fields(found)}

    sequence = folder / "room"
    tables = sequence / "radio/wifi/paths"
    tables.mkdir(parents=True)
    pose = {"position_m": [0.0, 1.0, 2.0], "quat_wxyz": [1.0, 0.0, 0.0, 0.0], "role": "RECEIVER"}
    about = {"frames": [1, 7], "devices": {"wifi": [{"name": "a", **pose}, {"name": "b", **pose}]}}
    about["radios"] = {"wifi": RADIO_FIELDS["wifi"]}
    about["objects"] = [{"id": 1, "name": "wall"}]
    (sequence / "sequence.json").write_text(json.dumps(about))
    write_path_table(tables / "000001.npz")

    def traced() -> Any:
        opened = open_path_dataset(folder)
        return [opened, recorded_frames(opened, "wifi"), read_paths(opened, "wifi", 1)]

    def posed() -> Any:
        return recorded_devices(*read_sequence(folder, FORM), "")

    features = ply.with_suffix(".features.npz")
    return [
        Format("add-on: ply", ply, mutations.numbers_of, lambda: read_columns(ply)),
        Format("add-on: features", features, mutations.arrays_of, lambda: read_features(ply, 5)),
        Format(
            "add-on: job", record_file(plan), mutations.json_of,
            lambda: read_record(record_file(plan)),
        ),
        Format("add-on: paths", tables / "000001.npz", mutations.arrays_of, traced),
        Format(
            "add-on: sequence.json", sequence / "sequence.json", mutations.json_of, traced
        ),
        Format("add-on: devices", sequence / "sequence.json", mutations.json_of, posed),
        Format("add-on: overrides", overrides, mutations.json_of, described),
    ]  # fmt: skip
