# SPDX-License-Identifier: Apache-2.0
"""Every operator, panel and property of the add-on; `test_inside_blender.py` runs this file."""

from __future__ import annotations

import argparse
import re
from pathlib import Path

import bpy
import pytest

import addon_rfgs
from addon_rfgs.cli import commands, parser, run
from addon_rfgs.path_options import RELATIVE_PATH
from addon_rfgs.registration import CLASSES

#: Operator → the command that does the same.
COMMANDS = {
    "add_crop_box": "import",
    "add_device": "devices add",
    "apply_guesses": "materials guess",
    "assign_material": "materials apply",
    "check_scene": "check",
    "clear_coverage": "coverage",
    "clear_paths": "paths",
    "color_materials": "materials color",
    "color_solid_view": "import",
    "compare_gaussians": "import",
    "duplicate_device": "devices duplicate",
    "evaluate_run": "evaluate",
    "export_bundle": "export",
    "export_gaussians": "export-gaussians",
    "follow_live": "live",
    "forget_job": "forget",
    "generate_dataset": "generate",
    "guess_materials": "materials guess",
    "import_capture": "devices capture",
    "import_devices": "devices import",
    "import_gaussians": "import",
    "import_ply": "import",
    "import_result": "import",
    "match_devices": "devices match",
    "mirror_device": "devices mirror",
    "place_radio": "devices preset",
    "remove_data": "remove-data",
    "remove_device": "devices remove",
    "render_groundtruth": "groundtruth",
    "repair_finding": "fix",
    "resume_job": "resume",
    "select_finding": "check",
    "show_coverage": "coverage",
    "show_csi": "csi",
    "show_paths": "paths",
    "stop_job": "stop",
    "stop_live": "live",
    "test_environment": "environment",
    "train_gaussians": "train",
    "update_display": "import",
}
#: Properties of operators without a command of their own → the option that does the same.
OPTIONS = {"compare_gaussians.every_frame": "--compare", "import_ply.filepath": "path"}
#: Settings of panels that no command reads: of the view, and of a window that asks to be saved.
OF_THE_WINDOW = {"devices.overlay", "devices.names", "devices.active", "jobs.save_first"}
#: A comparison by command takes what moves: a file without a window has no selection to speak of.
OF_THE_WINDOW |= {"gaussians.compare_with", "gaussians.legend"}
#: Operators that leave the file as it is; all others can be undone.
LEAVE_THE_FILE = {
    *("evaluate_run", "export_bundle", "export_gaussians", "forget_job", "generate_dataset"),
    *("check_scene", "guess_materials"),
    *("render_groundtruth", "resume_job", "stop_job", "stop_live", "test_environment"),
    "train_gaussians",
}


pytestmark = pytest.mark.usefixtures("registered")


def classes(base: type) -> list[type]:
    """Registered classes of the add-on."""
    found = [kind for kind in all_below(base) if kind.__module__.startswith("addon_rfgs.")]
    return [kind for kind in found if kind.is_registered]


def all_below(base: type) -> set[type]:
    return {base, *(deeper for kind in base.__subclasses__() for deeper in all_below(kind))}


def operators() -> dict[str, type]:
    return {kind.bl_idname.removeprefix("rfgs."): kind for kind in classes(bpy.types.Operator)}


def command_words(tree: argparse.ArgumentParser, before: str = "") -> dict[str, str]:
    """Every command, those below others included, and what its help says."""
    found = {}
    for action in tree._actions:
        if isinstance(action, argparse._SubParsersAction):
            helps = {choice.dest: choice.help or "" for choice in action._choices_actions}
            for name, deeper in action.choices.items():
                found[f"{before}{name}"] = helps.get(name, "")
                found |= command_words(deeper, f"{before}{name} ")
    return found


def test_every_operator_has_a_command() -> None:
    known = command_words(parser("rfgs"))
    assert sorted(operators()) == sorted(COMMANDS)
    assert not set(COMMANDS.values()) - set(known)
    assert all(known.values()), "every command says what it does"


def options(command: str) -> set[str]:
    """Properties that a command sets, and the words for them."""
    tree = parser("rfgs")
    for word in command.split():
        (below,) = [row for row in tree._actions if isinstance(row, argparse._SubParsersAction)]
        tree = below.choices[word]
    words = {word for action in tree._actions for word in (*action.option_strings, action.dest)}
    return words | {name for word in words for name in word.split("+")}


def test_every_property_of_an_operator_is_an_option() -> None:
    own = {kind: command for command, kind in commands() if kind is not None}
    lacking = []
    for name, kind in operators().items():
        there = options(COMMANDS[name])
        if kind in own:
            assert own[kind].name == COMMANDS[name]
            there |= {row for meant in own[kind].means.values() for row in meant}
        for spec in getattr(bpy.ops.rfgs, name).get_rna_type().properties:
            if spec.identifier != "rna_type" and not spec.is_hidden:
                said = OPTIONS.get(f"{name}.{spec.identifier}", spec.identifier)
                lacking += [f"{name}.{spec.identifier}"] if said not in there else []
    assert not lacking


def test_every_setting_of_a_panel_is_an_option() -> None:
    read = {
        f"{group}.{name}"
        for row, _ in commands()
        for group in row.reads
        for name in row.reads[group]
    }
    lacking = {
        f"{group.identifier}.{spec.identifier}"
        for group in bpy.context.scene.rfgs.bl_rna.properties
        if group.identifier not in ("rna_type", "name")
        for spec in group.fixed_type.properties
        if spec.identifier not in ("rna_type", "name")
    }
    assert lacking - read == OF_THE_WINDOW


def test_every_command_teaches_and_refuses(capfd: pytest.CaptureFixture[str]) -> None:
    for name in command_words(parser("rfgs")):
        assert run([*name.split(), "--help"]) == 0
        assert "usage:" in capfd.readouterr().out, name
        assert run([*name.split(), "--no-such-option"]) == 2
        errors = capfd.readouterr().err.strip().splitlines()
        assert len(errors) == 1 and errors[0].startswith("error: "), name


def test_operators_follow_blenders_conventions() -> None:
    for name, kind in operators().items():
        assert kind.__name__ == f"RFGS_OT_{name}"
        described = getattr(bpy.ops.rfgs, name).get_rna_type().description
        assert described and not described.endswith(".") and "  " not in described, described
        assert kind.bl_label == kind.bl_label.strip(".") and kind.bl_label[0].isupper(), name
        assert ("UNDO" in getattr(kind, "bl_options", set())) == (name not in LEAVE_THE_FILE), name


def test_panels_stand_in_our_tab() -> None:
    panels = classes(bpy.types.Panel)
    assert len(panels) > 8
    for kind in panels:
        assert kind.__name__.startswith("RFGS_PT_") and kind.bl_category == "RF-GS"
    for kind in classes(bpy.types.UIList):
        assert kind.__name__.startswith("RFGS_UL_")


def test_a_ply_can_be_chosen_in_the_import_menu_or_dropped() -> None:
    entries = bpy.types.TOPBAR_MT_file_import.draw._draw_funcs
    assert [entry.__module__ for entry in entries].count("addon_rfgs.gaussians.file_menu") == 1
    (handler,) = classes(bpy.types.FileHandler)
    assert handler.bl_import_operator == "rfgs.import_ply"
    assert handler.bl_file_extensions == ".ply"
    assert not handler.poll_drop(bpy.context), "there is no 3D view"


def test_every_property_says_what_it_is() -> None:
    kinds = [
        *classes(bpy.types.PropertyGroup),
        *classes(bpy.types.Operator),
        *classes(bpy.types.AddonPreferences),
    ]
    assert len(kinds) > 20
    silent = []
    for kind in kinds:
        inherited = {"rna_type", "name", *kind.__base__.bl_rna.properties.keys()}
        for spec in kind.bl_rna.properties:
            if spec.identifier in inherited and spec.identifier not in own(kind):
                continue
            told = spec.description
            if spec.type != "POINTER" and (not told or told.endswith(".") or not spec.name):
                silent.append(f"{kind.__name__}.{spec.identifier}: {told!r}")
    assert not silent


def own(kind: type) -> set[str]:
    return {name for base in kind.__mro__ for name in vars(base).get("__annotations__", {})}


def test_paths_of_settings_may_begin_at_the_file() -> None:
    if not RELATIVE_PATH:
        pytest.skip("this Blender does not ask")
    paths = [
        f"{kind.__name__}.{spec.identifier}"
        for kind in classes(bpy.types.PropertyGroup)
        for spec in kind.bl_rna.properties
        if spec.type == "STRING" and spec.subtype in {"FILE_PATH", "DIR_PATH"}
        if not spec.is_path_supports_blend_relative
    ]
    assert not paths


def test_the_docs_name_every_command() -> None:
    page = Path(addon_rfgs.__file__).parents[1] / "docs" / "blender.md"
    prose = re.sub(r"```.*?```", "", page.read_text("utf-8"), flags=re.DOTALL)
    words = {word for span in re.findall(r"`([^`\n]+)`", prose) for word in span.split()}
    top = {name for name in command_words(parser("rfgs")) if " " not in name}
    assert not sorted(top - words)


#: Numbers that are counted, shares and factors, and what their mode gives a unit: all others say
#: theirs in their name, or Blender writes it behind the value.
WITHOUT_UNIT = {
    *("jobs.depth", "jobs.workers", "jobs.cameras", "jobs.samples", "jobs.seed"),
    *("jobs.iterations", "jobs.gaussians", "export.cameras", "export.samples"),
    *("gaussians.size", "gaussians.range_low", "gaussians.range_high", "gaussians.frame_offset"),
    *(
        "coverage.tx_device",
        "paths.count",
        "paths.tx_device",
        "paths.rx_device",
        "channels.tx_device",
    ),
    *("channels.rx_device", "live.port", "devices.active", "material.scattering_coefficient"),
    *("radio.num_subcarriers", "radio.tx_rows", "radio.tx_cols", "radio.rx_rows", "radio.rx_cols"),
}
_UNITS = re.compile(r"\[(GHz|dB|dBm|m|m²|λ|s|px|°)\]")


def test_every_quantity_of_the_panel_has_a_unit() -> None:
    scene = bpy.context.scene.rfgs
    groups = {
        row.identifier: row.fixed_type
        for row in scene.bl_rna.properties
        if row.identifier not in ("rna_type", "name")
    }
    groups["material"] = bpy.types.Material.bl_rna.properties["rfgs"].fixed_type
    groups["object"] = bpy.types.Object.bl_rna.properties["rfgs"].fixed_type
    groups["radio"] = groups["object"].properties["rf"].fixed_type
    lacking = {
        f"{group}.{spec.identifier}"
        for group, kind in groups.items()
        for spec in kind.properties
        if spec.type in {"INT", "FLOAT"}
        and not spec.is_hidden
        and spec.subtype not in {"PIXEL", "FACTOR", "PERCENTAGE", "ANGLE"}
        and not _UNITS.search(spec.name)
    }
    assert lacking == WITHOUT_UNIT


def test_every_choice_has_words_and_every_operator_says_what_it_does() -> None:
    for kind in (*classes(bpy.types.PropertyGroup), *classes(bpy.types.Operator)):
        for spec in kind.bl_rna.properties:
            if spec.type == "ENUM" and spec.identifier not in ("rna_type",):
                for row in spec.enum_items_static:
                    assert row.name and row.name != row.identifier, (kind, spec.identifier)
    for name, kind in operators().items():
        words = getattr(kind, "bl_description", "") or kind.__doc__
        assert len(words.split()) >= 4, f"{name}: {words}"


def test_every_button_that_cannot_be_pressed_says_why() -> None:
    bpy.ops.wm.read_homefile(use_empty=True)
    grey = [name for name in operators() if not getattr(bpy.ops.rfgs, name).poll()]
    assert {"generate_dataset", "stop_job", "import_result", "repair_finding"} <= set(grey)
    for name in grey:
        with pytest.raises(RuntimeError) as refused:
            getattr(bpy.ops.rfgs, name)()
        reason = str(refused.value).partition("poll() ")[2].strip()
        assert len(reason.split()) >= 3 and "context is incorrect" not in reason, (name, reason)


def test_steps_stand_in_their_order() -> None:
    panels = [kind for kind in CLASSES if issubclass(kind, bpy.types.Panel)]
    top = [kind.bl_label for kind in panels if not getattr(kind, "bl_parent_id", "")]
    steps = ["1 Radios", "2 Check", "3 Generate", "4 Train", "Jobs", "5 Inspect", "This File"]
    assert top == steps
