# SPDX-License-Identifier: Apache-2.0
"""Sizes that files declare are held against schema and file before anything is allocated."""

from __future__ import annotations

import json
import os
import resource
import shutil
import struct
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dataset_factory.make.impair import impair_dataset
from rfgs_core.arrays import load_arrays
from rfgs_core.dataset import open_dataset
from rfgs_core.dataset.pictures import read_planes, write_exr
from rfgs_core.dataset.store_schema import check_store
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.gaussians.ply import read_ply
from rfgs_core.radio.files import read_radio
from rfgs_core.radio.impairments import IMPAIRMENT_PRESETS

#: Bytes of a bomb's content, far beyond the memory that is allowed.
BOMB_BYTES = 2**31 - 2**22


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


def zeros(file: Path, frames: int) -> None:
    """Writes zstd frames of zeros, packed to almost nothing: blocks that repeat a byte."""
    head = b"\x28\xb5\x2f\xfd\xe0" + struct.pack("<Q", BOMB_BYTES // frames)
    count = BOMB_BYTES // frames // 2**17
    block = struct.pack("<I", 2**17 << 3 | 2)[:3] + b"\0"
    last = struct.pack("<I", 2**17 << 3 | 3)[:3] + b"\0"
    file.write_bytes((head + block * (count - 1) + last) * frames)


@pytest.mark.parametrize("frames", [1, 2])
@pytest.mark.parametrize("name", ["csi/c/0/0/0/0", "csi_static/c/0/0/0", "freq_hz/c/0"])
def test_chunks_that_unpack_to_gigabytes(
    tiny_dataset: Path, tmp_path: Path, name: str, frames: int
) -> None:
    data = shutil.copytree(tiny_dataset, tmp_path / "data")
    file = data / "tiny/radio/wifi/csi.zarr" / name
    zeros(file, frames)
    assert file.stat().st_size < 100_000
    sequence = open_dataset(data).sequence()
    with pytest.raises(RfgsFormatError, match="truncated or damaged CSI chunk"):
        sequence.coordinates("wifi"), sequence.csi("wifi", 1), sequence.csi_static("wifi")


@pytest.mark.parametrize("name", ["csi/c/0/0/0/0", "depth", "freq_hz/c/0"])
def test_files_with_holes(tiny_dataset: Path, tmp_path: Path, name: str) -> None:
    data = shutil.copytree(tiny_dataset, tmp_path / "data")
    store = data / "tiny/radio/wifi/csi.zarr"
    os.truncate(data / "tiny/depth/cam00/000001.exr" if name == "depth" else store / name, 2**32)
    sequence = open_dataset(data).sequence()
    with pytest.raises(RfgsFormatError, match=r"damaged"):
        sequence.coordinates("wifi"), sequence.csi("wifi", 1), sequence.depth("cam00", 1)


@pytest.mark.parametrize(
    ("shape", "chunk", "said"),
    [
        ([2**26], [2**26], "chunks up to 256 MiB"),
        ([2**26], [2**10], "coordinates up to 268435456 bytes"),
        ([2**16], [1], "up to 10000 chunks"),
    ],
)
def test_coordinates_of_a_store(
    tiny_dataset: Path, tmp_path: Path, shape: list[int], chunk: list[int], said: str
) -> None:
    data = shutil.copytree(tiny_dataset, tmp_path / "data")
    store = data / "tiny/radio/wifi/csi.zarr"
    about = json.loads((store / "freq_hz/zarr.json").read_text())
    about["shape"], about["chunk_grid"]["configuration"]["chunk_shape"] = shape, chunk
    about["dimension_names"] = ["device"]
    (store / "cfo_hz").mkdir()
    (store / "cfo_hz/zarr.json").write_text(json.dumps(about))
    with pytest.raises(RfgsFormatError, match=said):
        check_store(store)


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
            for _ in range(600):
                stream.write(zeros)
    assert file.stat().st_size < 2**20
    assert list(load_arrays(file, "", {"wanted": ("M",)}, seal=False)) == ["wanted"]
    with pytest.raises(RfgsFormatError, match="expected up to 268435456"):
        load_arrays(file, "", seal=False)


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


def test_channels_of_an_exr(tmp_path: Path) -> None:
    file, plane = tmp_path / "a.exr", np.zeros((2048, 2048), np.float16)
    write_exr(file, {f"c{index}": plane for index in range(30)})
    assert file.stat().st_size < 2_000_000
    with pytest.raises(RfgsFormatError, match="30 channels of 2048 x 2048 pixels are too large"):
        read_planes(file, "Z")


def test_settings_that_are_nested_without_end(tiny_dataset: Path, tmp_path: Path) -> None:
    data = Path(shutil.copytree(tiny_dataset, tmp_path / "data"))
    impair_dataset(data, IMPAIRMENT_PRESETS["lab"])
    file = data / "tiny/radio/wifi/csi.zarr/csi_impaired/zarr.json"
    about = json.loads(file.read_text())
    about["attributes"]["impairments"] = "[" * 20_000
    file.write_text(json.dumps(about))
    with pytest.raises(RfgsFormatError, match="damaged settings"):
        open_dataset(data).sequence().impairments("wifi")
