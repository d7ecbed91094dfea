# SPDX-License-Identifier: Apache-2.0
"""Channels are read in place from any storage that fsspec knows; the rest asks for a folder."""

from __future__ import annotations

from pathlib import Path

import fsspec
import numpy as np
import pytest
import xarray

from rfgs_core.dataset import open_dataset
from rfgs_core.dataset.csi_store import create_csi, write_csi
from rfgs_core.errors import RfgsError
from rfgs_core.radio import DevicePose, frame_samples, layout, preset


@pytest.mark.parametrize("scheme", ["memory", "file"])
def test_xarray_reads_channels_from_object_storage(tmp_path: Path, scheme: str) -> None:
    radio = preset("wifi")
    poses = [DevicePose(f"ap{i}", (float(i), 0.0, 1.0), (1.0, 0.0, 0.0, 0.0)) for i in range(4)]
    local = tmp_path / "csi.zarr"
    create_csi(local, radio, layout(radio, poses), [3, 4], [0.0, 0.1], frame_samples(radio, 10.0))
    shape = xarray.open_zarr(local, consolidated=False)["csi"].shape
    value = np.arange(np.prod(shape[1:])).reshape(shape[1:]).astype(np.complex64)
    write_csi(local, 1, value, tmp_path / "marker")
    address = f"memory://bucket-{tmp_path.name}/csi.zarr"
    if scheme == "memory":
        fsspec.filesystem("memory").put(str(local), address, recursive=True)
    else:
        address = f"file://{local}"
    with xarray.open_zarr(address, consolidated=False) as remote:
        assert np.array_equal(remote["csi"][1].values, value)
        assert np.array_equal(remote["frame"].values, [3, 4])
        assert remote["freq_hz"].attrs["units"] == "Hz"


def test_other_parts_ask_for_a_folder_in_one_line() -> None:
    with pytest.raises(RfgsError, match=r"datasets are opened from folders; .*xarray.open_zarr"):
        open_dataset("s3://bucket/dataset")
