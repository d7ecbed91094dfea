# SPDX-License-Identifier: Apache-2.0
"""A scene is named by the catalogue or by its file; a folder is neither."""

from __future__ import annotations

from pathlib import Path

import pytest

from dataset_factory.scene.catalogue import find_scene
from rfgs_core.errors import RfgsError


def test_a_dataset_folder_with_a_scenes_name_does_not_hide_the_scene(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`generate corridor --out corridor`, and the same again to go on with it."""
    shipped = find_scene("corridor")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "corridor").mkdir()
    assert find_scene("corridor") == shipped
    (tmp_path / "mine").mkdir()
    with pytest.raises(RfgsError, match=r"no scene 'mine'; expected a \.blend file or one of"):
        find_scene("mine")


def test_a_file_of_any_name_is_asked_whether_it_is_blenders(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "corridor").write_text("notes")
    with pytest.raises(RfgsError, match="not a Blender file"):
        find_scene("corridor")
