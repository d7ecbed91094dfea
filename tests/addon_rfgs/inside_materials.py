# SPDX-License-Identifier: GPL-3.0-or-later
"""Radio materials inside Blender; `test_inside_blender.py` runs this file."""

from __future__ import annotations

import json
from pathlib import Path

import bpy
import numpy as np
import pytest
from build_scenes import box

import addon_rfgs
from addon_rfgs.cli import open_blend, run
from addon_rfgs.materials import coloring
from addon_rfgs.materials.guesses import guesses
from addon_rfgs.scene.bands import Band, out_of_band, suitable, used_bands
from addon_rfgs.scene.check import check_scene
from addon_rfgs.scene.state import kept, show_what_renders
from addon_rfgs.tables import MATERIALS
from rfgs_core.radio import PRESETS
from rfgs_core.radio.materials import MATERIALS as FACTORY

pytestmark = pytest.mark.usefixtures("in_room")


def test_validity_is_the_factory_s() -> None:
    for radio in PRESETS.values():
        band = Band(radio.name, radio.freq_min_hz, radio.freq_max_hz)
        for name, material in FACTORY.items():
            assert band.within(name) == material.covers(radio), (radio.name, name)
        assert suitable([band]) == sorted(m.name for m in FACTORY.values() if m.covers(radio))


def test_the_carrier_goes_before_the_devices() -> None:
    scene = bpy.context.scene
    point = bpy.data.objects["ap"].rfgs
    assert [band.label for band in used_bands(scene)] == ["radio 'wifi'"]
    assert out_of_band("floorboard", used_bands(scene)) and suitable(used_bands(scene))
    point.radio, point.rf.freq_min_ghz, point.rf.freq_max_ghz = "scene", 60, 61
    assert not out_of_band("floorboard", used_bands(scene))
    assert out_of_band("brick", used_bands(scene))
    point.radio = "any"
    assert used_bands(scene) == []
    scene.rfgs.materials.carrier_ghz = 28.0
    (band,) = used_bands(scene)
    assert band.text == "28 GHz" and band.within("brick") and not band.within("floorboard")


def test_guesses_are_those_of_the_export() -> None:
    box("panel", (-1, 1.8, 0), (1, 1.8, 1), "mystery")
    told = {row["object"]: row["value"] for row in check_scene(bpy.context.scene)["guesses"]}
    found = {row.material: row for row in guesses(bpy.context.scene)}
    assert set(found) == {"Concrete Floor", "painted", "skin", "mystery"}
    for item in ("floor", "crate", "body", "panel"):
        name = bpy.data.objects[item].data.materials[0].name
        assert found[name].radio_material == told[f"{item}, material {name}"]
    assert found["mystery"].why == "flat" and found["mystery"].radio_material == "plasterboard"
    bpy.data.materials["mystery"].rfgs.radio_material = "glass"
    assert "mystery" not in {row.material for row in guesses(bpy.context.scene)}


def test_the_larger_area_decides() -> None:
    box("steel cover", (-1, 1.8, 0), (0, 1.9, 1), "shared")
    box("oak shelf", (-1, 1.5, 0), (-0.8, 1.6, 0.2), "shared")
    (row,) = [row for row in guesses(bpy.context.scene) if row.material == "shared"]
    assert row.radio_material == "metal" and row.why.endswith("elsewhere wood")


def test_the_table_is_confirmed_before_it_is_applied() -> None:
    table = bpy.context.window_manager.rfgs.guesses
    assert not bpy.ops.rfgs.apply_guesses.poll()
    bpy.ops.rfgs.guess_materials()
    rows = {row.material: row for row in table.rows}
    assert rows["Concrete Floor"].why == "material name contains 'concrete'"
    rows["painted"].radio_material = "metal"
    rows["skin"].use = False
    assert bpy.ops.rfgs.apply_guesses() == {"FINISHED"}
    told = {item.name: item.rfgs.radio_material for item in bpy.data.materials}
    assert told == {"Concrete Floor": "concrete", "painted": "metal", "skin": "AUTO"}
    assert not table.rows


def test_presets_are_assigned_to_what_is_selected() -> None:
    for item in bpy.data.objects:
        item.select_set(item.name in ("crate", "floor"))
    bpy.ops.rfgs.assign_material(
        radio_material="brick", to="SELECTED", thickness_m=0.24, scattering=0.3
    )
    for name in ("painted", "Concrete Floor"):
        told = bpy.data.materials[name].rfgs
        assert told.radio_material == "brick"
        assert (told.thickness_m, told.scattering_coefficient) == pytest.approx((0.24, 0.3))
    assert bpy.data.materials["skin"].rfgs.radio_material == "AUTO"
    bpy.context.view_layer.objects.active = bpy.data.objects["crate"]
    bpy.ops.rfgs.assign_material(radio_material="metal")
    assert bpy.data.materials["painted"].rfgs.radio_material == "metal"
    bpy.context.view_layer.objects.active = bpy.data.objects["ap"]
    with pytest.raises(RuntimeError, match="the active object has no material"):
        bpy.ops.rfgs.assign_material(radio_material="metal")


def test_every_radio_material_has_a_colour_of_its_own() -> None:
    colors = np.array([coloring.radio_color(name) for name in ("AUTO", *MATERIALS)])
    apart = np.linalg.norm(colors[:, None] - colors[None], axis=2)
    assert apart[~np.eye(len(colors), dtype=bool)].min() > 0.15


def test_colours_come_back_exactly_even_after_saving(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    own = {}
    for material in bpy.data.materials:
        material.diffuse_color = rng.uniform(size=4)
        own[material.name] = tuple(material.diffuse_color)
    paint = bpy.data.materials["painted"]
    paint.rfgs.radio_material = "metal"
    exported = check_colors()
    bpy.ops.rfgs.color_materials()
    assert tuple(paint.diffuse_color) == pytest.approx(coloring.radio_color("metal"))
    paint.rfgs.radio_material = "glass"
    assert tuple(paint.diffuse_color) == pytest.approx(coloring.radio_color("glass")), "it follows"
    bpy.ops.rfgs.color_materials(action="COLOR")
    assert check_colors() == exported, "bundles keep the true colours"
    with kept(bpy.context.scene) as keeper:
        show_what_renders(keeper, bpy.context.scene)
        assert tuple(paint.diffuse_color) == own["painted"], "and so do pictures"
    assert tuple(paint.diffuse_color) == pytest.approx(coloring.radio_color("glass"))
    path = tmp_path / "coloured.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    open_blend(path)
    assert len(coloring.colored()) == 3
    bpy.ops.rfgs.color_materials()
    for material in bpy.data.materials:
        assert tuple(material.diffuse_color) == own[material.name]
        for name in ("colored", "own_color"):
            assert not material.rfgs.is_property_set(name), "nothing is left behind"


def check_colors() -> dict[str, list[float]]:
    """Colours that a bundle would hold, by material."""
    from addon_rfgs.scene.materials import _colour

    return {material.name: _colour(material) for material in bpy.data.materials}


def test_colours_come_back_when_the_add_on_goes() -> None:
    own = tuple(bpy.data.materials["painted"].diffuse_color)
    bpy.ops.rfgs.color_materials()
    addon_rfgs.unregister()
    assert tuple(bpy.data.materials["painted"].diffuse_color) == own
    addon_rfgs.register()


def test_materials_by_commands(tmp_path: Path, capfd: pytest.CaptureFixture) -> None:
    out = str(tmp_path / "said.blend")
    said = ("--thickness-m", "0.1", "--scattering", "0.2", "--out", out)
    assert run(["materials", "apply", "plywood", "painted", *said]) == 0
    assert run(["materials", "guess", "--out", out]) == 0
    assert "Concrete Floor  concrete  material name contains 'concrete'" in capfd.readouterr().out
    open_blend(Path(out))
    bpy.data.objects["ap"].rfgs.radio = "mmwave"
    assert run(["materials", "list", "--json", str(tmp_path / "rows.json")]) == 0
    assert "NOT VALID AT 60–64 GHz" in capfd.readouterr().out
    rows = {row["name"]: row for row in json.loads((tmp_path / "rows.json").read_text())}
    assert rows["painted"]["radio_material"] == "plywood" and rows["painted"]["out_of_band"]
    assert rows["skin"]["why"] == "set in the file" and not rows["skin"]["out_of_band"]
    assert bpy.data.materials["painted"].rfgs.thickness_m == pytest.approx(0.1)
    assert run(["materials", "color", "--out", out]) == 0
    assert run(["materials", "color", "--restore", "--out", out]) == 0


@pytest.mark.parametrize(
    ("task", "words"),
    [
        (("apply", "wood", "paintd"), "did you mean 'painted'"),
        (("apply", "wod", "painted"), "invalid choice"),
        (("apply", "floorboard", "painted"), "known from 50–100 GHz only"),
        (("apply", "brick", "painted", "--carrier-ghz", "60"), "not at 60 GHz of the carrier"),
        (("apply", "wood", "painted", "--scattering", "2"), "expected 0 to 1"),
    ],
)
def test_mistakes_get_one_line(
    tmp_path: Path, capfd: pytest.CaptureFixture, task: tuple[str, ...], words: str
) -> None:
    assert run(["materials", *task, "--out", str(tmp_path / "never.blend")]) == 2
    said = capfd.readouterr().err
    assert said.startswith("error: ") and said.count("\n") == 1 and words in said, said
    assert not list(tmp_path.iterdir())
