# SPDX-License-Identifier: Apache-2.0
"""Shape checks at run time for every test, and Pythons of their own for those that need one."""

from __future__ import annotations

import gc
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from jaxtyping import install_import_hook

import rfgs_core  # noqa: F401  before torch, as programs do: it tells OpenMP how threads wait

# isort: split
import torch

if TYPE_CHECKING:
    from rfgs_core.run import Run

ROOT = Path(__file__).resolve().parents[1]

# Packages with numba kernels are left out: the hook would wrap a kernel that calls another, and
# numba's cache cannot store the wrapper.
install_import_hook(["rfgs_core.radio", "rfgs_core.gaussians"], "beartype.beartype")

# How fast tests go tells nothing of how fast this machine is: their notes are kept apart.
os.environ.setdefault("XDG_CACHE_HOME", str(Path.home() / ".cache" / "rfgs-tests"))

if not torch.cuda.is_available():
    # Kernels for a GPU then run in Triton's interpreter; triton reads it when it is imported.
    os.environ["TRITON_INTERPRET"] = "1"


def pytest_configure(config: pytest.Config) -> None:
    """Gives a worker that runs tests beside others one thread: two of them fill two cores."""
    if hasattr(config, "workerinput"):
        import numba

        torch.set_num_threads(1)
        numba.set_num_threads(1)


def pytest_collection_finish() -> None:
    """Spares the garbage collector what was loaded until here, which stays to the end.

    And sets it as programs do (`rfgs_core.interrupts`).
    """
    gc.set_threshold(10_000)
    gc.freeze()


@pytest.hookimpl(trylast=True)
def pytest_unconfigure() -> None:
    """Gives back what was set aside: libraries complain of what is still there at the end."""
    gc.unfreeze()


@pytest.fixture(scope="session")
def python() -> Callable[..., subprocess.CompletedProcess[str]]:
    """Runs Python in the repository's folder; `must_work` shows what a failed run said."""

    def run(*arguments: str | Path, must_work: bool = False) -> subprocess.CompletedProcess[str]:
        # A Blender of the developer's own, without our extension, would be asked otherwise.
        without_blender = {name: value for name, value in os.environ.items() if name != "BLENDER"}
        done = subprocess.run(
            [sys.executable, *map(str, arguments)],
            cwd=ROOT,
            env=without_blender | {"PYTHONPATH": str(ROOT)},
            capture_output=True,
            text=True,
            timeout=400,
            check=False,
        )
        if must_work:
            assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
        return done

    return run


@pytest.fixture(scope="session")
def start_cluster() -> Callable[..., AbstractContextManager[Any]]:
    """Starts a cluster of two processes of this machine, which come back when they are killed."""

    @contextmanager
    def running(folder: Path, threads: int = 1) -> Iterator[Any]:
        from distributed import LocalCluster

        with LocalCluster(
            n_workers=2,
            threads_per_worker=threads,
            processes=True,
            dashboard_address=None,
            local_directory=str(folder / "dask"),
            silence_logs=50,
        ) as cluster:
            yield cluster

    return running


@pytest.fixture
def cluster(
    start_cluster: Callable[..., AbstractContextManager[Any]], tmp_path: Path
) -> Iterator[Any]:
    with start_cluster(tmp_path) as cluster:
        yield cluster


@pytest.fixture(scope="session")
def tiny_dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a finished dataset of two frames; copy it before changing anything."""
    # Loaded here: the hook above must come before the first module of rfgs_core.
    from tiny_dataset import write_tiny_dataset

    return write_tiny_dataset(tmp_path_factory.mktemp("tiny") / "dataset")


@pytest.fixture(scope="session")
def small_run(tiny_dataset: Path, tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A run of 40 Gaussians on both frames; copy it before changing anything."""
    from rfgs_core.dataset import open_dataset
    from rfgs_core.run.training import train_sequence
    from rfgs_core.settings import TrainConfig

    data = open_dataset(tiny_dataset)
    config = TrainConfig(num_gaussians=40, solver_steps=2, iterations=1, posture="standing")
    out = tmp_path_factory.mktemp("predicted") / "run"
    return train_sequence(data, data.sequence(), "wifi", [1, 2], config, out)
