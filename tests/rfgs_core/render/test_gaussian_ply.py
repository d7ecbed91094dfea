# SPDX-License-Identifier: Apache-2.0
"""PLY files of Gaussians: bit-exact round trip, 3DGS conventions, damaged files."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
import torch
from plyfile import PlyData, PlyElement

from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.gaussians import Gaussians
from rfgs_core.gaussians.ply import GaussianCloud, cloud_of, read_ply, write_ply
from rfgs_core.render.bench import random_cloud


@pytest.fixture
def cloud() -> GaussianCloud:
    gaussians, rgb, _ = random_cloud(50, 32, seed=1)
    power = np.linspace(-90, -50, 50, dtype=np.float32)
    return cloud_of(gaussians, rgb.numpy(), power)


def test_round_trip_is_bit_exact(cloud: GaussianCloud, tmp_path: Path) -> None:
    file = tmp_path / "new" / "cloud.ply"
    write_ply(file, cloud)
    again = read_ply(file)
    for field in fields(cloud):
        expected, got = getattr(cloud, field.name), getattr(again, field.name)
        assert got.dtype == np.float32
        assert got.tobytes() == expected.tobytes(), field.name
    assert [path.name for path in file.parent.iterdir()] == ["cloud.ply"]
    assert again.to_gaussians().means.numpy().tobytes() == cloud.means.tobytes()


def test_plyfile_reads_3dgs_conventions(gaussians, tmp_path: Path) -> None:
    one = gaussians([[1.0, 2.0, 3.0]], sigma_m=0.05, opacity=0.25)
    write_ply(tmp_path / "one.ply", cloud_of(one, np.array([[0.5, 1.0, 0.0]])))
    data = PlyData.read(str(tmp_path / "one.ply"))
    assert not data.text and data.byte_order == "<"
    names = [prop.name for prop in data["vertex"].properties]
    assert (
        names
        == (
            "x y z nx ny nz f_dc_0 f_dc_1 f_dc_2 opacity "
            "scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3"
        ).split()
    )
    row = data["vertex"][0]
    assert [row["x"], row["y"], row["z"]] == [1.0, 2.0, 3.0]
    assert 1 / (1 + np.exp(-row["opacity"])) == pytest.approx(0.25)
    assert np.exp(row["scale_1"]) == pytest.approx(0.05)
    assert [row[f"rot_{i}"] for i in range(4)] == [1.0, 0.0, 0.0, 0.0]
    # The viewer computes rgb = 0.5 + 0.28209479 f_dc.
    shown = [0.5 + 0.28209479177 * row[f"f_dc_{i}"] for i in range(3)]
    np.testing.assert_allclose(shown, [0.5, 1.0, 0.0], atol=1e-6)


def test_files_of_other_programs_are_read(cloud: GaussianCloud, tmp_path: Path) -> None:
    """Doubles, other order, harmonics of higher degree, text, another element."""
    names = ["opacity", "x", "y", "z", *(f"f_dc_{i}" for i in range(3)), "f_rest_0"]
    names += [*(f"scale_{i}" for i in range(3)), *(f"rot_{i}" for i in range(4))]
    table = np.zeros(len(cloud), dtype=[(name, "<f8") for name in names])
    for index in range(3):
        table["xyz"[index]] = cloud.means[:, index]
        table[f"f_dc_{index}"] = cloud.f_dc[:, index]
        table[f"scale_{index}"] = cloud.log_scales[:, index]
    for index in range(4):
        table[f"rot_{index}"] = cloud.quats[:, index]
    table["opacity"] = cloud.logit_opacities
    file = tmp_path / "other.ply"
    PlyData([PlyElement.describe(table, "vertex")], text=True).write(str(file))
    again = read_ply(file)
    np.testing.assert_allclose(again.quats, cloud.quats, rtol=1e-6)
    np.testing.assert_allclose(again.rgb, cloud.rgb, atol=1e-6)
    assert again.rf_power_db is None


def test_grey_without_colours_and_empty_set(tmp_path: Path) -> None:
    write_ply(tmp_path / "none.ply", cloud_of(Gaussians.none()))
    assert len(read_ply(tmp_path / "none.ply")) == 0
    gaussians, _, _ = random_cloud(3, 32, seed=1)
    np.testing.assert_array_equal(cloud_of(gaussians).rgb, np.full((3, 3), 0.5, np.float32))


@pytest.mark.parametrize("share", [0.3, 0.8, 0.999])
def test_truncated_file_is_refused_by_name(cloud, tmp_path: Path, share: float) -> None:
    file = tmp_path / "cut.ply"
    write_ply(file, cloud)
    data = file.read_bytes()
    file.write_bytes(data[: int(share * len(data))])
    with pytest.raises(RfgsFormatError, match=r"cut\.ply"):
        read_ply(file)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"not a ply",
        bytes(range(256)),
        b"ply\n",
        b"ply\nformat ascii 1.0\nend_header\n",
        b"ply\nformat binary_little_endian 1.0\nelement vertex -5\nend_header\n",
        b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\nseven\n",
        b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n7\n",
    ],
)
def test_garbage_is_refused(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "bad.ply"
    file.write_bytes(content)
    with pytest.raises(RfgsFormatError, match=r"bad\.ply"):
        read_ply(file)


def test_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(RfgsError, match="no such file"):
        read_ply(tmp_path / "nowhere.ply")


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_values_that_are_not_finite_are_refused(cloud, tmp_path: Path, value: float) -> None:
    file = tmp_path / "nan.ply"
    write_ply(file, cloud)
    data = bytearray(file.read_bytes())
    broken = replace(cloud, log_scales=cloud.log_scales.copy())
    broken.log_scales[7, 1] = value
    with pytest.raises(RfgsFormatError, match=r"log_scales .* first row 7"):
        write_ply(file, broken)
    assert file.read_bytes() == bytes(data)  # a refused write leaves the old file alone
    header = data.index(b"end_header\n") + len(b"end_header\n")
    data[header + 4 : header + 8] = np.float32(value).tobytes()
    file.write_bytes(bytes(data))
    with pytest.raises(RfgsFormatError, match=r"means .* first row 0"):
        read_ply(file)


def test_zero_rotation_and_wrong_shape_are_refused(cloud, tmp_path: Path) -> None:
    with pytest.raises(RfgsFormatError, match="quaternion is zero"):
        write_ply(tmp_path / "a.ply", replace(cloud, quats=np.zeros_like(cloud.quats)))
    object.__setattr__(cloud, "f_dc", cloud.f_dc[:-1])  # past the type check of the tests
    with pytest.raises(RfgsFormatError, match="f_dc has shape"):
        write_ply(tmp_path / "a.ply", cloud)
    assert list(tmp_path.iterdir()) == []


def test_gaussians_survive_the_file(cloud: GaussianCloud, tmp_path: Path) -> None:
    gaussians, _, _ = random_cloud(50, 32, seed=1)
    write_ply(tmp_path / "cloud.ply", cloud)
    features = torch.arange(50 * 32, dtype=torch.float32).reshape(50, 32)
    again = read_ply(tmp_path / "cloud.ply").to_gaussians(features.numpy())
    assert torch.equal(again.covariances, gaussians.covariances)
    assert torch.equal(again.features, features)


def test_headers_that_promise_too_much_or_lists_are_refused(cloud, tmp_path: Path) -> None:
    file = tmp_path / "hostile.ply"
    write_ply(file, cloud)
    header, _ = file.read_bytes().split(b"end_header\n")
    text = header.decode().replace("binary_little_endian", "ascii")
    file.write_text(text.replace("vertex 50", "vertex 1000000000000000") + "end_header\n")
    with pytest.raises(RfgsFormatError, match=r"hostile\.ply: .*not a whole PLY"):
        read_ply(file)
    lists = text.replace("vertex 50", "vertex 1").replace("float x", "list uchar float x")
    numbers = " ".join(["2 0 0", *["0"] * 17])
    file.write_text(f"{lists}end_header\n{numbers}\n")
    with pytest.raises(RfgsFormatError, match=r"vertex properties \['x'\] are lists"):
        read_ply(file)
