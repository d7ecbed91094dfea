# SPDX-License-Identifier: Apache-2.0
"""The nearest Gaussian: by hand, and of a GPU beside the tree of the CPU."""

from __future__ import annotations

import pytest
import torch

from rfgs_core.fit import nearest
from rfgs_core.fit.nearest import nearest_gaussian, nearest_on_gpu

DEVICE = torch.device("cuda" if torch.cuda.is_available() else "cpu")


def test_nearest_gaussian() -> None:
    """Points 1, 2 and 3 m from the first, the first and the second Gaussian."""
    points = torch.tensor([[1.0, 0, 0], [0, 2.0, 0], [7.0, 0, 0]])
    index, distance = nearest_gaussian(points, torch.tensor([[0.0, 0, 0], [10.0, 0, 0]]))
    assert index.tolist() == [0, 0, 1]
    assert distance.tolist() == [1.0, 2.0, 3.0]


@pytest.mark.parametrize(
    ("points", "gaussians"), [(0, 3), (1, 1), (32, 64), (101, 57), (33, 400), (5, 1)]
)
def test_the_nearest_on_a_gpu_is_the_trees(monkeypatch, points, gaussians) -> None:
    pytest.importorskip("triton", reason="kernels for a GPU need triton: pip install triton")
    # Several splits, the last one not full.
    monkeypatch.setattr(nearest, "_LEAST", 70)
    generator = torch.Generator().manual_seed(points)
    places, means = (torch.randn(count, 3, generator=generator) for count in (points, gaussians))
    expected, far = nearest_gaussian(places, means)
    index, distance = nearest_on_gpu(places.to(DEVICE), means.to(DEVICE))
    assert torch.equal(index.cpu(), expected)
    torch.testing.assert_close(distance.cpu(), far)


def test_of_equals_on_a_gpu_it_is_the_first() -> None:
    pytest.importorskip("triton", reason="kernels for a GPU need triton: pip install triton")
    means = torch.zeros(150, 3, device=DEVICE)
    index, distance = nearest_on_gpu(torch.ones(2, 3, device=DEVICE), means)
    assert index.tolist() == [0, 0]
    torch.testing.assert_close(distance.cpu(), torch.full((2,), 3.0).sqrt())
