# SPDX-License-Identifier: Apache-2.0
"""What `--radio` may name besides presets."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from dataset_factory.plan.contents import make_plan
from dataset_factory.scene.catalogue import find_scene
from dataset_factory.scene.radios import chosen_radios, scene_radio
from rfgs_core.errors import RfgsError
from rfgs_core.files import read_json, write_json
from rfgs_core.radio import preset
from rfgs_core.sync import SCENE_FIELDS


def empty(name: str, radio: str = "scene", **changed: Any) -> dict[str, Any]:
    fields = {key: getattr(preset("wifi"), key) for key in SCENE_FIELDS}
    return {"name": name, "radio": radio, "role": "ACCESS_POINT", "rf": {**fields, **changed}}


def bundle(*devices: dict[str, Any]) -> Any:
    return SimpleNamespace(
        devices=list(devices), path=Path("bundle"), info={"blend_name": "room.blend"}
    )


def test_presets_files_and_the_scene_may_be_mixed(tmp_path: Path) -> None:
    (tmp_path / "lab.yaml").write_text("like: wifi24\npattern: dipole\n")
    found = chosen_radios(("uwb", str(tmp_path / "lab.yaml"), "scene"))
    assert list(found) == ["uwb", "lab", "scene"]
    assert found["lab"] == replace(preset("wifi24"), name="lab", pattern="dipole")


def test_one_name_means_one_radio(tmp_path: Path) -> None:
    with pytest.raises(RfgsError, match="a radio is named twice: wifi"):
        chosen_radios(("wifi", "wifi"))
    (tmp_path / "scene.yaml").write_text("like: wifi\n")
    with pytest.raises(RfgsError, match="'scene' is kept for the scene's own radio"):
        chosen_radios((str(tmp_path / "scene.yaml"),))


def test_empties_make_a_radio() -> None:
    changed = {"freq_min_hz": 2.4e9, "freq_max_hz": 2.48e9, "polarization": "VH", "rx_cols": 2}
    found = scene_radio(
        bundle(empty("a", **changed), empty("b", "any", **changed), empty("c", "wifi"))
    )
    assert asdict(found) == {
        **asdict(preset("wifi")),
        **changed,
        "name": "scene",
        "num_devices": 2,
    }


def test_empties_that_do_not_fit_are_named() -> None:
    with pytest.raises(RfgsError, match="no Empty has a role in the radio 'scene'"):
        scene_radio(bundle(empty("a", "wifi")))
    with pytest.raises(RfgsError, match=r"power_dbm is 20\.0 at 'a' but 7\.0 at 'b'"):
        scene_radio(bundle(empty("a"), empty("b", power_dbm=7.0)))
    with pytest.raises(RfgsError, match=r"room\.blend: Empty 'a': freq_min_hz, freq_max_hz"):
        scene_radio(bundle(empty("a", freq_max_hz=1e9)))


def test_a_plan_with_a_radio_of_ones_own_equals_its_stored_self(tmp_path: Path) -> None:
    """Otherwise no such dataset could be continued."""
    (tmp_path / "lab.yaml").write_text("like: wifi24\nheights_m: [1, 2, 3]\n")
    (tmp_path / "room.blend").write_bytes(b"BLENDER")
    scene = find_scene(str(tmp_path / "room.blend"))
    names = (str(tmp_path / "lab.yaml"), "scene")
    more: dict[str, Any] = {"cameras": 0, "resolution": 64, "samples": 1, "depth": 1, "seed": 0}
    plan = make_plan(scene, names, "1:2", shadow="hard", images=False, **more)
    found = plan.with_radio(replace(preset("wifi"), name="scene", tx_offset_m=(0.0, 0.1, 0.2)))
    for wanted in (plan, found):
        write_json(tmp_path / "plan.json", asdict(wanted))
        assert read_json(tmp_path / "plan.json") == asdict(wanted)
    assert plan.radio("lab") == replace(preset("wifi24"), name="lab", heights_m=(1.0, 2.0, 3.0))
    assert found.radio("scene").tx_offset_m == (0.0, 0.1, 0.2)


def test_devices_without_properties_make_no_radio() -> None:
    with pytest.raises(RfgsError, match="hold no radio properties; describe the radio in a file"):
        scene_radio(bundle({"name": "a", "radio": "any", "role": "ACCESS_POINT"}))
