# SPDX-License-Identifier: Apache-2.0
"""The add-on's seals are those of the core, both ways."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rfgs_core import seals
from rfgs_core.arrays import save_arrays
from rfgs_core.gaussians import Gaussians
from rfgs_core.gaussians.ply import cloud_of, write_ply


def test_each_reads_what_the_other_wrote(tmp_path: Path) -> None:
    pytest.importorskip("bpy")
    from addon_rfgs import seals as own
    from addon_rfgs.errors import AddonError

    said = {"b": [1, 2.5], "a": "ä"}
    own.write_sealed_json(tmp_path / "own.json", said)
    seals.write_sealed_json(tmp_path / "core.json", said)
    assert (tmp_path / "own.json").read_bytes() == (tmp_path / "core.json").read_bytes()
    assert seals.read_sealed_json(tmp_path / "own.json", "") == said
    save_arrays(tmp_path / "a.npz", {"a": np.arange(5)})
    write_ply(tmp_path / "a.ply", cloud_of(Gaussians.none()))
    for name in ("core.json", "a.npz", "a.ply"):
        file = tmp_path / name
        own.check_seal(file, "do something")
        file.write_bytes(file.read_bytes() + b" ")
        with pytest.raises(AddonError, match=r"changed or damaged .*; do something"):
            own.check_seal(file, "do something")
    (tmp_path / "a.ply").write_text("ply")
    with pytest.raises(AddonError, match=r"no seal.*; do something"):
        own.check_seal(tmp_path / "a.ply", "do something")
