# SPDX-License-Identifier: Apache-2.0
"""Odd files, folders that are gone and the like; `test_inside_blender.py` runs this file."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import bpy
import pytest
from blank_file import open_blank_file
from build_scenes import room
from splat_files import write_run

import addon_rfgs
from addon_rfgs.cli import run
from addon_rfgs.devices import empties
from addon_rfgs.devices.sketch import sketch
from addon_rfgs.errors import AddonError
from addon_rfgs.gaussians.clouds import clouds_here
from addon_rfgs.jobs import following, process
from addon_rfgs.jobs.plans import TrainPlan
from addon_rfgs.jobs.preferences import ADDON
from addon_rfgs.jobs.queue import DONE, Job, Queue
from addon_rfgs.jobs.record import Record, write_record
from addon_rfgs.removal.operators import remove_data

pytestmark = pytest.mark.usefixtures("registered")


@pytest.fixture
def library(registered: None, tmp_path: Path) -> Path:
    """The small room in a file that others link to."""
    room()
    path = tmp_path / "library.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def empty_file(_library: Path) -> None:
    open_blank_file()


def startup_file(_library: Path) -> None:
    bpy.ops.wm.read_factory_settings()


def linked_objects(library: Path) -> None:
    empty_file(library)
    with bpy.data.libraries.load(str(library), link=True) as (theirs, ours):
        ours.objects = list(theirs.objects)
    for item in ours.objects:
        bpy.context.scene.collection.objects.link(item)
        item.select_set(True)
    bpy.context.scene.frame_end = 5
    bpy.context.view_layer.objects.active = bpy.data.objects["ap"]


def linked_collection(library: Path) -> None:
    room()
    home = bpy.data.collections.new("Furniture")
    for item in bpy.context.scene.objects:
        home.objects.link(item)
    bpy.data.libraries.write(str(library), {home})
    empty_file(library)
    with bpy.data.libraries.load(str(library), link=True) as (theirs, ours):
        ours.collections = list(theirs.collections)
    bpy.context.scene.collection.children.link(ours.collections[0])
    bpy.context.scene.frame_end = 5
    bpy.context.view_layer.update()
    bpy.context.view_layer.objects.active = bpy.data.objects["ap"]
    bpy.data.objects["ap"].select_set(True)


def linked_scene(library: Path) -> None:
    empty_file(library)
    with bpy.data.libraries.load(str(library), link=True) as (theirs, ours):
        ours.scenes = list(theirs.scenes)
    bpy.context.window.scene = ours.scenes[0]


def edit_mode(library: Path) -> None:
    room()
    bpy.context.view_layer.objects.active = bpy.data.objects["crate"]
    bpy.ops.object.mode_set(mode="EDIT")


def pose_mode(library: Path) -> None:
    room()
    bpy.context.view_layer.objects.active = bpy.data.objects["rig"]
    bpy.ops.object.mode_set(mode="POSE")


def all_selected(library: Path) -> None:
    room()
    for item in bpy.data.objects:
        item.select_set(True)


@pytest.mark.parametrize(
    "situation",
    [
        *(empty_file, startup_file, linked_objects, linked_collection, linked_scene),
        *(edit_mode, pose_mode, all_selected),
    ],
)
def test_every_operator_answers_in_any_file(
    situation: Callable[[Path], None], library: Path
) -> None:
    answered, changed = 0, True
    for name in dir(bpy.ops.rfgs):
        if changed:
            situation(library)
        operator = getattr(bpy.ops.rfgs, name)
        changed = False
        if not operator.poll():
            continue
        try:
            assert operator() == {"FINISHED"}, name
            changed = True
        except RuntimeError as error:
            said = str(error).strip()
            assert said.startswith("Error: ") and "\n" not in said, f"{name}: {said}"
        answered += 1
    assert answered > 15


@pytest.fixture
def two_scenes(tmp_path: Path) -> tuple[bpy.types.Scene, bpy.types.Scene]:
    """Scenes of one file, with a cloud each."""
    open_blank_file()
    first, second = bpy.context.scene, bpy.data.scenes.new("Second")
    for scene, count in ((first, 40), (second, 30)):
        bpy.context.window.scene = scene
        scene.rfgs.gaussians.path = str(write_run(tmp_path / scene.name, (1,), count))
        bpy.ops.rfgs.import_gaussians()
        bpy.ops.rfgs.add_device(role="RECEIVER")
    return first, second


def test_scenes_of_one_file_do_not_mix(two_scenes: tuple) -> None:
    first, second = two_scenes
    for scene, count in ((first, 40), (second, 30)):
        sizes = [len(item.data.vertices) for item in clouds_here(scene)]
        assert sizes == [count], "nothing stands still, so there is one cloud"
        assert len(empties.devices(scene)) == 1, "a device stands in its own scene"
    first.rfgs.gaussians.size = 3.0
    bpy.context.window.scene = first
    bpy.ops.rfgs.remove_device(device=empties.devices(first)[0].name)
    assert not empties.devices(first) and len(empties.devices(second)) == 1
    bpy.ops.rfgs.import_gaussians()
    assert len(clouds_here(second)) == 1, "an import replaces what is in its own scene"
    remove_data()
    assert not bpy.data.objects and not bpy.data.collections


def test_renamed_things_are_found_again(two_scenes: tuple) -> None:
    first, _ = two_scenes
    bpy.context.window.scene = first
    cloud = next(item for item in clouds_here(first) if len(item.data.vertices))
    cloud.name = "mine"
    cloud.data.name = "mine too"
    home = bpy.data.collections.new("Tidy")
    first.collection.children.link(home)
    own = cloud.users_collection[0]
    first.collection.children.unlink(own)
    home.children.link(own)
    assert cloud in clouds_here(first)
    assert bpy.ops.rfgs.import_gaussians() == {"FINISHED"}
    assert len(clouds_here(first)) == 1, "replaced, not doubled"
    device = empties.devices(first)[0]
    bpy.ops.rfgs.check_scene()
    device.name = "renamed"
    bpy.ops.rfgs.duplicate_device(device="renamed")
    with pytest.raises(RuntimeError, match="no radio device 'receiver'"):
        bpy.ops.rfgs.remove_device(device="receiver")


def test_findings_about_what_was_renamed_say_so(registered: None) -> None:
    room()
    bpy.data.objects["ap"].location = (-5, 1, 1.2)
    bpy.ops.rfgs.check_scene()
    rows = bpy.context.window_manager.rfgs.check.rows
    index = next(i for i, row in enumerate(rows) if row.kind == "device_outside")
    bpy.data.objects["ap"].name = "router"
    for operator in (bpy.ops.rfgs.select_finding, bpy.ops.rfgs.repair_finding):
        with pytest.raises(RuntimeError, match=r"no (object|radio device) 'ap'"):
            operator(index=index)


@pytest.fixture
def finished_job(tmp_path: Path) -> Iterator[Path]:
    """A training in the list that is done; its folder."""
    open_blank_file()
    stored = bpy.context.preferences.addons.new()
    stored.module = ADDON
    folder = write_run(tmp_path / "run", (1,))
    job = Job(TrainPlan(str(folder), str(tmp_path / "data")), None)
    job.state = DONE
    following.QUEUE.jobs.append(job)
    following.show()
    yield folder
    following.QUEUE.jobs.clear()
    following.show()
    bpy.context.preferences.addons.remove(stored)


def test_a_run_that_vanished_is_refused_and_nothing_changes(finished_job: Path) -> None:
    assert bpy.ops.rfgs.import_result() == {"FINISHED"}
    scene = bpy.context.scene
    before, path = [item.name for item in clouds_here(scene)], scene.rfgs.gaussians.path
    scene.rfgs.gaussians.path = path = "/elsewhere"
    shutil.rmtree(finished_job)
    with pytest.raises(RuntimeError, match="no such run folder or PLY file") as caught:
        bpy.ops.rfgs.import_result()
    assert "\n" not in str(caught.value).strip()
    assert [item.name for item in clouds_here(scene)] == before
    assert scene.rfgs.gaussians.path == path


@pytest.mark.parametrize(
    "words",
    [
        ["check", "--out", "{0}/report.json"],
        ["fix", "--out", "{0}/a.blend"],
        ["devices", "add", "receiver", "--at", "0", "0", "1", "--out", "{0}/a.blend"],
        ["materials", "guess", "--out", "{0}/a.blend"],
        ["export", "--out", "{0}/bundle"],
        ["groundtruth", "--out", "{0}/pictures", "--samples", "1", "--resolution", "32"],
        ["import", "{run}", "--out", "{0}/a.blend"],
        ["import", "{run}", "--picture", "{0}/a.png", "--samples", "1", "--resolution", "32"],
        ["export-gaussians", "{0}/a.ply"],
        ["remove-data", "--out", "{0}/a.blend"],
        ["train", "--out", "{0}/run", "--dataset", "/nowhere", "--python", "/bin/true"],
    ],
    ids=lambda words: " ".join(words[:2]),
)
def test_places_that_cannot_be_written_get_one_line(
    library: Path, tmp_path: Path, words: list[str], capfd: pytest.CaptureFixture[str]
) -> None:
    taken = tmp_path / "taken"
    taken.write_text("a file where a folder should be")
    run_folder = write_run(tmp_path / "run", (1,))
    bpy.context.scene.rfgs.gaussians.path = str(run_folder)
    bpy.ops.rfgs.import_gaussians()
    before = sorted(os.listdir(tmp_path))
    assert run([word.format(taken, run=run_folder) for word in words]) == 2
    said = capfd.readouterr().err
    assert said.startswith("error: ") and said.count("\n") == 1 and "taken" in said, said
    assert sorted(os.listdir(tmp_path)) == before and taken.is_file()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("export",), "--out"),
        (("export", "--out", "{tmp}/b", "--frames", "3:99"), "frames"),
        (("export", "--out", "{tmp}/b", "--cameras", "9"), "cameras"),
        (("import", "{tmp}/nothing", "--out", "{tmp}/x.blend"), "no such run"),
        (("import", "{tmp}", "--picture", "{tmp}/x.png", "--camera", "nope"), "no camera 'nope'"),
        (("import", "{run}", "--out", "{tmp}/x.blend", "--frame", "2"), "with Gaussians: 1, 3"),
        (("import", "{tmp}", "--out", "{tmp}/x.blend", "--crop-box", "crate"), "an Empty"),
        (("import", "{tmp}", "--out", "{tmp}/x.blend", "--opacity-threshold", "2"), "opacity"),
        (("export-gaussians", "{tmp}/x.ply"), "no imported Gaussians"),
    ],
)
def test_senseless_commands_get_one_line_and_exit_code_2(
    library: Path,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    arguments: tuple[str, ...],
    words: str,
) -> None:
    run_folder = write_run(tmp_path / "run", (1, 3))
    filled = [argument.format(tmp=tmp_path, run=run_folder) for argument in arguments]
    assert run(filled, blend=library) == 2
    lines = capfd.readouterr().err.strip().splitlines()
    assert len(lines) == 1 and lines[0].startswith("error: ") and words in lines[0], lines
    assert sorted(os.listdir(tmp_path)) == [library.name, "run"], "nothing was written"


def test_windows_is_told_before_anything_is_written(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(process, "SUPPORTED", False)
    plan = TrainPlan(str(tmp_path / "run"), str(tmp_path / "data"))
    with pytest.raises(AddonError, match="jobs need Linux or macOS"):
        Queue(lambda: None).add(plan, Path("/bin/true"))
    assert not list(tmp_path.iterdir())
    # A list of jobs from elsewhere is looked at without asking for processes.
    write_record(Record(plan, os.getpid(), "Monday"))
    queue = Queue(lambda: None)
    queue.restore(Record(plan, os.getpid(), "Monday"))
    assert queue.jobs[0].state == "Stopped"


def test_senseless_arrays_do_not_halt_the_view(registered: None) -> None:
    room()
    radio = bpy.data.objects["ap"].rfgs.rf
    radio.rx_rows = radio.rx_cols = 10**9
    pose = empties.pose_of(bpy.data.objects["ap"], 1.0)
    lines = sketch(radio.row(), "ACCESS_POINT", pose)
    assert not len(lines.rx) and len(lines.tx) and len(lines.boresight)
    words = ["devices", "add", "receiver", "--at", "0", "0", "1", "--out", "never.blend"]
    assert run([*words, "--rx", "99x99"]) == 2


def test_linked_materials_are_not_offered_for_a_guess(
    library: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    linked_objects(library)
    bpy.ops.rfgs.guess_materials()
    assert len(bpy.context.window_manager.rfgs.guesses.rows) == 0
    assert "materials are linked; label them in their own files" in capfd.readouterr().out
    addon_rfgs.properties._forget(None)


def test_copies_of_linked_devices_are_the_files_own(library: Path) -> None:
    linked_collection(library)
    scene = bpy.context.scene
    for change in (
        lambda: bpy.ops.rfgs.remove_device(device="ap"),
        lambda: bpy.ops.rfgs.place_radio(radio="wifi"),
    ):
        with pytest.raises(RuntimeError, match="'Furniture' is linked from") as caught:
            change()
        assert "\n" not in str(caught.value).strip()
        assert len(empties.devices(scene)) == 1
    place = bpy.data.objects["ap"].matrix_world.translation.copy()
    assert bpy.ops.rfgs.duplicate_device(device="ap", offset=(0, 0, 1)) == {"FINISHED"}
    assert bpy.ops.rfgs.mirror_device(device="ap", copy=True) == {"FINISHED"}
    first, second = (item for item in empties.devices(scene) if item.library is None)
    for twin in (first, second):
        assert [home.name for home in twin.users_collection] == [empties.COLLECTION]
    assert first.matrix_world.translation.z == pytest.approx(place.z + 1)


def test_what_is_linked_is_repaired_where_it_is(library: Path) -> None:
    linked_objects(library)
    scene = bpy.context.scene
    bpy.data.objects["ap"].location = (-5, 1, 1.2)
    bpy.data.objects["body"].data.flip_normals()
    bpy.context.view_layer.update()
    bpy.ops.rfgs.check_scene()
    rows = bpy.context.window_manager.rfgs.check.rows
    kinds = [row.kind for row in rows]
    assert {"device_outside", "inside_out"} <= set(kinds)
    for kind in ("device_outside", "inside_out"):
        assert not rows[kinds.index(kind)].repairable
        with pytest.raises(RuntimeError, match=r"linked from .*library\.blend; .* there"):
            bpy.ops.rfgs.repair_finding(index=kinds.index(kind))
    with pytest.raises(RuntimeError, match="linked from"):
        bpy.ops.rfgs.mirror_device(device="ap", copy=False)
    assert scene.objects["ap"].location.x == pytest.approx(-5)
