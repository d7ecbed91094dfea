# SPDX-License-Identifier: Apache-2.0
"""The newest LLVM is chosen, old ones are refused with a remedy."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from rfgs_core import llvm
from rfgs_core.errors import MissingToolError

NAME = "DRJIT_LIBLLVM_PATH"
FOUND = {path: llvm.version_of(path) for path in llvm.candidates()}
USABLE = [path for path, version in FOUND.items() if version >= llvm.OLDEST_USABLE]
OLD = [path for path, version in FOUND.items() if 0 < version < llvm.OLDEST_USABLE]

needs_llvm = pytest.mark.skipif(not USABLE, reason="no usable LLVM on this machine")
needs_old_llvm = pytest.mark.skipif(not OLD, reason="no LLVM older than 16 on this machine")


@pytest.fixture(autouse=True)
def unnamed(monkeypatch: pytest.MonkeyPatch) -> None:
    """No library named; what a test sets is undone even where nothing was set before."""
    monkeypatch.setenv(NAME, "to be restored")
    monkeypatch.delenv(NAME)


def test_a_library_that_cannot_be_loaded_has_version_0(tmp_path: Path) -> None:
    file = tmp_path / "libLLVM-19.so"
    assert llvm.version_of(file) == 0
    file.write_text("not a library")
    assert llvm.version_of(file) == 0


def test_no_library_at_all_is_a_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(llvm, "candidates", list)
    with pytest.raises(MissingToolError, match=r"no LLVM found on this machine.*apt-get install"):
        llvm.use_llvm()
    assert NAME not in os.environ


def test_a_named_library_that_is_not_there_is_not_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(NAME, str(tmp_path / "libLLVM.so"))
    with pytest.raises(MissingToolError, match=f"no LLVM found on {NAME}="):
        llvm.use_llvm()
    assert os.environ[NAME] == str(tmp_path / "libLLVM.so")


@needs_old_llvm
def test_a_named_old_library_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(NAME, str(OLD[0]))
    message = rf"too old on {NAME}=.*\(version {FOUND[OLD[0]]}\); .*version 16 or newer"
    with pytest.raises(MissingToolError, match=message):
        llvm.use_llvm()


@needs_old_llvm
def test_the_file_name_tells_the_version_of_old_libraries() -> None:
    for path in OLD:
        assert f"-{FOUND[path]}" in path.name


@needs_old_llvm
def test_only_old_libraries_are_all_listed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(llvm, "candidates", lambda: OLD)
    with pytest.raises(MissingToolError) as caught:
        llvm.use_llvm()
    assert all(f"{path.name} (version {FOUND[path]})" in str(caught.value) for path in OLD)


@needs_llvm
def test_the_newest_is_chosen_and_told_to_drjit() -> None:
    path, version = llvm.use_llvm()
    assert version == max(FOUND.values())
    assert FOUND[path] == version
    assert os.environ[NAME] == str(path)


@needs_llvm
@pytest.mark.parametrize("backwards", [False, True])
def test_the_order_of_discovery_does_not_matter(
    monkeypatch: pytest.MonkeyPatch, backwards: bool
) -> None:
    monkeypatch.setattr(llvm, "candidates", lambda: sorted(FOUND, reverse=backwards))
    assert llvm.use_llvm()[1] == max(FOUND.values())


@needs_llvm
def test_a_named_library_is_taken_as_it_is(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    link = tmp_path / "mine.so"
    link.symlink_to(USABLE[0])
    monkeypatch.setenv(NAME, str(link))
    assert llvm.use_llvm() == (link, FOUND[USABLE[0]])
