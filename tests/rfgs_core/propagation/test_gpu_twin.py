# SPDX-License-Identifier: Apache-2.0
"""The model on a GPU against its plain twin; without one, in Triton's interpreter on the CPU."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest
import torch

pytest.importorskip("triton", reason="kernels for a GPU need triton: pip install triton")

from rfgs_core.propagation import Links, Subcarriers, gpu, scatter, shadow

DEVICE = torch.device("cuda" if torch.cuda.is_available() else "cpu")
SCATTER = ("means", "quats", "scales_rf", "gamma", "normals", "visibility")
BANDS = [(5.72e9, 2.5e6, 1), (60e9, 12.5e6, 1), (3.1e9, 12.3e6, 4)]


@pytest.mark.parametrize(("f0", "df", "knots"), BANDS)
def test_scatter_is_the_plain_sum(
    make_cloud, make_links, monkeypatch, f0, df, knots, assert_twins_agree
) -> None:
    # Two splits of the Gaussians and of the links, the last ones not full.
    monkeypatch.setattr(gpu, "LEAST_GAUSSIANS", 64)
    monkeypatch.setattr(gpu, "LEAST_LINKS", 2)
    every = make_cloud(145, f0, knots)
    cloud = {name: every[name] for name in SCATTER}
    # Two runs of subcarriers with hidden ones in them, and one that is all hidden between.
    links, subcarriers = make_links(4), Subcarriers(f0, df, 110, blocks=((3, 20), (25, 4), (70, 9)))

    def run(values, backend):
        return scatter(
            **values, links=links, subcarriers=subcarriers, sharpness=3.0, backend=backend
        )

    assert_twins_agree(run, cloud, "triton", DEVICE)


@pytest.mark.parametrize("left_out", [("normals",), ("visibility",), ("normals", "visibility")])
def test_what_is_left_out_weighs_nothing(
    make_cloud, make_links, left_out, assert_twins_agree
) -> None:
    every = make_cloud(3)
    cloud = {name: every[name] for name in SCATTER if name not in left_out}
    links, subcarriers = make_links(2), Subcarriers(5.72e9, 2.5e6, 5)

    def run(values, backend):
        return scatter(
            **values, links=links, subcarriers=subcarriers, sharpness=3.0, backend=backend
        )

    assert_twins_agree(run, cloud, "triton", DEVICE)


@pytest.mark.parametrize(("gaussians", "legs"), [(145, 7), (1, 1), (64, 4), (3, 9)])
def test_shadows_are_the_plain_product(
    make_cloud, make_paths, monkeypatch, gaussians, legs, assert_twins_agree
) -> None:
    # Splits of the Gaussians and of the legs, the last ones not full.
    monkeypatch.setattr(gpu, "LEAST_GAUSSIANS", 64)
    monkeypatch.setattr(gpu, "LEAST_LINKS", 3)
    every = make_cloud(gaussians)
    cloud = {name: every[name] for name in ("means", "quats", "scales", "alpha")}
    paths = make_paths(legs, 0.05)

    def run(values, backend):
        return shadow(**values, paths=paths, backend=backend)

    assert_twins_agree(run, cloud, "triton", DEVICE)


def test_shadows_of_thin_gaussians_have_the_right_gradients(
    make_cloud, make_paths, assert_twins_agree
) -> None:
    """Seen edge-on, the spread's determinant would cancel in single precision."""
    every = make_cloud(41)
    thin = every["scales"].detach() * torch.tensor([1.0, 1.0, 1e-4])
    cloud = {name: every[name] for name in ("means", "quats", "alpha")} | {"scales": thin}
    paths = make_paths(7, 0.05)

    def run(values, backend):
        return shadow(**values, paths=paths, backend=backend)

    assert_twins_agree(run, cloud, "triton", DEVICE)


def test_nothing_scatters_nothing(make_cloud, make_links, make_paths) -> None:
    every = {name: value.detach().to(DEVICE) for name, value in make_cloud(0).items()}
    means = every["means"].requires_grad_(True)
    cloud = {name: every[name] for name in ("quats", "scales_rf", "gamma", "normals")}
    subcarriers = Subcarriers(5e9, 1e6, 5)
    csi = scatter(means, **cloud, links=make_links(3), subcarriers=subcarriers, backend="triton")
    assert csi.shape == (3, 5) and not csi.any()
    csi.abs().sum().backward()
    assert means.grad is not None and means.grad.shape == (0, 3)
    none = Links(torch.zeros(0, 3), torch.zeros(0, 3))
    some = {name: value.detach().to(DEVICE) for name, value in make_cloud(2).items()}
    cloud = {name: some[name] for name in ("means", "quats", "scales_rf", "gamma")}
    assert scatter(**cloud, links=none, subcarriers=subcarriers, backend="triton").shape == (0, 5)
    screens = {name: some[name] for name in ("means", "quats", "scales", "alpha")}
    assert shadow(**screens, paths=make_paths(0, 0.05), backend="triton").shape == (0,)


COMPILE = """
import sys
from triton.backends.compiler import GPUTarget
from triton.compiler import ASTSource, compile
from rfgs_core.propagation import kernels_triton as scattering, kernels_triton_shadow as shading
from rfgs_core.fit import kernels_triton as searching
from rfgs_core.worlds import kernels_triton as echoing

double = ("means", "ends", "subcarrier", "legs")
numbers = ("per_wave", "damping", "screen", "per_step", "per_range")
counts = ("facets", "ranges", "last", "total", "links", "count",
          "chunks", "rows_out", "per_split", "legs_in", "legs_out")
types = {**dict.fromkeys(double, "*fp64"), "group": "*i64", "sharpness": "fp32"}
types |= dict.fromkeys(counts, "i32")
sizes = ("ROWS", "SUBCARRIERS", "LEGS", "SCREENS", "SLOPES", "GRADIENTS", "BLOCK", "POINTS",
         "COLUMNS")
for room, kernel, own in (
    (scattering, scattering.scatter_forward, {}),
    (scattering, scattering.scatter_backward, {}),
    (shading, shading.shadow_forward, {"shape": "*fp64"}),
    (shading, shading.shadow_backward, {"shape": "*fp64"}),
    (echoing, echoing.facet_waves, {"rows": "*i64", "lit": "*u8", "numbers": "*fp32"}),
    (searching, searching.nearest_of, {"means": "*fp32", "index": "*i32"}),
):
    names = kernel.arg_names
    known = {"FACING": True, "WEIGHED": True, **{n: getattr(room, n, None) for n in sizes}}
    kinds = {**types, **dict.fromkeys(numbers, "fp32"), **own}
    known["SLOPES"] = known["SLOPES"] or scattering.SCATTER_SLOPES
    known["SUBCARRIERS"] = 8  # A loop over all 32 written out takes the compiler much longer.
    constants = {n: known[n] for n in names if n in known}
    signature = {n: "constexpr" if n in constants else kinds.get(n, "*fp32") for n in names}
    source = ASTSource(fn=kernel, signature=signature, constexprs=constants)
    for capability in map(int, sys.argv[1:]):
        print(len(compile(source, target=GPUTarget("cuda", capability, 32)).asm["cubin"]))
"""


def test_kernels_compile_for_gpus_that_are_not_there(tmp_path) -> None:
    """For an A100 and an H100."""
    environment = {k: v for k, v in os.environ.items() if k != "TRITON_INTERPRET"}
    environment["TRITON_CACHE_DIR"] = str(tmp_path)
    program = [sys.executable, "-c", COMPILE, "80", "90"]
    done = subprocess.run(program, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert [int(line) > 10_000 for line in done.stdout.split()] == [True] * 12
