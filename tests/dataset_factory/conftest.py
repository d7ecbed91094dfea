# SPDX-License-Identifier: Apache-2.0
"""A real Blender file and a real dataset made from it, small enough for quick tests."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dataset_factory import cli
from dataset_factory.check.validate import validate
from dataset_factory.make.generate import generate
from dataset_factory.plan.contents import make_plan
from dataset_factory.plan.disk import Space, space
from dataset_factory.plan.job import Job
from dataset_factory.scene.blender import Blender
from dataset_factory.scene.catalogue import find_scene
from rfgs_core.dataset import open_dataset
from rfgs_core.dataset.writer import finish_dataset

ROOT = Path(__file__).resolve().parents[2]

BuildScene = Callable[..., Path]
MakeJob = Callable[..., Job]
Factory = Callable[..., subprocess.CompletedProcess[str]]


def build(out: Path, moving: str, wall: str, scale: str, kind: str = "PERSON") -> Path:
    builder = Path(__file__).with_name("build_tiny_scene.py")
    subprocess.run(
        [sys.executable, str(builder), str(out), moving, wall, scale, kind],
        check=True,
        capture_output=True,
        timeout=120,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    return out


@pytest.fixture(scope="session", autouse=True)
def points_spread_once() -> Iterator[None]:
    """Spreads points over each mesh once for all tests: half of what a tracer takes to be made.

    A mesh that comes for the second time is spread again, and must get the same points.
    """
    from rfgs_core.simulate.surface import points

    spread, kept, compared = points.spread, {}, set()

    def once(*arguments: Any) -> tuple[np.ndarray, ...]:
        *arrays, per_m2, rng = arguments
        key = (*(array.tobytes() for array in arrays), per_m2, str(rng.bit_generator.state))
        if key not in compared:
            found = spread(*arguments)
            for one, other in zip(found, kept.get(key, found), strict=True):
                np.testing.assert_array_equal(one, other)
            if key in kept:
                compared.add(key)
            kept[key] = found
        return tuple(array.copy() for array in kept[key])

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(points, "spread", once)
        yield


@pytest.fixture(scope="session")
def build_scene(tmp_path_factory: pytest.TempPathFactory) -> BuildScene:
    """Builds a scene, each once; `kind` is the class of the box that moves.

    Half a person's size has a quarter of its points, and is traced in three quarters of the time.
    """

    @cache
    def make(
        moving: bool = True, wall: str = "concrete", scale: float = 0.5, kind: str = "PERSON"
    ) -> Path:
        out = tmp_path_factory.mktemp("scene") / "box_room.blend"
        return build(out, "moving" if moving else "still", wall, str(scale), kind)

    return make


@pytest.fixture(scope="session")
def box_room(build_scene: BuildScene) -> Path:
    """A box of a child's size that walks through a concrete room of 3 x 3 x 2.5 m."""
    return build_scene()


@pytest.fixture(scope="session")
def make_job(box_room: Path) -> MakeJob:
    """A job of two frames, one camera of 32 px, Wi-Fi at depth 1."""

    def make(
        out: Path,
        *,
        frames: str = "1:2",
        seed: int = 0,
        images: bool = True,
        paths: bool = False,
        blend: Path = box_room,
        **options: Any,
    ) -> Job:
        plan = make_plan(
            find_scene(str(blend)),
            ("wifi",),
            frames,
            cameras=1,
            resolution=32,
            samples=2,
            depth=1,
            seed=seed,
            shadow="kirchhoff",
            images=images,
            paths=paths,
        )
        return Job(out, plan, Blender(blend), **{"workers": 1, **options})

    return make


@pytest.fixture(scope="session")
def watched_box(
    make_job: MakeJob, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, list[Space]]:
    """A finished dataset, and each estimate of its disk from before it was there."""
    out, estimates = tmp_path_factory.mktemp("factory") / "dataset", []

    def kept(*arguments: Any) -> Space:
        estimates.append(space(*arguments))
        return estimates[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("dataset_factory.make.generate.space", kept)
        assert generate(make_job(out))
    return out, estimates


@pytest.fixture(scope="session")
def box_dataset(watched_box: tuple[Path, list[Space]]) -> Path:
    """A finished dataset; copy it before changing anything."""
    return watched_box[0]


@pytest.fixture
def box_copy(box_dataset: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(box_dataset, tmp_path / "dataset"))


@pytest.fixture
def tiny_copy(tiny_dataset: Path, tmp_path: Path) -> Path:
    """A copy of the made-up dataset, to be changed."""
    return Path(shutil.copytree(tiny_dataset, tmp_path / "dataset"))


@pytest.fixture(scope="session")
def resealed() -> Callable[[Path], list[str]]:
    """Faults of a dataset after its checksums were made to fit the damage."""

    def faults(path: Path) -> list[str]:
        finish_dataset(path, open_dataset(path).info)
        return validate(path)

    return faults


@pytest.fixture(scope="session")
def data_of() -> Callable[[Path], dict[str, bytes]]:
    """All bytes of a dataset but its log."""

    def read(path: Path) -> dict[str, bytes]:
        return {
            name.as_posix(): (path / name).read_bytes()
            for name in (file.relative_to(path) for file in path.rglob("*") if file.is_file())
            if name.parts[0] != "log"
        }

    return read


@pytest.fixture(scope="session")
def unfinish() -> Callable[[Path], None]:
    """Takes a finished dataset back to the state before its manifest was written."""

    def back(path: Path) -> None:
        from rfgs_core.dataset.schema import read_dataset_info
        from rfgs_core.dataset.writer import write_dataset_info

        info = read_dataset_info(path / "dataset.json")
        versions = {key: value for key, value in info.versions.items() if key != "blender"}
        write_dataset_info(path, replace(info, versions=versions, manifest_sha256=""))
        (path / "MANIFEST.sha256").unlink()

    return back


@pytest.fixture(scope="session")
def factory() -> Factory:
    """Runs `rfgs-factory` in a process of its own."""

    def run(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-m", "dataset_factory", *arguments],
            capture_output=True,
            text=True,
            timeout=240,
            cwd=ROOT,
            env={**os.environ, **environment},
        )

    return run


@pytest.fixture
def factory_here(capsys: pytest.CaptureFixture[str]) -> Factory:
    """Runs `rfgs-factory` in this process, which spares a start where the command is what counts.

    Of processes, their codes and streams tell the tests that take `factory`.
    """

    def run(*arguments: str) -> subprocess.CompletedProcess[str]:
        capsys.readouterr()
        code = cli.main(arguments)
        return subprocess.CompletedProcess(arguments, code, *capsys.readouterr())

    return run
