# SPDX-License-Identifier: Apache-2.0
"""Stores of channels hold Zarr 3 with the schema's arrays, types and codecs, and nothing else."""

from __future__ import annotations

import json
import pickle
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rfgs_core.dataset import open_dataset
from rfgs_core.errors import RfgsError


class Trap:
    """Makes a file when it is unpickled."""

    def __init__(self, file: Path) -> None:
        self.file = file

    def __reduce__(self) -> tuple[Any, ...]:
        return Path.touch, (self.file,)


@pytest.fixture
def data(tiny_dataset: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(tiny_dataset, tmp_path / "data"))


def read_all(data: Path) -> None:
    sequence = open_dataset(data).sequence()
    sequence.coordinates("wifi")
    sequence.csi("wifi", 1)
    sequence.csi_static("wifi")


def test_a_zarr_2_array_with_a_pickle_codec_is_refused(data: Path, tmp_path: Path) -> None:
    store, trap = data / "tiny/radio/wifi/csi.zarr", tmp_path / "ran"
    for name in ("freq_hz", "csi"):
        array = store / name
        kept = tmp_path / f"kept_{name}"
        array.rename(kept)
        array.mkdir()
        about = {
            "zarr_format": 2, "shape": [16], "chunks": [16], "dtype": "|O", "order": "C",
            "compressor": None, "fill_value": None, "filters": [{"id": "pickle", "protocol": 5}],
        }  # fmt: skip
        (array / ".zarray").write_text(json.dumps(about))
        (array / "0").write_bytes(pickle.dumps(Trap(trap)))
        with pytest.raises(RfgsError, match=rf"{name}/zarr\.json: no such file"):
            read_all(data)
        shutil.rmtree(array)
        kept.rename(array)
    assert not trap.exists()
    read_all(data)


def changed(*path: str | int, to: Any) -> Callable[[dict[str, Any]], None]:
    def change(about: Any) -> None:
        for key in path[:-1]:
            about = about[key]
        about[path[-1]] = to

    return change


PICKLE = {"name": "numcodecs.pickle", "configuration": {"protocol": 5}}


@pytest.mark.parametrize("name", ["freq_hz", "csi", "csi_static"])
@pytest.mark.parametrize(
    ("change", "message"),
    [
        (changed("codecs", to=[PICKLE]), "codecs: expected a list of length 2, found"),
        (changed("codecs", 1, to=PICKLE), r"codecs\[1\].name: expected zstd, found 'numcodecs"),
        (changed("codecs", 1, "name", to="gzip"), r"codecs\[1\].name: expected zstd, found 'gzip'"),
        (
            changed("data_type", to="string"),
            "data_type: expected bool or complex64 .* found 'string'",
        ),
        (changed("data_type", to="bool"), "expected (float64|complex64) over .*, found bool"),
        (changed("shape", 0, to=3_000_000), "expected [0-9]+, found 3000000"),
        (changed("shape", 0, to=-1), r"shape\[0\]: expected a whole number >= 0, found -1"),
        (changed("zarr_format", to=2), "zarr_format: expected 3, found 2"),
        (changed("storage_transformers", to=[PICKLE]), "storage_transformers: expected"),
        (changed("chunk_grid", "configuration", "chunk_shape", to=[2**31]), "expected"),
    ],
)
def test_what_no_store_of_ours_holds_is_refused_by_place(
    data: Path, name: str, change: Callable[[dict[str, Any]], None], message: str
) -> None:
    file = data / "tiny/radio/wifi/csi.zarr" / name / "zarr.json"
    about = json.loads(file.read_text())
    change(about)
    file.write_text(json.dumps(about))
    with pytest.raises(RfgsError, match=message) as caught:
        read_all(data)
    assert str(file.parent) in str(caught.value) and "\n" not in str(caught.value)


def test_missing_and_foreign_arrays_are_named(data: Path) -> None:
    store = data / "tiny/radio/wifi/csi.zarr"
    (store / "frame").rename(store / "labels")
    with pytest.raises(RfgsError, match="found frame missing; labels unknown"):
        read_all(data)


def test_sound_stores_are_read_as_before(data: Path) -> None:
    read_all(data)
    values = open_dataset(data).sequence().radio("wifi")
    assert values["csi"].dtype == np.complex64 and len(values["frame"]) == 2
