# SPDX-License-Identifier: Apache-2.0
"""Maps of coverage as surfaces; `test_inside_blender.py` runs this file."""

from __future__ import annotations

import json
from pathlib import Path

import bpy
import numpy as np
import pytest
from blank_file import open_blank_file

from addon_rfgs.cli import open_blend, run
from addon_rfgs.coverage.surface import clear_coverage, coverages, read_map, show_coverage
from addon_rfgs.errors import AddonError
from addon_rfgs.gaussians.coloring import Scale
from addon_rfgs.gaussians.legend import legend_of
from addon_rfgs.removal.operators import remove_data
from addon_rfgs.scene.survey import survey

#: Two transmitters over 2 × 3 cells; the first is not heard in one corner.
GAIN_DB = [[[-40.0, -50.0, -60.0], [-45.0, -55.0, -300.0]], [[-70.0] * 3, [-50.0] * 3]]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    info = {
        **{"radio": "wifi", "carrier_hz": 5.8e9, "corner_m": [1.0, -2.0, 1.2], "cell_m": 0.5},
        **{"devices": ["AP 0", "AP 1"], "gain_db": GAIN_DB},
    }
    (tmp_path / "coverage.json").write_text(json.dumps(info))
    return tmp_path / "coverage.json"


@pytest.fixture
def scene(registered: None, file: Path) -> bpy.types.Scene:
    open_blank_file()
    bpy.context.scene.rfgs.coverage.path = str(file)
    return bpy.context.scene


def shown() -> bpy.types.Object:
    (item,) = bpy.data.collections["RF-GS Coverage"].objects
    return item


def gains(item: bpy.types.Object) -> np.ndarray:
    values = np.zeros(len(item.data.vertices), np.float32)
    item.data.attributes["path_gain_db"].data.foreach_get("value", values)
    return values.reshape(2, 3)


def test_cells_stand_where_they_were_traced(scene: bpy.types.Scene) -> None:
    scene.unit_settings.scale_length = 0.1
    scene.rfgs.coverage.tx_device = 0
    assert bpy.ops.rfgs.show_coverage() == {"FINISHED"}
    bpy.context.view_layer.update()
    item = shown()
    places = np.array([item.matrix_world @ row.co for row in item.data.vertices]) * 0.1
    np.testing.assert_allclose(places[0], [1.25, -1.75, 1.2], atol=1e-6)
    np.testing.assert_allclose(places[-1], [2.25, -1.25, 1.2], atol=1e-6)
    found = gains(item)
    np.testing.assert_allclose(found[0], GAIN_DB[0][0])
    # Where nothing arrives is a hole.
    assert np.isnan(found[1, 2]) and len(item.data.polygons) == 1


def test_each_scene_keeps_its_own_map(scene: bpy.types.Scene, file: Path) -> None:
    assert bpy.ops.rfgs.show_coverage() == {"FINISHED"}
    other = bpy.data.scenes.new("other")
    show_coverage(other, read_map(file), 1)
    assert [len(coverages(each)) for each in (scene, other)] == [1, 1]
    show_coverage(other, read_map(file), 0)
    assert [len(coverages(each)) for each in (scene, other)] == [1, 1] and len(coverages()) == 2
    assert clear_coverage() == 2


def test_the_loudest_is_shown_unless_one_is_named(scene: bpy.types.Scene) -> None:
    assert bpy.ops.rfgs.show_coverage() == {"FINISHED"}
    np.testing.assert_allclose(gains(shown()), np.maximum(*np.array(GAIN_DB)))
    scene.rfgs.coverage.tx_device = 1
    assert bpy.ops.rfgs.show_coverage() == {"FINISHED"}
    np.testing.assert_allclose(gains(shown()), GAIN_DB[1])
    told = legend_of(Scale.of(shown().data))
    assert told.title.startswith("Path gain") and told.ends == ("-70 dB", "-50 dB")


def test_a_map_is_nothing_to_the_radio_and_goes_without_trace(scene: bpy.types.Scene) -> None:
    bpy.ops.mesh.primitive_cube_add()
    assert bpy.ops.rfgs.show_coverage() == {"FINISHED"}
    bpy.context.view_layer.update()
    assert [surface.key for surface in survey(scene)[0]] == ["Cube"]
    assert bpy.ops.rfgs.clear_coverage() == {"FINISHED"}
    assert "RF-GS Coverage" not in bpy.data.collections
    assert bpy.ops.rfgs.show_coverage() == {"FINISHED"}
    assert remove_data()[0] == 1 and "RF-GS Coverage" not in bpy.data.collections


def test_the_command_saves_a_file_with_it(scene, file: Path, tmp_path: Path, capfd) -> None:
    blend, out = tmp_path / "room.blend", tmp_path / "map.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    open_blend(blend)
    assert run(["coverage", "--map", str(file), "--tx", "0", "--out", str(out)]) == 0
    assert "AP 0: median -50 dB, heard in 83 %" in capfd.readouterr().out
    open_blend(out)
    assert shown()["rfgs_coverage"] == "AP 0"
    assert run(["coverage", "--map", str(file), "--tx", "7", "--out", str(out)]) == 2
    assert "no transmitter 7" in capfd.readouterr().err


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"gain_db": [[[1.0, 2.0], [3.0]]]}, "rows of different length"),
        ({"gain_db": [GAIN_DB[0]]}, "for each device"),
        ({"gain_db": [[[1.0]], [[1.0]]]}, "several cells"),
        ({"cell_m": 0.0}, "cell_m"),
        ({"corner_m": [1.0]}, "expected a map"),
        ({"devices": [1, 2]}, "expected text"),
        ({"gain_db": "x"}, "expected a list"),
    ],
)
def test_what_is_no_map_is_one_line(file: Path, change: dict, said: str) -> None:
    file.write_text(json.dumps({**json.loads(file.read_text()), **change}))
    with pytest.raises(AddonError, match=said):
        read_map(file)
