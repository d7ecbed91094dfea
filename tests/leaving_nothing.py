# SPDX-License-Identifier: Apache-2.0
"""What `addon_rfgs/use_and_leave.py` is given, and what it must have told afterwards."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from plyfile import PlyData, PlyElement

from rfgs_core.dataset.path_store import write_paths
from rfgs_core.radio.path_table import PathTable

SCRIPT = Path(__file__).parent / "addon_rfgs" / "use_and_leave.py"


def write_material(folder: Path) -> None:
    """Gaussians and paths to import."""
    names = [*"xyz", "f_dc_0", "f_dc_1", "f_dc_2", "opacity"]
    names += [f"scale_{i}" for i in range(3)] + [f"rot_{i}" for i in range(4)]
    rows = np.ones(20, [(name, "<f4") for name in names])
    rows["x"] = np.arange(20)
    PlyData([PlyElement.describe(rows, "vertex")]).write(str(folder / "cloud.ply"))
    sequence = folder / "dataset" / "room"
    sequence.mkdir(parents=True)
    pose = {"quat_wxyz": [1.0, 0.0, 0.0, 0.0], "role": "ACCESS_POINT"}
    devices = [{"name": name, "position_m": [x, 0.0, 1.2], **pose} for x, name in enumerate("ab")]
    info = {"frames": [1], "devices": {"wifi": devices}, "radios": {"wifi": {}}}
    (sequence / "sequence.json").write_text(json.dumps(info))
    one, angle = np.zeros(1, np.int32), np.zeros(1, np.float32)
    table = PathTable(
        *(one, one + 1, one, one + 1),
        np.ones((1, 1, 1), np.complex64),
        np.array([5.8e9]),
        np.array([1e-8]),
        *[angle] * 5,
        np.zeros((1, 1), np.uint8),
        np.zeros((1, 1), np.int32),
        np.array([[[0, 0, 0], [3, 0, 0], [3, 0, 0]]], np.float32),
    )
    file = sequence / "radio" / "wifi" / "paths" / "000001.npz"
    file.parent.mkdir(parents=True)
    write_paths(file, table)


def compare(folder: Path) -> None:
    """What `use_and_leave.py` told is the same at every time but while RF-GS was used."""
    told: dict[str, Any] = json.loads((folder / "told.json").read_text())
    before = told["before"]
    used = told["used"]
    assert len(used["data"]) > len(before["data"]) + 10 and used["types"], "it was used"
    assert len(used["import menu"]) == len(before["import menu"]) + 1
    stored = [row["properties"] | row["system"] for row in used["data"].values()]
    assert sum("rfgs" in row for row in stored) > 5
    for name in ("looked", "after"):
        for part in before:
            assert told[name][part] == before[part], f"{name}: {part}"
    # Without their users, things of before are not saved either; handlers were another add-on's.
    assert told["saved"]["data"] == before["data"]
    assert told["saved"]["keys"] == before["keys"]
