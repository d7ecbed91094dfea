# SPDX-License-Identifier: Apache-2.0
"""Compiled kernels give the same bytes in the run that compiles them and in every later one.

Otherwise a dataset resumed on the next day would differ from an undisturbed one.
"""

from __future__ import annotations

import hashlib
import importlib
from pathlib import Path

import pytest
from numba.core.dispatcher import Dispatcher

import dataset_factory
import rfgs_core

_DIGESTS = """
import hashlib, os, sys
os.environ["NUMBA_CACHE_DIR"] = sys.argv[1]
import numpy as np, torch
from rfgs_core.simulate.shadow.fresnel import FRESNEL
from rfgs_core.simulate.shadow.outline import ShadowMesh
from rfgs_core.simulate.surface.facets import facet_sum
from rfgs_core.simulate.shadow.frequencies import nodes_for
from rfgs_core.simulate.shadow.kirchhoff import _shade
from rfgs_core.simulate.paths.steering import _steer
from rfgs_core.propagation import EnvironmentPaths, Links, Subcarriers, scatter, shadow
from rfgs_core.radio.constants import SPEED_OF_LIGHT

def show(name, arrays):
    data = b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)
    print(name, hashlib.sha256(data).hexdigest())

rng = np.random.default_rng(0)
n, links = 700, 6
points = rng.normal(size=(n, 3)) * 0.3 + [2.0, 2.0, 1.0]
normals = rng.normal(size=(n, 3))
normals /= np.linalg.norm(normals, axis=1, keepdims=True)
tx_xyz = rng.normal(size=(links, 3)) * 0.1
rx_xyz = rng.normal(size=(links, 3)) * 0.1 + [4.0, 4.0, 1.0]
freq_hz = 5.72e9 + 2.5e6 * np.arange(33)
area, weight = np.full(n, 1e-3), np.ones(n)
show("facets", [facet_sum(points, normals, area, tx_xyz, rx_xyz, weight, freq_hz)])

count, nodes = 300, 5
complex_ones = rng.normal(size=(count, nodes)) + 1j * rng.normal(size=(count, nodes))
steered = _steer(
    complex_ones, (np.ones((0, 0, 0, 0), dtype=np.complex128), np.arange(count), 0.0),
    rng.uniform(size=count) < 0.5,
    (points[:count], points[-count:], rng.uniform(size=count)),
    rng.normal(size=(count, links, 3)), np.stack([tx_xyz[0], rx_xyz[0]]), tx_xyz, rx_xyz,
    (np.arange(33) // 9, np.linspace(0.0, 1.0, 33), 120.0, 0.05),
)
show("steering", [steered])

# A cloud of triangles around the middle of twenty straight paths of 32 links each.
corners = np.stack([rng.normal(size=(20, 3)) * 0.4, rng.normal(size=(20, 3)) * 0.4 + [4, 4, 2]], 1)
body = np.concatenate([points[:200] + 0.1 * rng.normal(size=(200, 3)) for _ in range(3)])
still, turn = np.zeros((20, 1)), np.broadcast_to(np.eye(3), (20, 1, 3, 3)).copy()
mesh = ShadowMesh.of(np.arange(600).reshape(3, 200).T)
past = np.ones((20, 4, 8, 5), dtype=np.complex128)
_shade(
    corners, np.ones((20, 1), dtype=bool),
    (still, still, turn, turn, np.ones(20)),
    (rng.normal(size=(20, 4, 3)) * 0.1, rng.normal(size=(20, 8, 3)) * 0.1),
    body.T.copy(), (mesh.faces, mesh.edges, mesh.sides), nodes_for(np.linspace(5.7e9, 5.9e9, 5)),
    FRESNEL, False, past,
)
assert np.abs(past - 1).max() > 0.1, "expected a shadow"
show("silhouettes", [past])

def leaf(values):
    return torch.tensor(values, dtype=torch.float32, requires_grad=True)

means, quats, alpha = leaf(points), leaf(rng.normal(size=(n, 4))), leaf(0.3 * np.ones(n))
scales, scales_rf = leaf(0.04 * np.ones((n, 3))), leaf(0.003 * np.ones((n, 3)))
gamma = torch.complex(leaf(rng.normal(size=(n, 1))), leaf(rng.normal(size=(n, 1))))
ends = Links(torch.tensor(tx_xyz), torch.tensor(rx_xyz))
length_m = torch.linalg.vector_norm(ends.rx_xyz - ends.tx_xyz, dim=1)
paths = EnvironmentPaths(
    torch.arange(links), torch.ones(links, dtype=torch.complex64), length_m / SPEED_OF_LIGHT,
    ends.tx_xyz, ends.rx_xyz, torch.zeros(links), torch.zeros(links), 0.05,
)
csi = scatter(means, quats, scales_rf, gamma, ends, Subcarriers(5.72e9, 2.5e6, 33))
through = shadow(means, quats, scales, alpha, paths)
(csi.abs().sum() + through.abs().sum()).backward()
show("channel", [csi.detach(), through.detach()])
show("gradients", [leaf.grad for leaf in (means, quats, alpha, scales, scales_rf)])
"""


@pytest.mark.slow
def test_the_run_that_compiles_and_later_ones_give_the_same_bytes(python, tmp_path: Path) -> None:
    compiling, loading = (
        python("-c", _DIGESTS, tmp_path / "cache", must_work=True).stdout for _ in range(2)
    )
    assert list((tmp_path / "cache").rglob("*.nbi")), "expected the first run to fill the cache"
    assert compiling.count("\n") == 5
    assert loading == compiling


def _bytes_of(folder: Path) -> dict[str, str]:
    """Digests of a folder's files, but of those that hold a time or a path."""
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.suffix not in {".json", ".jsonl", ".log", ".sha256"}
    }


@pytest.mark.slow
def test_a_world_and_its_run_have_the_same_bytes_in_the_run_that_compiles(
    python, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Through the commands, so that functions are compiled and loaded in the order of real use."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    worlds = ("--radio", "wifi", "--count", 1, "--frames", 2, "--people", 1, "--depth", 2)
    made = []
    for name in ("compiling", "loading"):
        data, run = tmp_path / f"data_{name}", tmp_path / f"run_{name}"
        python("-m", "dataset_factory", "worlds", *worlds, "--out", data, must_work=True)
        # The same data for both: only the kernels of training may make a difference.
        world = tmp_path / "data_compiling" / "world_0000000"
        short = ("--radio", "wifi", "--iterations", 5, "--out", run)
        python("-m", "rfgs_core.cli", "train", world, *short, must_work=True)
        made.append((_bytes_of(data), _bytes_of(run)))
    assert any("csi.zarr" in name for name in made[0][0])
    assert any(name.endswith(".ply") for name in made[0][1])
    assert made[1] == made[0]


def test_functions_that_may_round_as_they_like_are_inlined() -> None:
    """A function that a compiled one calls exists twice: by itself, and within its caller's file.

    Which of the two serves depends on what the process loaded before. With a compiler that may
    contract or reorder sums, the two need not round alike.
    """
    kernels = _kernels()
    free = {
        name: kernel
        for name, kernel in kernels.items()
        if any(kernel is called for caller in kernels.values() for called in _called_by(caller))
        and kernel.targetoptions.get("fastmath")
    }
    assert len(free) > 40
    outside = [
        name
        for name, kernel in free.items()
        if not kernel.targetoptions.get("forceinline")
        and kernel.targetoptions.get("inline") != "always"
    ]
    assert not outside, f"expected forceinline=True or inline='always' of {outside}"


def _kernels() -> dict[str, Dispatcher]:
    """All functions that numba compiles, by module and name."""
    found = {}
    for package in (rfgs_core, dataset_factory):
        root = Path(package.__path__[0])
        for path in root.rglob("*.py"):
            if "njit(" in path.read_text():
                parts = path.relative_to(root.parent).with_suffix("").parts
                module = importlib.import_module(".".join(parts))
                for value in vars(module).values():
                    if isinstance(value, Dispatcher):
                        function = value.py_func
                        found[f"{function.__module__}.{function.__name__}"] = value
    return found


def _called_by(kernel: Dispatcher) -> list[Dispatcher]:
    """Functions that a compiled one names."""
    function = kernel.py_func
    named = [function.__globals__.get(name) for name in function.__code__.co_names]
    return [value for value in named if isinstance(value, Dispatcher)]
