# SPDX-License-Identifier: Apache-2.0
"""The command line: pictures, Gaussians and one line for every mistake."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from plyfile import PlyData, PlyElement
from scipy.ndimage import maximum_filter

from dataset_factory.scene.bundle import Bundle, read_bundle

OpenEXR = pytest.importorskip("OpenEXR")
ROOT = Path(__file__).resolve().parents[2]
LIVING_ROOM = ROOT / "blender_scenes" / "living_room_walk.blend"


def read_passes(path: Path) -> dict[str, np.ndarray]:
    channels = OpenEXR.File(str(path), separate_channels=True).channels()
    return {name.partition(".")[2]: channel.pixels for name, channel in channels.items()}


def project(camera: dict, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pixels [N, 2] and planar depths [N]."""
    world = np.linalg.inv(np.array(camera["world_from_camera"]))
    local = points @ world[:3, :3].T + world[:3, 3]
    depth = -local[:, 2]
    u = camera["fl_x"] * local[:, 0] / depth + camera["cx"]
    v = -camera["fl_y"] * local[:, 1] / depth + camera["cy"]
    return np.stack([u, v], axis=1), depth


@pytest.fixture(scope="module")
def rendered(scenes: Path, addon) -> Path:
    out = scenes / "truth"
    arguments = ("--out", out, "--frames", "2:4:2", "--samples", "2", "--passes")
    done = addon(scenes / "room.blend", "groundtruth", *arguments)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[:-1] == [f"progress {i} 4" for i in range(1, 5)]
    return out


@pytest.fixture(scope="module")
def room(scenes: Path) -> Bundle:
    return read_bundle(scenes / "room")


def test_pictures_have_the_bundle_s_size_and_an_alpha(rendered: Path, room: Bundle) -> None:
    with Image.open(rendered / "cam01" / "000004.png") as picture:
        assert picture.mode == "RGBA"
        assert picture.size == (room.cameras[1]["width"], room.cameras[1]["height"])
        assert picture.info == {}, "no dates, no render times"
        alpha = np.asarray(picture)[..., 3]
    hit = np.isfinite(read_passes(rendered / "cam01" / "000004.exr")["Depth.Z"])
    assert alpha[hit].min() > 0 and alpha[~hit].max() < 255
    assert (alpha[~hit] == 0).mean() > 0.9


def test_depth_is_planar_and_in_metres(rendered: Path, room: Bundle) -> None:
    """Each pixel that shows the floor lies on z = 0 when its depth is undone."""
    for camera in room.cameras:
        passes = read_passes(rendered / camera["name"] / "000002.exr")
        depth, normal = passes["Depth.Z"], passes["Normal.Z"]
        v, u = np.nonzero((normal > 0.999) & (passes["IndexOB.X"] == 0) & np.isfinite(depth))
        z = depth[v, u]
        x = (u + 0.5 - camera["cx"]) / camera["fl_x"] * z
        y = -(v + 0.5 - camera["cy"]) / camera["fl_y"] * z
        matrix = np.array(camera["world_from_camera"])
        world = np.stack([x, y, -z], axis=1) @ matrix[:3, :3].T + matrix[:3, 3]
        floor = np.abs(world[:, 2]) < 0.2
        assert floor.sum() > 200
        assert np.abs(world[floor, 2]).max() < 5e-3
        assert (np.abs(world[floor, :2]) < 2.01).all()


def test_vertices_project_into_the_mask(rendered: Path, room: Bundle) -> None:
    """The mask's box is the projected vertices' box to a pixel, so both share one camera."""
    for camera in room.cameras:
        index = read_passes(rendered / camera["name"] / "000004.exr")["IndexOB.X"]
        assert set(np.unique(index)) == {0.0, 1.0}
        pixels, _ = project(camera, room.frame(4).vertices.astype(np.float64))
        v, u = np.nonzero(index)
        size = np.array([camera["width"], camera["height"]])
        low, high = np.clip(pixels.min(axis=0), 0, size), np.clip(pixels.max(axis=0), 0, size)
        np.testing.assert_allclose([u.min(), v.min()], low, atol=1.2)
        np.testing.assert_allclose([u.max() + 1, v.max() + 1], high, atol=1.2)


def test_the_same_render_gives_the_same_bytes(scenes: Path, addon, rendered: Path) -> None:
    arguments = ("--frames", "2:3:2", "--cameras", "1", "--samples", "2", "--passes")
    done = addon(scenes / "room.blend", "groundtruth", "--out", scenes / "again", *arguments)
    assert done.returncode == 0, done.stderr
    for name in ("000002.png", "000002.exr"):
        again = (scenes / "again" / "cam00" / name).read_bytes()
        assert again == (rendered / "cam00" / name).read_bytes(), name


def test_empty_pictures_lack_the_person(scenes: Path, addon, rendered: Path) -> None:
    out = scenes / "truth"
    arguments = ("--out", out, "--cameras", "1", "--samples", "2", "--empty")
    done = addon(scenes / "room.blend", "groundtruth", *arguments)
    assert done.returncode == 0, done.stderr
    index = read_passes(out / "cam00" / "000004.exr")["IndexOB.X"] > 0
    with (
        Image.open(out / "cam00" / "empty.png") as empty,
        Image.open(out / "cam00" / "000004.png") as full,
    ):
        change = np.abs(np.asarray(empty, int) - np.asarray(full, int)).max(axis=2)
    assert (change[index] > 8).mean() > 0.5


def write_run(folder: Path, frames: tuple[int, ...]) -> None:
    names = [*"xyz", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2", "opacity"]
    names += [f"scale_{i}" for i in range(3)] + [f"rot_{i}" for i in range(4)]
    (folder / "gaussians").mkdir(parents=True)
    for name in ("static", *(f"{frame:06d}" for frame in frames)):
        rows = np.zeros(40, [(column, "<f4") for column in names])
        rows["z"], rows["rot_0"], rows["opacity"] = np.linspace(0, 1.7, 40), 1, 3
        rows["f_dc_0"] = 1.2
        for i in range(3):
            rows[f"scale_{i}"] = np.log(0.05)
        path = folder / "gaussians" / f"{name}.ply"
        PlyData([PlyElement.describe(rows, "vertex")]).write(str(path))


_OPENED = """
import bpy, json, sys
bpy.ops.wm.open_mainfile(filepath=sys.argv[1], use_scripts=False)
scene = bpy.context.scene
screen = bpy.context.window_manager.windows[0].screen
views = [a.spaces.active for a in screen.areas if a.type == "VIEW_3D"]
graph = bpy.context.evaluated_depsgraph_get()
clouds = [i for i in scene.objects if i.name.startswith("Gaussians") and not i.hide_viewport]
colors = [i.evaluated_get(graph).data.color_attributes for i in clouds]
truth = [i for i in scene.objects if i.display_type == "WIRE"]
sys.stdout.write("\\n" + json.dumps({
    "shading": sorted({(v.shading.type, v.shading.color_type) for v in views}),
    "through": sorted({v.region_3d.view_perspective for v in views}),
    "asks_for_tab": bool(bpy.data.collections["RF-GS Gaussians"].get("rfgs_opens_tab")),
    "camera": scene.camera.name, "frame": scene.frame_current, "clouds": len(clouds),
    "coloured": [c.active_color.name for c in colors], "truth": sorted(i.name for i in truth),
    "hidden": sorted(i.name for i in scene.objects if i.hide_get()),
    "said": list(bpy.data.collections["RF-GS Gaussians"].get("rfgs_compared", [])),
}) + "\\n")
"""


def test_an_inspection_opens_in_colour_through_a_camera_past_the_walls(
    scenes: Path, addon, python, tmp_path: Path
) -> None:
    """The room's own camera stands behind a wall that is put there; people are thin lines."""
    write_run(tmp_path / "run", (1, 3, 4))
    walled, blend = tmp_path / "walled.blend", tmp_path / "inspect.blend"
    wall = (
        "import bpy, sys; bpy.ops.wm.open_mainfile(filepath=sys.argv[1]); s = bpy.context.scene; "
        "c = [i for i in s.objects if i.type == 'CAMERA']; "
        "[bpy.data.objects.remove(i) for i in c]; "
        "c = bpy.data.objects.new('eye', bpy.data.cameras.new('eye')); "
        "s.collection.objects.link(c); "
        "c.location = (0, -6, 1); c.rotation_euler = (1.5708, 0, 0); "
        "bpy.ops.mesh.primitive_cube_add(location=(0, -4, 1), scale=(4, .05, 3)); "
        "bpy.context.object.name = 'wall'; "
        "bpy.ops.mesh.primitive_cube_add(location=(9, 9, 1)); bpy.context.object.name = 'aside'; "
        "bpy.ops.wm.save_as_mainfile(filepath=sys.argv[2])"
    )
    python("-c", wall, scenes / "room.blend", walled, must_work=True)
    more = (
        "--compare",
        "--color-by",
        "error",
        "--out",
        blend,
        "--picture",
        tmp_path / "a.png",
        "--camera",
        "eye",
    )
    more += ("--resolution", "32", "--samples", "1")
    done = addon(walled, "import", tmp_path / "run", *more)
    assert done.returncode == 0, done.stderr
    seen = json.loads(python("-c", _OPENED, blend).stdout.splitlines()[-1])
    assert seen["shading"] == [["SOLID", "VERTEX"]] and seen["through"] == ["CAMERA"]
    assert seen["asks_for_tab"] and seen["frame"] == 3 and seen["clouds"] == 2
    assert seen["coloured"] == ["rfgs_color"] * 2
    assert seen["truth"], "what moves is drawn as lines"
    assert seen["camera"] == "eye"
    assert "wall" in seen["hidden"] and "aside" not in seen["hidden"]
    assert seen["said"][0].startswith("Median ") and "in 3 frames" in seen["said"][1]


_RENDERED = """
import bpy, sys
bpy.ops.wm.open_mainfile(filepath=sys.argv[1], use_scripts=False)
truth = [i for i in bpy.context.scene.objects if i.display_type == "WIRE"]
sys.stdout.write(f"\\n{len(truth)} {sum(i.visible_camera or i.visible_shadow for i in truth)}\\n")
"""


def test_renders_of_an_inspection_lack_the_truth_and_pictures_of_a_dataset_do_not(
    scenes: Path, addon, python, tmp_path: Path
) -> None:
    write_run(tmp_path / "run", (3,))
    blend = tmp_path / "inspect.blend"
    done = addon(scenes / "room.blend", "import", tmp_path / "run", "--out", blend)
    assert done.returncode == 0, done.stderr
    assert python("-c", _RENDERED, blend).stdout.splitlines()[-1] == "1 0"
    arguments = ("--frames", "2:3:2", "--cameras", "1", "--samples", "1", "--passes")
    done = addon(blend, "groundtruth", "--out", tmp_path / "truth", *arguments)
    assert done.returncode == 0, done.stderr
    index = read_passes(tmp_path / "truth" / "cam00" / "000002.exr")["IndexOB.X"]
    assert set(np.unique(index)) == {0.0, 1.0}


_LOOK = """
import bpy, json, sys
bpy.ops.wm.open_mainfile(filepath=sys.argv[1], use_scripts=False)
scene, seen = bpy.context.scene, {}
for frame in range(1, 6):
    scene.frame_set(frame)
    graph = bpy.context.evaluated_depsgraph_get()
    names = {(i.parent if i.is_instance else i.object).name for i in graph.object_instances}
    seen[frame] = sorted(name for name in names if name.startswith("Gaussians"))
    seen[f"spheres {frame}"] = sum(i.is_instance for i in graph.object_instances)
cloud = bpy.data.objects["Gaussians 000003"].data
seen["attributes"] = {a.name: a.data_type for a in cloud.attributes}
seen["colour"] = list(cloud.attributes["rfgs_color"].data[0].color)
seen["opacity"] = cloud.attributes["opacity"].data[0].value
sys.stdout.write("\\n" + json.dumps(seen) + "\\n")
"""


def test_import_saves_a_file_that_shows_each_frame_without_the_add_on(
    scenes: Path, addon, python, tmp_path: Path
) -> None:
    write_run(tmp_path / "run", (1, 3, 4))
    blend, picture = tmp_path / "inspect.blend", tmp_path / "picture.png"
    shapes = ("--mode", "ellipsoids", "--no-solid-view")
    arguments = ("--out", blend, "--picture", picture, "--resolution", "64", "--frame", "4")
    done = addon(scenes / "room.blend", "import", tmp_path / "run", *arguments, *shapes)
    assert done.returncode == 0, done.stderr
    assert len(done.stdout.splitlines()) == 1 and "frame 4)" in done.stdout
    seen = json.loads(python("-c", _LOOK, blend).stdout.splitlines()[-1])
    now = {"1": "000001", "2": "000001", "3": "000003", "4": "000004", "5": "000004"}
    for frame, name in now.items():
        assert seen[frame] == [f"Gaussians {name}", "Gaussians static"]
        assert seen[f"spheres {frame}"] == 80, "one ellipsoid per Gaussian"
    kinds = {
        "rfgs_color": "FLOAT_COLOR", "opacity": "FLOAT", "scale": "FLOAT_VECTOR",
        "rotation": "QUATERNION", "radius": "FLOAT", "rf_power_db": "FLOAT", "gid": "INT",
    }  # fmt: skip
    assert kinds.items() <= seen["attributes"].items()
    encoded = 0.5 + 0.28209479177387814 * 1.2
    assert seen["colour"][0] == pytest.approx(((encoded + 0.055) / 1.055) ** 2.4, rel=1e-4)
    assert seen["opacity"] == pytest.approx(1 / (1 + np.exp(-3)), rel=1e-5)
    with Image.open(picture) as image:
        assert image.size == (128, 48), "scene and Gaussians side by side"
        halves = np.asarray(image.convert("RGB"), int)
    assert np.abs(halves[:, :64] - halves[:, 64:]).max() > 30


def test_mistakes_get_one_line_and_exit_code_2(scenes: Path, addon) -> None:
    """One of them; the others are made in `inside_mistakes.py`, without a process for each."""
    done = addon(scenes / "room.blend", "frobnicate")
    assert done.returncode == 2
    lines = done.stderr.strip().splitlines()
    assert len(lines) == 1 and lines[0].startswith("error: ") and "invalid choice" in lines[0]


def test_help_of_a_command_is_sentences(scenes: Path, addon) -> None:
    done = addon(scenes / "room.blend", "import", "--help")
    assert "back beside the scene. Brings the Gaussians" in " ".join(done.stdout.split())


@pytest.mark.parametrize("content", [None, b"", b"not a blend file at all", b"BLENDER-v405garbage"])
def test_missing_or_damaged_blend_is_refused(addon, tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "scene.blend"
    if content is not None:
        path.write_bytes(content)
    done = addon(path, "export", "--out", tmp_path / "bundle")
    assert done.returncode == 2
    assert done.stderr.startswith(f"error: {path}: ") and done.stderr.count("\n") == 1


def test_other_folders_are_not_overwritten(scenes: Path, addon, tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").write_text("x")
    done = addon(scenes / "room.blend", "export", "--out", tmp_path)
    assert done.returncode == 2 and "choose another folder" in done.stderr
    assert (tmp_path / "thesis.txt").read_text() == "x"


#: Denoising the colour, which is not looked at, takes twice as long as all the rest.
_NOISY = """
import sys
from addon_rfgs.__main__ import main
from addon_rfgs.export import groundtruth
groundtruth.can_denoise = lambda: False
sys.exit(main(sys.argv[1:]))
"""


@pytest.mark.skipif(
    not LIVING_ROOM.is_file(), reason="blender_scenes/living_room_walk.blend absent"
)
def test_joints_project_into_the_person_in_every_camera(addon, python, tmp_path: Path) -> None:
    bundle_path, out = tmp_path / "bundle", tmp_path / "truth"
    common = ("--frames", "10:40:30", "--resolution", "96")
    done = addon(LIVING_ROOM, "export", "--out", bundle_path, *common)
    assert done.returncode == 0, done.stderr
    asked = ("--blend", LIVING_ROOM, "groundtruth", "--out", out, *common)
    python("-c", _NOISY, *asked, "--samples", "1", "--passes", must_work=True)
    bundle, checked = read_bundle(bundle_path), 0
    for camera in bundle.cameras:
        for frame in bundle.frames:
            pixels, depth = project(camera, bundle.frame(frame).joints[0].astype(np.float64))
            passes = read_passes(out / camera["name"] / f"{frame:06d}.exr")
            inside = (depth > 0) & (pixels >= 0).all(axis=1)
            inside &= (pixels < [camera["width"], camera["height"]]).all(axis=1)
            u, v = pixels[inside].astype(int).T
            # At this resolution a wrist is thinner than a pixel, so its neighbours count.
            index = maximum_filter(passes["IndexOB.X"], size=3)[v, u]
            hidden = (index == 0) & (passes["Depth.Z"][v, u] < depth[inside])  # by furniture
            assert (index[~hidden] == 1).all(), (camera["name"], frame)
            checked += int((~hidden).sum())
    assert checked > 100


def test_pictures_that_nothing_denoises_are_said_to_be_noisy(
    scenes: Path, python, tmp_path: Path
) -> None:
    """As in Debian's Blender, which is built without a denoiser."""
    asked = ("--blend", scenes / "room.blend", "groundtruth", "--out", tmp_path / "truth")
    few = ("--frames", "1:1", "--cameras", "1", "--resolution", "16", "--samples", "1")
    said = python("-c", _NOISY, *asked, *few, must_work=True).stdout
    note = "this Blender has no denoiser, so pictures are noisy"
    assert f"note: {note}" in said and f"1 pictures; {note}" in said
