# SPDX-License-Identifier: Apache-2.0
"""Ray paths as curves; `test_inside_blender.py` runs this file."""

from __future__ import annotations

import io
import json
import shutil
import zipfile
from pathlib import Path

import bpy
import numpy as np
import pytest
from blank_file import open_blank_file

from addon_rfgs.cli import open_blend, run
from addon_rfgs.errors import AddonError
from addon_rfgs.paths import dataset as ours
from addon_rfgs.removal.operators import remove_data
from addon_rfgs.scene.absences import absences
from addon_rfgs.scene.survey import survey
from rfgs_core.dataset.path_store import read_paths, write_paths
from rfgs_core.radio import images
from rfgs_core.radio.path_table import PathTable

RADIO = "wifi"
NAMES = ["AP 0", "AP 1", "AP 2"]


def table(count: int = 60) -> PathTable:
    """Paths of up to three bounces between three devices."""
    rng = np.random.default_rng(3)
    bounces = rng.integers(0, 4, count)
    inside = np.arange(3) < bounces[:, None]
    ends = rng.integers(0, 3, (2, count)).astype(np.int32)
    vertices = rng.normal(size=(count, 5, 3)).astype(np.float32)
    for row, used in zip(vertices, bounces, strict=True):
        row[used + 1 :] = row[used + 1]
    level = 10.0 ** rng.uniform(-6, -2, (count, 1, 1))
    waves = rng.normal(size=(count, 4, 3)) + 1j * rng.normal(size=(count, 4, 3))
    angles = rng.uniform(0, 3, (4, count)).astype(np.float32)
    return PathTable(
        *(ends[0], ends[1], ends[0], ends[1]),
        amplitude=(level * waves).astype(np.complex64),
        node_hz=np.array([5.72e9, 5.8e9, 5.88e9]),
        delay_s=rng.uniform(1e-9, 1e-7, count),
        doppler_hz=np.zeros(count, np.float32),
        departure_zenith_rad=angles[0],
        departure_azimuth_rad=angles[1],
        arrival_zenith_rad=angles[2],
        arrival_azimuth_rad=angles[3],
        kind=np.where(inside, rng.choice([1, 2, 4, 8, 16], (count, 3)), 0).astype(np.uint8),
        object=np.where(inside, rng.integers(1, 3, (count, 3)), 0).astype(np.int32),
        vertices=vertices,
    )


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """A dataset as far as its paths go: frames 1 and 7."""
    sequence = tmp_path / "data" / "room"
    sequence.mkdir(parents=True)
    info = {
        "frames": [1, 7],
        "devices": {RADIO: [{"name": name} for name in NAMES]},
        "objects": [{"id": 1, "name": "Wall"}, {"id": 2, "name": "Person"}],
    }
    (sequence / "sequence.json").write_text(json.dumps(info))
    for name in ("000001", "000007", "static"):
        file = sequence / "radio" / RADIO / "paths" / f"{name}.npz"
        file.parent.mkdir(parents=True, exist_ok=True)
        write_paths(file, table(60 if name == "000001" else 20))
    return tmp_path / "data"


@pytest.fixture
def scene(registered: None, data: Path) -> bpy.types.Scene:
    """Frame 1, whose paths alone are asked for."""
    open_blank_file()
    bpy.context.scene.frame_set(1)
    bpy.context.scene.rfgs.paths.dataset = str(data)
    bpy.context.scene.rfgs.paths.follow = False
    return bpy.context.scene


def curves() -> list[bpy.types.Object]:
    return list(bpy.data.collections["RF-GS Paths"].objects)


def test_codes_are_those_of_the_tracer() -> None:
    names = {name.lower(): code for name, code in vars(images).items() if name.isupper()}
    known = {name: code for code, name in ours.INTERACTIONS.items()}
    assert {name: names[name] for name in known} == known


def test_tables_are_read_as_the_core_reads_them(data: Path) -> None:
    dataset = ours.open_path_dataset(data)
    paths = ours.read_paths(dataset, RADIO, 1)
    core = read_paths(dataset.folder / "radio" / RADIO / "paths" / "000001.npz")
    power = (np.abs(core.amplitude_at(np.array([5.8e9]))[:, :, 0]) ** 2).sum(axis=1)
    order = np.argsort(-power, kind="stable")
    np.testing.assert_allclose(paths.power_db, 10 * np.log10(power[order]), atol=1e-4)
    np.testing.assert_array_equal(paths.vertices, core.vertices[order])
    np.testing.assert_array_equal(paths.delay_s, core.delay_s[order])


def test_curves_are_nothing_to_the_radio(scene) -> None:
    bpy.ops.mesh.primitive_cube_add()
    assert bpy.ops.rfgs.show_paths() == {"FINISHED"}
    bpy.context.view_layer.update()
    surfaces, _ = survey(scene)
    assert [surface.key for surface in surfaces] == ["Cube"]
    told = [row.object for row in absences(scene, surfaces, [])]
    assert not [name for name in told if name in {item.name for item in curves()}]


def test_each_path_of_a_link_is_a_curve(scene, data: Path) -> None:
    settings = scene.rfgs.paths
    settings.tx_device, settings.rx_device, settings.range_db = 0, 1, 200.0
    assert bpy.ops.rfgs.show_paths() == {"FINISHED"}
    (item,) = curves()
    core = read_paths(data / "room" / "radio" / RADIO / "paths" / "000001.npz")
    mine = (core.tx_device == 0) & (core.rx_device == 1)
    assert item.name == "wifi: AP 0 to AP 1, frame 1"
    assert len(item.data.splines) == mine.sum() == len(item["power_db"])
    assert sorted(item["delay_s"]) == sorted(core.delay_s[mine])
    power_db = np.array(item["power_db"])
    assert (np.diff(power_db) <= 0).all(), "the strongest come first"
    levels = [spline.material_index for spline in item.data.splines]
    assert levels == sorted(levels, reverse=True), "colours follow power"
    for spline, delay_s, told, met in zip(
        item.data.splines,
        item["delay_s"],
        json.loads(item["interactions"]),
        json.loads(item["objects"]),
        strict=True,
    ):
        row = int(np.flatnonzero(core.delay_s == delay_s)[0])
        used = int((core.kind[row] != 0).sum())
        points = [tuple(point.co)[:3] for point in spline.points]
        np.testing.assert_array_equal(np.array(points, np.float32), core.vertices[row, : used + 2])
        names = [ours.INTERACTIONS[int(code)] for code in core.kind[row, :used]]
        assert told == ("+".join(names) or "line of sight")
        assert met == [["", "Wall", "Person"][number] for number in core.object[row, :used]]


def test_paths_stand_in_the_scenes_own_units(scene) -> None:
    scene.unit_settings.scale_length = 0.01
    assert bpy.ops.rfgs.show_paths() == {"FINISHED"}
    for item in curves():
        assert tuple(item.scale) == pytest.approx((100.0, 100.0, 100.0))


def test_the_strongest_within_the_range_are_taken(scene) -> None:
    settings = scene.rfgs.paths
    settings.count, settings.range_db = 2, 15.0
    assert bpy.ops.rfgs.show_paths() == {"FINISHED"}
    power_db = np.concatenate([item["power_db"] for item in curves()])
    assert len(curves()) > 2 and len(power_db) > 4
    assert all(len(item["power_db"]) <= 2 for item in curves())
    assert power_db.min() >= power_db.max() - 15.0
    paths = ours.read_paths(ours.open_path_dataset(Path(settings.dataset)), RADIO, 1)
    for item in curves():
        names = item.name.removeprefix("wifi: ").removesuffix(", frame 1").split(" to ")
        link = [NAMES.index(name) for name in names]
        mine = (paths.tx_device == link[0]) & (paths.rx_device == link[1])
        np.testing.assert_allclose(item["power_db"][0], paths.power_db[mine][0])


def test_showing_again_replaces_and_clearing_leaves_nothing(scene) -> None:
    before = {name: len(getattr(bpy.data, name)) for name in ("objects", "curves", "materials")}
    bpy.ops.rfgs.show_paths()
    names = sorted(item.name for item in curves())
    bpy.ops.rfgs.show_paths()
    assert sorted(item.name for item in curves()) == names
    scene.rfgs.paths.static = True
    bpy.ops.rfgs.show_paths()
    assert any(item.name.endswith("static") for item in curves()) and len(curves()) > len(names)
    assert bpy.ops.rfgs.clear_paths() == {"FINISHED"}
    assert {name: len(getattr(bpy.data, name)) for name in before} == before
    assert "RF-GS Paths" not in bpy.data.collections and not bpy.ops.rfgs.clear_paths.poll()


def seen(frame: int) -> set[str]:
    """Ends of the names of the paths that are seen at a frame."""
    bpy.context.scene.frame_set(frame)
    return {item.name.rpartition(", ")[2] for item in curves() if not item.hide_render}


def test_paths_follow_the_timeline(scene, data: Path, tmp_path: Path) -> None:
    settings = scene.rfgs.paths
    settings.tx_device = 0
    bpy.ops.rfgs.show_paths()
    alone = len(curves())
    assert seen(1) == seen(900) == {"frame 1"}, "one frame alone is there all the time"
    settings.follow = True
    assert bpy.ops.rfgs.show_paths() == {"FINISHED"}
    assert len(curves()) > alone, "in place of those of one frame"
    first, second = {"frame 1"}, {"frame 7"}
    assert [seen(frame) for frame in (-3, 1, 6, 7, 900)] == [set(), first, first, second, second]
    # A level is the same power in both frames.
    levels: dict[int, list[float]] = {}
    for item in curves():
        for spline, power_db in zip(item.data.splines, item["power_db"], strict=True):
            levels.setdefault(spline.material_index, []).append(power_db)
    ends = [end for level in sorted(levels) for end in (min(levels[level]), max(levels[level]))]
    assert ends == sorted(ends)
    out = tmp_path / "paths.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(out))
    bpy.ops.wm.open_mainfile(filepath=str(out))
    assert seen(3) == {"frame 1"} and seen(8) == {"frame 7"}, "the file keeps it"
    bpy.ops.rfgs.clear_paths()
    assert not bpy.data.actions and not bpy.data.curves


def test_a_blocked_link_shows_nothing_until_it_is_heard_again(scene, data: Path) -> None:
    """Frame 7 has a table, but no path of the link that is shown; frame 9 has some."""
    folder, info = data / "room" / "radio" / RADIO / "paths", data / "room" / "sequence.json"
    info.write_text(info.read_text().replace("[1, 7]", "[1, 7, 9]"))
    shutil.copy(folder / "000001.npz", folder / "000009.npz")
    blocked = read_paths(folder / "000007.npz")
    write_paths(folder / "000007.npz", blocked.select(blocked.tx_device != 0))
    settings = scene.rfgs.paths
    settings.tx_device, settings.follow = 0, True
    assert bpy.ops.rfgs.show_paths() == {"FINISHED"}
    assert [seen(frame) for frame in (6, 7, 8, 9)] == [{"frame 1"}, set(), set(), {"frame 9"}]


def test_frames_without_a_table_are_passed_over(scene, data: Path) -> None:
    folder = data / "room" / "radio" / RADIO / "paths"
    scene.rfgs.paths.follow = True
    (folder / "000001.npz").unlink()
    assert bpy.ops.rfgs.show_paths() == {"FINISHED"}
    assert {item.name.rpartition(", ")[2] for item in curves()} == {"frame 7"}
    (folder / "000007.npz").unlink()
    with pytest.raises(RuntimeError, match="generate the dataset with ray paths"):
        bpy.ops.rfgs.show_paths()


def test_removing_all_data_counts_every_object(scene) -> None:
    scene.rfgs.paths.follow, scene.rfgs.paths.range_db = True, 120.0
    bpy.ops.rfgs.show_paths()
    shown = len(curves())
    assert len({item["rfgs_link"] for item in curves()}) < shown
    assert remove_data()[0] == shown


def test_paths_by_command(scene, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "paths.blend"
    assert run(["paths", "--tx", "0", "--rx", "1", "--out", str(out)]) == 0
    assert "1 links of wifi, " in capfd.readouterr().out
    assert run(["paths", "--frame", "7", "--out", str(out)]) == 0
    open_blend(out)
    assert {item.name.rpartition(", ")[2] for item in curves()} == {"frame 7"}, "replaced"
    bpy.context.scene.rfgs.paths.follow = True
    assert run(["paths", "--range-db", "120", "--out", str(out)]) == 0
    links = {item["rfgs_link"] for item in curves()}
    assert len(links) < len(curves())
    capfd.readouterr()
    assert run(["paths", "--clear", "--out", str(out)]) == 0
    assert f"removed the paths of {len(links)} links" in capfd.readouterr().out
    for words in (("--count", "0"), ("--tx", "-2"), ("--range-db", "-1")):
        assert run(["paths", *words, "--out", str(tmp_path / "never.blend")]) == 2
        said = capfd.readouterr().err.strip()
        assert said.startswith("error: --") and "expected" in said and "\n" not in said
    assert not (tmp_path / "never.blend").exists()


def test_the_dataset_of_the_jobs_is_the_default(scene, data: Path) -> None:
    scene.rfgs.paths.dataset = ""
    scene.rfgs.jobs.dataset_folder = str(data)
    assert bpy.ops.rfgs.show_paths() == {"FINISHED"}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda scene: scene.frame_set(3), "no frame 3"),
        (lambda scene: setattr(scene.rfgs.paths, "radio", "uwb"), "no radio 'uwb'; it has wifi"),
        (lambda scene: setattr(scene.rfgs.paths, "tx_device", 9), "no path from device 9"),
        (lambda scene: setattr(scene.rfgs.paths, "dataset", "/nowhere"), "no dataset there"),
    ],
)
def test_what_is_not_there_is_named(scene, change, words: str) -> None:
    change(scene)
    with pytest.raises(RuntimeError, match=words):
        bpy.ops.rfgs.show_paths()
    assert "RF-GS Paths" not in bpy.data.collections


def replace_array(file: Path, name: str, raw: bytes) -> None:
    """Writes another member into a `.npz`."""
    with zipfile.ZipFile(file) as archive:
        members = {item: archive.read(item) for item in archive.namelist()}
    members[f"{name}.npy"] = raw
    with zipfile.ZipFile(file, "w") as archive:
        for item, data in members.items():
            archive.writestr(item, data)


def npy(values: np.ndarray, **save) -> bytes:
    stream = io.BytesIO()
    np.save(stream, values, **save)
    return stream.getvalue()


@pytest.mark.parametrize(
    ("name", "raw", "words"),
    [
        ("vertices", npy(np.full((60, 5, 3), np.nan, "f4")), "not finite"),
        ("vertices", npy(np.zeros((60, 4, 3), "f4")), "4 corners for 3 bounces"),
        ("vertices", npy(np.zeros((60, 5, 2), "f4")), "vertices has shape"),
        ("vertices", npy(np.zeros((59, 5, 3), "f4")), "vertices has shape"),
        ("delay_s", npy(np.zeros(60, "f4")), "delay_s holds float32"),
        ("kind", npy(np.array([object()] * 60), allow_pickle=True), "which it cannot be"),
        ("tx_device", npy(np.zeros(3_000_000, "i4")), "tx_device has shape"),
        ("amplitude", npy(np.zeros((60, 4, 3), "c8"))[:-9], "cut short"),
        (
            "vertices",
            npy(np.zeros((60, 5, 3), "f4")).replace(b"(60, 5, 3)", b"(60, -5, 3)"),
            "vertices",
        ),
        ("node_hz", npy(np.zeros(0)), "amplitude has shape|corners"),
    ],
)
def test_hostile_tables_get_one_line(scene, data: Path, name: str, raw: bytes, words: str) -> None:
    file = data / "room" / "radio" / RADIO / "paths" / "000001.npz"
    replace_array(file, name, raw)
    with pytest.raises(AddonError, match=words) as caught:
        ours.read_paths(ours.open_path_dataset(data), RADIO, 1)
    assert "\n" not in str(caught.value)


def test_mutated_files_are_refused_or_read(data: Path) -> None:
    rng = np.random.default_rng(0)
    file = data / "room" / "radio" / RADIO / "paths" / "000007.npz"
    good, refused = file.read_bytes(), 0
    for _ in range(200):
        raw = bytearray(good[: rng.integers(len(good) // 2, len(good) + 1)])
        for place in rng.integers(0, len(raw), 4):
            raw[place] = rng.integers(256)
        file.write_bytes(raw)
        try:
            ours.read_paths(ours.open_path_dataset(data), RADIO, 7)
        except AddonError as error:
            refused += 1
            assert "\n" not in str(error)
    assert refused > 100


@pytest.mark.parametrize(
    "text", ["", "[]", "{", '{"frames": 1}', "[" * 9000, '{"frames": [1e999]}']
)
def test_damaged_descriptions_are_refused(data: Path, text: str) -> None:
    (data / "room" / "sequence.json").write_text(text)
    with pytest.raises(AddonError, match=r"sequence\.json"):
        ours.open_path_dataset(data)
