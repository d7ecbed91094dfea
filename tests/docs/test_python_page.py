# SPDX-License-Identifier: Apache-2.0
"""The blocks of docs/python.md run, and it shows the whole public interface."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest

import rfgs_core

TEXT = (Path(__file__).resolve().parents[2] / "docs" / "python.md").read_text("utf-8")
BLOCKS = re.findall(r"^```python\n(.*?)^```$", TEXT, re.MULTILINE | re.DOTALL)


def test_blocks_run(tiny_dataset: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree(tiny_dataset, tmp_path / "my_dataset")
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    assert len(BLOCKS) >= 8
    for code in BLOCKS:
        exec(compile(code, "docs/python.md", "exec"), names)
    # The profile peaks at the straight line between both devices.
    layout = names["layout"]
    tx = layout.tx_xyz[layout.tx_device == 0].mean(axis=0)
    rx = layout.rx_xyz[layout.rx_device == 2].mean(axis=0)
    found = names["length_m"][np.abs(names["profile"]).mean((0, 1)).argmax()]
    assert abs(found - np.linalg.norm(tx - rx)) < 0.6 * names["length_m"][1]
    assert len(names["gaussians"]) == 200 == len(names["cloud"])
    assert np.isfinite(names["predicted"]).all() and np.isfinite(names["prediction"].csi).all()


def test_every_public_name_is_shown() -> None:
    code = "\n".join(BLOCKS)
    public = set(rfgs_core.__all__) - {"__version__", "Gaussians"}
    imported = set(re.findall(r"\w+", " ".join(re.findall(r"from rfgs_core import (.*)", code))))
    assert imported == public
    for name in rfgs_core.__all__:
        assert getattr(rfgs_core, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'open_datset'"):
        rfgs_core.open_datset  # noqa: B018
