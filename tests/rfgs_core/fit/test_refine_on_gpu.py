# SPDX-License-Identifier: Apache-2.0
"""A descent on a GPU: what can be told without one, and the same result where there is one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from rfgs_core.device import need_device, on_device
from rfgs_core.encode import MATCHED_FILTER
from rfgs_core.errors import MissingToolError
from rfgs_core.fit import nearest
from rfgs_core.fit import refine as refine_module
from rfgs_core.fit.frame import FrameState, solve_reflectivity
from rfgs_core.fit.parameters import LearningRates, TrainableGaussians
from rfgs_core.fit.refine import refine
from rfgs_core.fit.task import Task
from rfgs_core.measure.observations import Observations
from rfgs_core.measure.phase_free import delay_amplitude
from rfgs_core.propagation import reference


def test_a_gpu_that_is_not_there_is_named(monkeypatch) -> None:
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    with pytest.raises(MissingToolError, match=r"--device cuda: torch .* finds no GPU; expected"):
        need_device("cuda")
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    monkeypatch.setenv("PATH", "")
    with pytest.raises(MissingToolError, match="needs a C compiler"):
        need_device("cuda")
    need_device("cpu")


def test_kernels_of_the_gpu_descend_as_those_of_the_cpu(
    observations: Observations, state: FrameState, quick_config, monkeypatch
) -> None:
    """In Triton's interpreter, on the CPU, which takes a while for every link."""
    if torch.cuda.is_available():
        pytest.skip("kernels are compiled for the GPU here; the tests marked gpu descend on it")
    pytest.importorskip("triton", reason="kernels for a GPU need triton: pip install triton")
    from rfgs_core.propagation import gpu

    config = replace(quick_config, batch_entries=32)
    links = observations.links & (np.arange(observations.links.shape[1]) % 16 == 0)
    seen = replace(observations, links=links).with_delta(
        np.where(links[..., None], observations.delta, 0)
    )
    plain = refine(seen, solve_reflectivity(seen, state, config), config, 0)
    monkeypatch.setattr("rfgs_core.propagation._twin", lambda backend, device: gpu)
    other = refine(seen, solve_reflectivity(seen, state, config), config, 0)
    for name, value in plain.gaussians.items():
        torch.testing.assert_close(getattr(other.gaussians, name), value, rtol=1e-3, atol=1e-4)
    assert not torch.equal(plain.gaussians.means, state.gaussians.means)


@pytest.mark.parametrize("kind", ["complex", "power", "delay_power"])
def test_a_step_meets_no_tensor_of_another_device(
    kind, observations: Observations, state: FrameState, quick_config, monkeypatch
) -> None:
    """Tensors of the device `meta` hold nothing, but refuse to meet those of the CPU."""
    monkeypatch.setattr("rfgs_core.propagation._twin", lambda backend, device: reference)
    monkeypatch.setattr(
        nearest, "nearest_on_gpu", lambda points, means: torch.cdist(means, points).min(dim=0)[::-1]
    )
    profile = np.abs(delay_amplitude(observations.static, observations.subcarriers))
    seen = replace(observations, kind=kind, delay_change=profile)
    config = replace(quick_config, objective="both")
    task = Task.of(seen, config, 0, MATCHED_FILTER)
    links, chosen = refine_module.batch(task, config, 0, 1)
    there, moved = task.on("meta"), on_device(state, "meta")  # pyright: ignore[reportArgumentType]
    assert there.points is not None
    trained = TrainableGaussians(moved.gaussians, LearningRates())
    points = there.points.rows(chosen)
    loss = refine_module.loss_of(there, moved, trained.gaussians, links, points)
    loss.backward()
    ends = [loss, moved.power, moved.head.directions, *(x.grad for x in trained.leaves.values())]
    assert {end.device.type for end in ends if end is not None} == {"meta"}
    # What is forgotten on the way is told: here all that the frame is compared with.
    with pytest.raises(RuntimeError, match=r"not on the expected device|same device"):
        refine_module.loss_of(task, moved, moved.gaussians, links, None)


needs_gpu = pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a CUDA device")


@pytest.mark.gpu
@needs_gpu
@pytest.mark.parametrize("kind", ["complex", "power", "delay_power"])
def test_a_gpu_descends_as_the_cpu_does(
    kind, observations: Observations, state: FrameState, quick_config
) -> None:
    profile = np.abs(delay_amplitude(observations.static, observations.subcarriers))
    seen = replace(observations, kind=kind, delay_change=profile)
    ends = []
    for device in ("cpu", "cuda"):
        config = replace(quick_config, device=device, iterations=40)
        ends.append(refine(seen, solve_reflectivity(seen, state, config), config, 0).gaussians)
    for name, value in ends[0].items():
        torch.testing.assert_close(getattr(ends[1], name), value, rtol=1e-2, atol=1e-3)


@pytest.mark.gpu
@needs_gpu
@pytest.mark.parametrize("density", ["3dgs", "residual", "paper"])
def test_density_control_on_a_gpu_resumes(
    density, observations: Observations, state: FrameState, quick_config, tmp_path, monkeypatch
) -> None:
    """Past the first densification and pruning of every rule."""
    monkeypatch.setattr(refine_module, "CHECKPOINT_EVERY", 60)
    objective = "both" if density == "paper" else "csi"
    config = replace(
        quick_config, objective=objective, density=density, iterations=130, device="cuda"
    )
    undisturbed = refine(observations, state, config, 0).gaussians
    assert all(value.isfinite().all() for _, value in undisturbed.items())
    checkpoint = tmp_path / "000001.partial.npz"
    steps = []

    def stop(loss: float, count: int) -> None:
        steps.append(count)
        if len(steps) == 65:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        refine(observations, state, config, 0, checkpoint, stop)
    again = refine(observations, state, config, 0, checkpoint).gaussians
    assert len(again) == len(undisturbed) != len(state.gaussians)
    torch.testing.assert_close(again.means, undisturbed.means, rtol=1e-3, atol=1e-4)
