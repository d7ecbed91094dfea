# SPDX-License-Identifier: Apache-2.0
"""Sizes that files declare are held against schema and file before anything is allocated."""

from __future__ import annotations

import json
import resource
import shutil
import struct
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rfgs_core.arrays import load_arrays
from rfgs_core.dataset import open_dataset
from rfgs_core.dataset.pictures import read_planes, write_exr
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.gaussians.ply import read_ply
from rfgs_core.radio.files import read_radio


@pytest.fixture(autouse=True)
def little_memory() -> Any:
    """Whatever takes half a gigabyte more than the process has fails the test."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    yield
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 512 * 1024


@pytest.mark.parametrize(
    ("field", "value"),
    [("rx_rows", 3_000_000), ("tx_cols", 10**9), ("num_subcarriers", 10**10)],
)
def test_radios_of_a_dataset(tiny_dataset: Path, tmp_path: Path, field: str, value: int) -> None:
    data = shutil.copytree(tiny_dataset, tmp_path / "data")
    file = data / "tiny/sequence.json"
    info = json.loads(file.read_text())
    info["radios"]["wifi"][field] = value
    file.write_text(json.dumps(info))
    with pytest.raises(RfgsFormatError, match=r"sequence\.json: radio 'wifi': "):
        open_dataset(data).sequence().layout("wifi")


@pytest.mark.parametrize("field", ["samples_per_frame", "num_devices", "num_subcarriers"])
def test_radios_of_ones_own(tmp_path: Path, field: str) -> None:
    (tmp_path / "lab.yaml").write_text(f"like: wifi\n{field}: 3000000000\n")
    with pytest.raises(RfgsError, match=f"{field}: 3000000000: expected at most"):
        read_radio(tmp_path / "lab.yaml")


def test_an_extra_member_is_not_read_and_a_bomb_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "a.npz"
    np.savez(file, wanted=np.ones(3))
    zeros = bytes(2**20)
    with zipfile.ZipFile(file, "a", zipfile.ZIP_DEFLATED) as archive:
        with archive.open("extra.npy", "w", force_zip64=True) as stream:
            for _ in range(1500):
                stream.write(zeros)
    assert file.stat().st_size < 2**21
    assert list(load_arrays(file, "", {"wanted": ("M",)})) == ["wanted"]
    with pytest.raises(RfgsFormatError, match="expected up to 268435456"):
        load_arrays(file, "")


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian"])
def test_counts_of_a_ply(tmp_path: Path, form: str) -> None:
    names = [*"xyz", "opacity", *(f"{name}_{i}" for name in ("f_dc", "scale") for i in range(3))]
    names += [f"rot_{index}" for index in range(4)]
    head = [f"ply\nformat {form} 1.0\nelement vertex 2000000000"]
    head += [f"property float {name}" for name in names]
    (tmp_path / "a.ply").write_text("\n".join([*head, "end_header\n"]) + "0 " * 100)
    with pytest.raises(RfgsFormatError, match="2000000000 rows of 'vertex' do not fit into it"):
        read_ply(tmp_path / "a.ply")


def test_the_window_of_an_exr(tmp_path: Path) -> None:
    file = tmp_path / "a.exr"
    write_exr(file, {"Z": np.ones((4, 4), np.float32)})
    window, data = struct.pack("<4i", 0, 0, 3, 3), file.read_bytes()
    file.write_bytes(data.replace(window, struct.pack("<4i", 0, 0, 99_999, 99_999)))
    with pytest.raises(RfgsFormatError, match="too large"):
        read_planes(file, "Z")
