# SPDX-License-Identifier: Apache-2.0
"""The compiled model against its plain torch twin, in values, gradients and bytes."""

from __future__ import annotations

import numba
import numpy as np
import pytest
import torch

from rfgs_core.bench import PropagationBench, bench_propagation
from rfgs_core.propagation import Links, Subcarriers, scatter, shadow
from rfgs_core.propagation.covariance import (
    PACKED_COLS,
    PACKED_ROWS,
    covariances,
    covariances_by_products,
)
from rfgs_core.propagation.fast import packed_covariances

SCATTER = ("means", "quats", "scales_rf", "gamma", "normals", "visibility")
SHADOW = ("means", "quats", "scales", "alpha")
#: Kernels in double precision, which programs never ask for, take twenty seconds to compile.
IN_DOUBLE = [pytest.param("numba", marks=pytest.mark.slow), "torch"]
BANDS = [(5.72e9, 2.5e6, 1), (60e9, 12.5e6, 1), (3.1e9, 12.3e6, 4)]


@pytest.mark.parametrize(("f0", "df", "knots"), BANDS)
def test_scatter_twins_agree(make_cloud, make_links, f0, df, knots, assert_twins_agree) -> None:
    every = make_cloud(301, f0, knots)
    cloud = {name: every[name] for name in SCATTER}
    links, subcarriers = make_links(13), Subcarriers(f0, df, 131, blocks=((0, 70), (90, 41)))

    def run(values, backend):
        return scatter(
            **values, links=links, subcarriers=subcarriers, sharpness=3.0, backend=backend
        )

    assert_twins_agree(run, cloud)


@pytest.mark.parametrize(("f0", "df", "knots"), BANDS)
def test_the_gradient_of_reflectivities_alone_is_the_twin_s(
    make_cloud, make_links, f0, df, knots, assert_twins_agree
) -> None:
    """What the solver of reflectivities asks for: a kernel of its own."""
    every = make_cloud(301, f0, knots)
    fixed = {name: every[name].detach() for name in SCATTER if name != "gamma"}
    links, subcarriers = make_links(13), Subcarriers(f0, df, 131, blocks=((0, 70), (90, 41)))

    def run(values, backend):
        real = values["gamma"].real.dtype
        there = {name: value.to(real) for name, value in fixed.items()}
        return scatter(
            **there, **values, links=links, subcarriers=subcarriers, sharpness=3.0, backend=backend
        )

    assert_twins_agree(run, {"gamma": every["gamma"]})


@pytest.mark.parametrize("fast", [packed_covariances, covariances_by_products])
@pytest.mark.parametrize("count", [1, 57, 128, 300])
def test_covariances_of_cpu_and_gpu_are_those_of_products(make_cloud, fast, count) -> None:
    """Quaternions of any length, and thin Gaussians."""
    cloud = make_cloud(count, dtype=torch.float64)
    quats, scales = 3.0 * cloud["quats"], cloud["scales"] * torch.tensor([1.0, 1e-3, 1.0])
    plain, found = covariances(quats, scales)[:, PACKED_ROWS, PACKED_COLS].T, fast(quats, scales)
    torch.testing.assert_close(found, plain, rtol=1e-12, atol=1e-18)
    weights = torch.linspace(-1.0, 2.0, plain.numel(), dtype=torch.float64).reshape(plain.shape)
    leaves = (cloud["quats"], cloud["scales"])
    ends = [
        torch.autograd.grad((x * weights).sum(), leaves, retain_graph=True) for x in (plain, found)
    ]
    for slope, expected in zip(ends[1], ends[0], strict=True):
        torch.testing.assert_close(slope, expected, rtol=1e-9, atol=1e-15)


def test_covariances_have_no_numerical_slope_but_their_own(make_cloud) -> None:
    """Twins may share a mistake; differences of the values do not."""
    cloud = make_cloud(5, dtype=torch.float64)
    quats = (2.0 * cloud["quats"]).detach().requires_grad_(True)
    scales = (20.0 * cloud["scales"]).detach().requires_grad_(True)
    assert torch.autograd.gradcheck(packed_covariances, (quats, scales))


@pytest.mark.parametrize("wavelength_m", [0.052, 0.0048])
def test_shadow_twins_agree(make_cloud, make_paths, wavelength_m, assert_twins_agree) -> None:
    every = make_cloud(201)
    cloud = {name: every[name] for name in SHADOW}
    paths = make_paths(17, wavelength_m)

    def run(values, backend):
        return shadow(**values, paths=paths, backend=backend)

    assert_twins_agree(run, cloud)


@pytest.mark.parametrize("count", [1, 127, 128, 129])
def test_any_number_of_gaussians_will_do(
    make_cloud, make_links, make_paths, count, assert_twins_agree
) -> None:
    every = make_cloud(count)
    links, subcarriers, paths = make_links(3), Subcarriers(5.72e9, 2.5e6, 7), make_paths(3, 0.05)
    assert_twins_agree(
        lambda values, backend: scatter(
            **values, links=links, subcarriers=subcarriers, sharpness=1.0, backend=backend
        ),
        {name: every[name] for name in SCATTER},
    )
    assert_twins_agree(
        lambda values, backend: shadow(**values, paths=paths, backend=backend),
        {name: every[name] for name in SHADOW},
    )


def test_no_gaussians_scatter_nothing_and_block_nothing(make_cloud, make_links, make_paths) -> None:
    every = make_cloud(0)
    cloud = {name: every[name] for name in SCATTER}
    for backend in ("numba", "torch"):
        csi = scatter(
            **cloud, links=make_links(3), subcarriers=Subcarriers(5e9, 1e6, 5), backend=backend
        )
        assert csi.shape == (3, 5)
        assert not csi.any()
        screens = {name: every[name] for name in SHADOW}
        through = shadow(**screens, paths=make_paths(4, 0.05), backend=backend)
        assert torch.equal(through, torch.ones(4, dtype=torch.complex64))
    csi.abs().sum().backward()
    assert every["means"].grad.shape == (0, 3)


@pytest.mark.parametrize("backend", IN_DOUBLE)
@pytest.mark.parametrize("knots", [1, 3])
def test_scatter_gradients_pass_gradcheck(make_cloud, make_links, backend, knots) -> None:
    every = make_cloud(4, knots=knots, dtype=torch.float64)
    links, subcarriers = make_links(3), Subcarriers(5.8e9, 20e6, 9, blocks=((0, 3), (4, 4)))

    def run(*values):
        named = dict(zip(SCATTER, values, strict=True))
        csi = scatter(**named, links=links, subcarriers=subcarriers, sharpness=3.0, backend=backend)
        return torch.view_as_real(csi) * 1e3

    values = [every[name] for name in SCATTER]
    assert torch.autograd.gradcheck(run, values, eps=1e-7, atol=1e-5, rtol=1e-4)


@pytest.mark.parametrize("backend", IN_DOUBLE)
def test_shadow_gradients_pass_gradcheck(make_cloud, make_paths, backend) -> None:
    every = make_cloud(4, dtype=torch.float64)
    paths = make_paths(3, 0.05)

    def run(*values):
        through = shadow(**dict(zip(SHADOW, values, strict=True)), paths=paths, backend=backend)
        return torch.view_as_real(through)

    values = [every[name] for name in SHADOW]
    assert torch.autograd.gradcheck(run, values, eps=1e-7, atol=1e-6, rtol=1e-4)


#: What `channel_and_gradients` differentiates by.
WANTED = ("means", "quats", "scales", "scales_rf", "gamma", "alpha", "normals")


@pytest.fixture
def channel_and_gradients(make_cloud, make_links, make_paths):
    every = make_cloud(700)
    links, subcarriers, paths = make_links(9), Subcarriers(5.72e9, 2.5e6, 33), make_paths(7, 0.05)

    def run() -> list[torch.Tensor]:
        csi = scatter(
            *(every[name] for name in SCATTER[:4]), links, subcarriers, every["normals"], 2.0
        )
        through = shadow(*(every[name] for name in SHADOW), paths)
        loss = csi.abs().sum() + through.abs().sum()
        grads = torch.autograd.grad(loss, [every[name] for name in WANTED])
        return [csi.detach(), through.detach(), *grads]

    return run


def _same_bytes(first: list[torch.Tensor], second: list[torch.Tensor]) -> bool:
    return all(torch.equal(a, b) for a, b in zip(first, second, strict=True))


def test_same_bytes_for_any_number_of_threads(channel_and_gradients) -> None:
    threads = numba.get_num_threads()
    try:
        numba.set_num_threads(numba.config.NUMBA_NUM_THREADS)
        first = channel_and_gradients()
        numba.set_num_threads(1)
        second = channel_and_gradients()
    finally:
        numba.set_num_threads(threads)
    assert _same_bytes(first, second)


def test_same_bytes_wherever_the_heap_puts_the_arrays(channel_and_gradients) -> None:
    rng, held = np.random.default_rng(0), []
    first = channel_and_gradients()
    for _ in range(300):
        kept = [array for array in held if rng.random() < 0.5]
        held = kept + [np.zeros(rng.integers(1, 4000)) for _ in range(rng.integers(0, 20))]
        assert _same_bytes(first, channel_and_gradients())


def test_memory_does_not_grow_with_links_times_gaussians(make_cloud, make_links) -> None:
    """What backward keeps is inputs and one CSI, nothing per Gaussian and link."""
    every = make_cloud(50)
    csi = scatter(
        *(every[name] for name in SCATTER[:4]), make_links(200), Subcarriers(5.72e9, 2.5e6, 64)
    )
    kept, nodes = 0, [csi.grad_fn]
    while nodes:
        node = nodes.pop()
        if node is None:
            continue
        saved = getattr(node, "saved_tensors", ())
        kept += sum(value.numel() for value in saved if value is not None)
        nodes.extend(parent for parent, _ in node.next_functions)
    assert kept < 50 * 200


def test_bad_input_is_named(make_cloud, make_links) -> None:
    every = make_cloud(2)
    links, subcarriers = make_links(4), Subcarriers(5e9, 1e6, 4)
    cloud = {name: every[name] for name in SCATTER[:4]}
    with pytest.raises(ValueError, match=r"expected groups within 0\.\.0"):
        scatter(**cloud, links=links, subcarriers=subcarriers, visibility=torch.ones(2, 1))
    with pytest.raises(ValueError, match="expected backend to be one of"):
        scatter(**cloud, links=links, subcarriers=subcarriers, backend="cuda")
    with pytest.raises(ValueError, match=r"expected subcarrier blocks within 0\.\.3"):
        Subcarriers(5e9, 1e6, 4, blocks=((2, 3),))
    with pytest.raises(ValueError, match="expected f0 > 0"):
        Subcarriers(0.0, 1e6, 4)
    with pytest.raises(ValueError, match="expected rx_xyz of shape"):
        Links(torch.zeros(3, 3), torch.zeros(2, 3))


def test_the_bench_reports_a_faster_and_equal_twin() -> None:
    size = PropagationBench(num_gaussians=1500, num_links=8, num_subcarriers=64, repeats=2)
    result = bench_propagation(size)
    assert result["max_relative_error"] < 1e-4
    assert result["forward_ratio"] > 3
    assert result["forward_backward_ratio"] > 3
    assert all(isinstance(value, str | int | float) for value in result.values())
