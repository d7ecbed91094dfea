# SPDX-License-Identifier: Apache-2.0
"""What the add-on reads, in Blender's own Python: Gaussians, records of jobs, paths, overrides."""

from __future__ import annotations

import dataclasses
import json
import sys
from pathlib import Path
from typing import Any

import mutations
import numpy as np
from formats import Format, add_path_table
from tiny_dataset import write_tiny_dataset

from addon_rfgs.devices.captured import FORM, recorded_devices
from addon_rfgs.gaussians.clouds import read_features
from addon_rfgs.gaussians.ply import read_columns, write_columns
from addon_rfgs.jobs.plans import GeneratePlan
from addon_rfgs.jobs.record import Record, read_record, record_file, write_record
from addon_rfgs.paths.dataset import open_path_dataset, read_paths, read_sequence, recorded_frames
from addon_rfgs.scene.override_file import read_overrides

sys.path.append(str(Path(__file__).resolve().parents[1] / "addon_rfgs"))
from splat_files import save_sealed, write_sealed


def make_addon(folder: Path) -> list[Format]:
    """Writes sound files of all formats that the add-on reads."""
    folder.mkdir(parents=True)
    ply, names = folder / "a.ply", ("x", "y", "z", "opacity", "rot_0", "f_dc_0")
    columns = {name: np.arange(5, dtype=np.float32) for name in names}
    write_sealed(ply, np.zeros(5, [(name, "<f4") for name in names]))
    save_sealed(
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

    data = write_tiny_dataset(folder / "data")
    tables = add_path_table(data)
    sequence = data / "tiny/sequence.json"

    def traced() -> Any:
        opened = open_path_dataset(data)
        return [opened, recorded_frames(opened, "wifi"), read_paths(opened, "wifi", 1)]

    def posed() -> Any:
        return recorded_devices(*read_sequence(data, FORM), "")

    features, alone = ply.with_suffix(".features.npz"), folder / "alone.ply"
    write_columns(alone, columns)
    job = record_file(plan)
    return [
        Format(
            "add-on: ply", alone, mutations.numbers_of, lambda: read_columns(alone), theirs=True
        ),
        Format("add-on: ply of a run", ply, mutations.numbers_of, lambda: read_features(ply, 5)),
        Format("add-on: features", features, mutations.arrays_of, lambda: read_features(ply, 5)),
        Format("add-on: job", job, mutations.json_of, lambda: read_record(job)),
        Format("add-on: paths", tables, mutations.arrays_of, traced, data),
        Format("add-on: sequence.json", sequence, mutations.json_of, traced, data),
        Format("add-on: devices", sequence, mutations.json_of, posed, data),
        Format("add-on: overrides", overrides, mutations.json_of, described, theirs=True),
    ]
