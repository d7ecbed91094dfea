# SPDX-License-Identifier: Apache-2.0
"""Blender runs in Pythons of its own: it keeps one file open and cannot be unloaded."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

_STATUS = pytest.StashKey[int]()
Run = Callable[..., subprocess.CompletedProcess[str]]


def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    """Notes how the tests went, for the end."""
    session.config.stash[_STATUS] = int(exitstatus)


@pytest.hookimpl(trylast=True)
def pytest_unconfigure(config: pytest.Config) -> None:
    """Leaves Blender 4.2 as it must be left: as a module it crashes when Python is gone."""
    bpy = sys.modules.get("bpy")
    if bpy is not None and bpy.app.version < (4, 3, 0):
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(config.stash.get(_STATUS, 3))


@pytest.fixture(scope="session")
def addon(python: Run) -> Run:
    """Runs `python -m addon_rfgs --blend …`."""
    return lambda blend, *arguments: python("-m", "addon_rfgs", "--blend", blend, *arguments)


@pytest.fixture
def pass_inside(python: Run, monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Runs the tests of `inside_NAME.py`, all of which must pass, in one Python of their own."""

    # Plugins that other packages bring along take half a second to load, and none is used.
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")

    def run(*names: str) -> None:
        inner = [Path(__file__).with_name(f"inside_{name}.py") for name in names]
        # Without the `conftest.py` above, which loads torch: Blender has none, nor has the add-on.
        own = ("-p", "no:cacheprovider", "--confcutdir", Path(__file__).parent)
        done = python("-m", "pytest", "-q", "-x", *own, *inner)
        assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-2000:]
        assert " passed" in done.stdout

    return run


@pytest.fixture
def rfgs_python(tmp_path: Path) -> Path:
    """A Python that has rfgs, as a user's environment does."""
    program = tmp_path / "python"
    root = Path(__file__).parents[2]
    program.write_text(f'#!/bin/sh\nPYTHONPATH="{root}" exec "{sys.executable}" "$@"\n')
    program.chmod(0o755)
    return program


@pytest.fixture(scope="session")
def scenes(python: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of small .blend files and their bundles."""
    folder = tmp_path_factory.mktemp("scenes")
    python(Path(__file__).with_name("build_scenes.py"), folder, must_work=True)
    return folder


@pytest.fixture(scope="session")
def results(scenes: Path) -> dict[str, Any]:
    """What happened to each scene."""
    return json.loads((scenes / "results.json").read_text())


@pytest.fixture(scope="session")
def registered() -> Iterator[None]:
    """The add-on, switched on; for tests that run inside Blender."""
    import addon_rfgs

    addon_rfgs.register()
    yield
    addon_rfgs.unregister()


@pytest.fixture
def empty_scene(registered: None) -> Iterator[Any]:
    """A scene without anything; preferences that name the environment, $RFGS_PYTHON."""
    import bpy
    from blank_file import open_blank_file

    from addon_rfgs.jobs.preferences import ADDON

    open_blank_file()
    stored = bpy.context.preferences.addons.new()
    stored.module = ADDON
    stored.preferences.python = os.environ["RFGS_PYTHON"]
    yield bpy.context.scene
    bpy.context.preferences.addons.remove(stored)


@pytest.fixture
def in_room(registered: None) -> None:
    """The small room of `build_scenes.py`, open and as it was built."""
    from build_scenes import room

    room()


@pytest.fixture
def settings(registered: None, tmp_path: Path) -> Any:
    """The Gaussians panel's settings, after a run of three frames was imported as point clouds."""
    import bpy
    from blank_file import open_blank_file
    from splat_files import write_run
    from splat_scene import FRAMES

    open_blank_file()
    found = bpy.context.scene.rfgs.gaussians
    found.solid_view = False  # What nodes do to single points is asked, not how it is drawn.
    found.path = str(write_run(tmp_path / "run", FRAMES))
    assert bpy.ops.rfgs.import_gaussians() == {"FINISHED"}
    return found
