# SPDX-License-Identifier: Apache-2.0
"""Caches lie in a folder of the user's own that nobody else can write or read."""

from __future__ import annotations

import os
import stat
from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess

import pytest

from rfgs_core.cache import cache_folder
from rfgs_core.errors import RfgsError

Python = Callable[..., CompletedProcess[str]]


def test_folders_are_the_users_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    before = os.umask(0)
    try:
        made = cache_folder("kernels")
    finally:
        os.umask(before)
    assert made == tmp_path / "cache" / "rfgs" / "kernels"
    made.chmod(0o755)
    cache_folder("kernels")
    for folder in (made, made.parent):
        assert stat.S_IMODE(folder.stat().st_mode) == 0o700


def test_without_a_setting_it_is_below_the_home(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    assert cache_folder("x") == tmp_path / ".cache" / "rfgs" / "x"


def test_a_link_or_a_file_in_its_place_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    (tmp_path / "victim").mkdir()
    (tmp_path / "rfgs").symlink_to(tmp_path / "victim")
    with pytest.raises(RfgsError, match="found a link or somebody else's"):
        cache_folder("x")
    assert not list((tmp_path / "victim").iterdir())
    (tmp_path / "rfgs").unlink()
    (tmp_path / "rfgs").write_text("")
    with pytest.raises(RfgsError, match="no cache can be made there"):
        cache_folder("x")


def test_kernels_are_never_kept_in_the_shared_temporary_folder(
    python: Python, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.delenv("DRJIT_CACHE_DIR", raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    code = "from dataset_factory.trace.setup import prepare; import os; prepare();"
    said = python("-c", code + "print(os.environ['DRJIT_CACHE_DIR'])", must_work=True).stdout
    assert said.strip() == str(tmp_path / ".cache/rfgs/drjit")
