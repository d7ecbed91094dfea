# SPDX-License-Identifier: Apache-2.0
"""Reading PLYs and feature files, good and bad; `test_inside_blender.py` runs this file."""

from __future__ import annotations

import struct
import tracemalloc
import zipfile
from pathlib import Path

import bpy
import numpy as np
import pytest
from blank_file import open_blank_file
from splat_files import (
    BARE,
    COLUMNS,
    FORMATS,
    REST,
    rows_of,
    save_sealed,
    write,
    write_run,
    write_sealed,
)

from addon_rfgs.errors import AddonError
from addon_rfgs.gaussians import cloud_mesh, clouds, ply, splats
from addon_rfgs.gaussians.clouds import Inspection, import_gaussians
from addon_rfgs.seals import BLANK, sealed

pytestmark = pytest.mark.usefixtures("registered")


def test_gaussians_written_by_plyfile_are_read_with_activations(tmp_path: Path) -> None:
    rows = rows_of(COLUMNS, 50)
    cloud = splats.read_gaussians(write(tmp_path / "a.ply", rows))
    np.testing.assert_array_equal(cloud.means[:, 2], rows["z"])
    np.testing.assert_allclose(cloud.opacities, 1 / (1 + np.exp(-rows["opacity"])), rtol=1e-6)
    np.testing.assert_allclose(cloud.scales[:, 1], np.exp(rows["scale_1"]), rtol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(cloud.quats, axis=1), 1, rtol=1e-6)
    np.testing.assert_allclose(
        cloud.quats[:, 0] * np.abs(rows["rot_1"]),
        np.abs(cloud.quats[:, 1]) * rows["rot_0"],
        rtol=1e-5,
    )
    expected = np.clip(0.5 + 0.28209479177387814 * rows["f_dc_2"], 0, 1)
    np.testing.assert_allclose(cloud.colors[:, 2], expected, rtol=1e-6)


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("faces", [0, 3])
@pytest.mark.parametrize(
    ("names", "kinds"),
    [
        (BARE, {}),
        (COLUMNS, {}),
        ([*COLUMNS, *REST], {}),
        ([*COLUMNS, "red", "label", "time"], {"red": "u1", "label": "i4", "time": "f8"}),
        (["label", *COLUMNS[::-1]], {"label": "u4", "x": "f8"}),
    ],
    ids=["bare", "usual", "rest", "extra", "shuffled"],
)
def test_every_property_of_every_format_is_read_as_plyfile_wrote_it(
    tmp_path: Path, form: str, faces: int, names: list[str], kinds: dict[str, str]
) -> None:
    rows = rows_of(names, 20, **kinds)
    if "label" in kinds:
        rows["label"][0] = np.iinfo(rows["label"].dtype).max
    columns = ply.read_columns(write(tmp_path / "a.ply", rows, form, faces))
    assert list(columns) == names
    for name in names:
        assert columns[name].dtype == rows[name].dtype.newbyteorder("=")
        assert columns[name].tobytes() == rows[name].tobytes(), name
    again = tmp_path / "again.ply"
    ply.write_columns(again, columns)
    assert again.read_bytes() == write(tmp_path / "b.ply", rows).read_bytes()


def test_text_and_binary_of_one_cloud_are_the_same(tmp_path: Path) -> None:
    rows = rows_of([*COLUMNS, *REST], 3000, seed=4)
    binary = ply.read_columns(write(tmp_path / "binary.ply", rows))
    text = ply.read_columns(write(tmp_path / "text.ply", rows, "text"))
    assert all(text[name].tobytes() == binary[name].tobytes() for name in binary)


def test_elements_before_the_vertices_are_passed_over(tmp_path: Path) -> None:
    rows = rows_of(BARE, 5)
    path = write(tmp_path / "a.ply", rows)
    head, _, body = path.read_bytes().partition(b"end_header\n")
    extra = b"element camera 2\nproperty float f\nproperty uchar i\n"
    head = head.replace(b"element vertex", extra + b"element vertex")
    path.write_bytes(head + b"end_header\n" + b"\x07" * 10 + body)
    np.testing.assert_array_equal(ply.read_columns(path)["y"], rows["y"])


def bigger(count: bytes):
    return lambda data: data.replace(b"element vertex 50", b"element vertex " + count)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda data: data[:-7], "truncated"),
        (lambda data: data + b"\x00" * 80, "more than its 50 vertices"),
        (lambda data: b"", "expected a PLY"),
        (lambda data: b"\x00" * 400, "expected a PLY"),
        (lambda data: data.replace(b"opacity", b"opakity"), "lack opacity"),
        (lambda data: data.replace(b"binary_little_endian", b"ascii"), "missing or no number"),
        (lambda data: data.replace(b"float x", b"quark x"), "not understood"),
        (lambda data: data.replace(b"float x", b"list uchar int x"), "hold a list"),
        (lambda data: data.replace(b"float nx", b"float x"), "'x' is there twice"),
        (lambda data: data.replace(b"float nx", b"float " + b"n" * 60), "printable"),
        (lambda data: data.replace(b"float nx", b"float \xff\xfe"), "printable"),
        (lambda data: data.replace(b"float nx\n", b"float q\nproperty float q" * 600), "header"),
        (lambda data: data.replace(b"ply\n", b"ply\n" + b"comment x\n" * 200_000), "1 MiB"),
        (lambda data: data.replace(b"format", b"comment"), "one 'format' line"),
        (lambda data: data.replace(b"element vertex", b"element vortex"), "'vertex', found 0"),
        (lambda data: data[:-4] + struct.pack("<f", float("nan")), "not finite"),
        (lambda data: data.replace(b"header\n", b"header\n\xff\xff\x7f\x7f")[:-4], "farther than"),
        (bigger(b"99999999"), "truncated"),
        (bigger(b"999999999999"), "truncated"),
        (bigger(b"9" * 5000), "not understood"),
        (bigger(b"-3"), "not understood"),
    ],
)  # fmt: skip
def test_bad_ply_gets_one_line(tmp_path: Path, change, message: str) -> None:
    path = write(tmp_path / "bad.ply", rows_of(COLUMNS, 50))
    path.write_bytes(change(path.read_bytes()))
    tracemalloc.start()
    with pytest.raises(AddonError, match=message) as caught:
        splats.read_gaussians(path)
    assert tracemalloc.get_traced_memory()[1] < 20e6, "nothing large is allocated"
    tracemalloc.stop()
    assert "\n" not in str(caught.value) and str(path) in str(caught.value)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda data: data[: data.rindex(b" ")], "missing or no number"),
        (lambda data: data + b"1 2 3\n", "3 numbers too many"),
        (lambda data: data[:-9] + b"elephant\n", "no number"),
        (lambda data: data.replace(b"property float nx", b"property uchar nx"), "no uchar"),
    ],
)
def test_bad_text_gets_one_line(tmp_path: Path, change, message: str) -> None:
    path = write(tmp_path / "bad.ply", rows_of(COLUMNS, 5), "text")
    path.write_bytes(change(path.read_bytes()))
    with pytest.raises(AddonError, match=message):
        splats.read_gaussians(path)


def test_a_file_without_points_is_refused_and_changes_nothing(tmp_path: Path) -> None:
    open_blank_file()
    path = write(tmp_path / "none.ply", rows_of(COLUMNS, 0))
    with pytest.raises(AddonError, match="holds no Gaussians"):
        import_gaussians(bpy.context.scene, path, Inspection())
    assert not bpy.data.meshes and not bpy.data.collections


_WORDS = [
    b"property float q", b"property list uchar int q", b"element vertex 3", b"element face 9",
    b"format ascii 1.0", b"format binary_big_endian 1.0", b"end_header", b"comment \xff", b"",
    b"property double x", b"property float f_dc_0", b"property uchar opacity",
    b"element vertex 99999999999", b"obj_info", b"element vertex 0",
]  # fmt: skip


def mutated(data: bytes, rng: np.random.Generator) -> bytes:
    """Bytes flipped, cut out, doubled or put in, or a line of the header changed."""
    for _ in range(int(rng.integers(1, 3))):
        kind, at = int(rng.integers(8)), int(rng.integers(max(len(data), 1)))
        length = int(rng.integers(1, 40))
        if kind < 4:
            data = data[:at] + bytes([int(rng.integers(256))]) + data[at + 1 :]
        elif kind == 4:
            data = data[:at] + data[at + length :]
        elif kind == 5:
            data = data[:at]
        elif kind == 6:
            data = data[:at] + data[at : at + length] * 2 + data[at + length :]
        else:
            lines = data.split(b"\n")
            end = lines.index(b"end_header") if b"end_header" in lines else len(lines) - 1
            line = int(rng.integers(max(end, 0) + 1))
            lines[line] = _WORDS[int(rng.integers(len(_WORDS)))]
            data = b"\n".join(lines)
    return data


@pytest.mark.filterwarnings("error")
def test_500_mutated_plys_import_or_are_refused(tmp_path: Path) -> None:
    """Each goes the whole way into Blender and is evaluated, or is refused with one line."""
    open_blank_file()
    seeds = [
        write(tmp_path / f"{form}{faces}.ply", rows_of(names, 30), form, faces).read_bytes()
        for form in FORMATS
        for faces in (0, 2)
        for names in (BARE, COLUMNS, [*COLUMNS, "rf_power_db", "error_m"])
    ]
    path, imported = tmp_path / "mutated.ply", 0
    for index in range(500):
        rng = np.random.default_rng([5, index])
        path.write_bytes(mutated(seeds[index % len(seeds)], rng))
        try:
            done = import_gaussians(bpy.context.scene, path, Inspection())
        except AddonError as error:
            assert "\n" not in str(error) and str(path) in str(error)
            continue
        bpy.context.evaluated_depsgraph_get()
        assert done.count == len(cloud_mesh.ply_columns(done.objects[0].data)["x"])
        imported += 1
    assert 100 < imported < 400, imported


def test_features_are_read_and_damaged_ones_refused(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", (7,)) / "gaussians"
    path, cloud = folder / "000007.features.npz", folder / "000007.ply"
    good = clouds.read_features(cloud, 40)
    with np.load(path) as stored:
        assert set(good) == set(stored.files)
        for name in good:
            np.testing.assert_array_equal(good[name], stored[name])
    with pytest.raises(AddonError, match="the PLY holds 39 Gaussians"):
        clouds.read_features(cloud, 39)
    data = path.read_bytes()
    for index in range(200):
        path.write_bytes(mutated(data, np.random.default_rng([6, index])))
        try:
            clouds.read_features(cloud, 40)
        except AddonError as error:
            assert "\n" not in str(error) and str(path) in str(error)


def test_hostile_features_run_nothing_and_allocate_nothing(tmp_path: Path) -> None:
    cloud = write_sealed(tmp_path / "a.ply", rows_of(COLUMNS, 3))
    path = save_sealed(tmp_path / "a.features.npz", track_id=np.array([print] * 3, dtype=object))
    with pytest.raises(AddonError, match="track_id"):
        clouds.read_features(cloud, 3)
    header = np.lib.format.header_data_from_array_1_0(np.zeros((1, 1), np.float32))
    header["shape"] = (3, 2**40)
    with zipfile.ZipFile(path, "w") as archive, archive.open("features.npy", "w") as stream:
        np.lib.format.write_array_header_1_0(stream, header)
    with zipfile.ZipFile(path, "a") as archive:
        archive.comment = BLANK.encode()
    path.write_bytes(sealed(path.read_bytes()))
    with pytest.raises(AddonError, match="features has shape"):
        clouds.read_features(cloud, 3)
