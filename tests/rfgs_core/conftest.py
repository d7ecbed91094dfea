# SPDX-License-Identifier: Apache-2.0
"""Observations of synthetic rooms, clouds of Gaussians, and runs on the tiny dataset."""

from __future__ import annotations

import shutil
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from rfgs_core import interrupts
from rfgs_core.bodies import likeliest_place, pair_sample, posture
from rfgs_core.bodies.tracks import Tracks
from rfgs_core.dataset import open_dataset
from rfgs_core.fit.frame import FrameState
from rfgs_core.gaussians import FEATURE_DIM, Gaussians
from rfgs_core.measure.observations import Observations
from rfgs_core.model.channel import Channel
from rfgs_core.model.head import RadioHead
from rfgs_core.radio import Radio, layout, place_devices
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.run import Run
from rfgs_core.run.training import train_sequence
from rfgs_core.settings import TrainConfig

BOUNDS_M = np.array([[0.0, 0.0, 0.0], [4.0, 3.5, 2.5]])

MakeObservations = Callable[..., Observations]


@pytest.fixture
def hears_ctrl_c(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """As our programs do, and so what they start: a shell's background job ignores Ctrl-C."""
    # A command that makes nothing may have run in this process.
    monkeypatch.setattr(interrupts, "_message", interrupts.MESSAGE)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture
def coarse_postures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Who sits is told of little, in a tenth of the time: for tests that ask for something else."""
    monkeypatch.setattr(posture, "ENTRIES", 512)
    monkeypatch.setattr(pair_sample, "LINKS", 8)
    monkeypatch.setattr(posture, "GAUSSIANS", 200)


Train = Callable[..., Run]


def small_radio(**changes: Any) -> Radio:
    """A Wi-Fi-like radio of four devices with 1 TX and 4 x 4 RX elements each."""
    values: dict[str, Any] = {
        "name": "small",
        "freq_min_hz": 5.72e9,
        "freq_max_hz": 5.88e9,
        "num_subcarriers": 32,
        "tx_rows": 1,
        "tx_cols": 1,
        "rx_rows": 4,
        "rx_cols": 4,
        "tx_offset_m": (0.0, 0.0, -0.3),
    }
    return Radio(**(values | changes))


@pytest.fixture(scope="session")
def make_observations() -> MakeObservations:
    """Observations of a room without a body; nothing is held out unless masks say so.

    Arguments are a radio (or changes to the small one) and masks of links and subcarriers. The
    empty room holds Friis' direct path times `gain[transmitting device, receiving device]`.
    """

    def make(
        radio: Radio | None = None,
        links: np.ndarray | None = None,
        subcarriers: np.ndarray | None = None,
        gain: np.ndarray | None = None,
        bounds_m: np.ndarray = BOUNDS_M,
        **changes: Any,
    ) -> Observations:
        radio = radio or small_radio(**changes)
        elements = layout(radio, place_devices(radio, bounds_m))
        links = elements.measured if links is None else links & elements.measured
        subcarriers = np.ones(radio.num_subcarriers, bool) if subcarriers is None else subcarriers
        length = np.linalg.norm(elements.tx_xyz[:, None] - elements.rx_xyz, axis=-1)[..., None]
        wavelength = SPEED_OF_LIGHT / radio.freq_hz
        static = wavelength / (4 * np.pi * length) * np.exp(-2j * np.pi * length / wavelength)
        if gain is not None:
            static = static * gain[elements.tx_device][:, elements.rx_device, None]
        seen = links[..., None] & subcarriers
        return Observations(
            delta=np.zeros(static.shape, np.complex64),
            static=np.where(seen, static, 0).astype(np.complex64),
            links=links,
            subcarriers=subcarriers,
            layout=elements,
            freq_hz=radio.freq_hz,
            bounds_m=bounds_m,
        )

    return make


@pytest.fixture
def make_gaussians() -> Callable[..., Gaussians]:
    """Gaussians the size of a hand, turned and placed at random around a point."""

    def make(count: int, seed: int = 0, around: tuple = (2.0, 1.7, 1.0)) -> Gaussians:
        generator = torch.Generator().manual_seed(seed)

        def normal(*size: int) -> torch.Tensor:
            return torch.randn(*size, generator=generator)

        return Gaussians(
            means=torch.tensor(around) + 0.3 * normal(count, 3),
            quats=torch.nn.functional.normalize(normal(count, 4), dim=1),
            log_scales=torch.log(torch.tensor(0.04)) + 0.3 * normal(count, 3),
            logit_opacities=-1.0 + normal(count),
            features=normal(count, FEATURE_DIM),
        )

    return make


@pytest.fixture
def head() -> RadioHead:
    """A head for Wi-Fi."""
    return RadioHead.create(0, 0.0517, 0.04, 0.02)


@pytest.fixture
def observations(make_observations, make_gaussians, head) -> Observations:
    """What a dozen Gaussians do to the channel."""
    empty = make_observations()
    channel = Channel.of(empty, empty.links, empty.subcarriers)
    delta = np.zeros_like(empty.delta)
    delta[channel.tx, channel.rx] = channel.change(head, make_gaussians(12)).numpy()
    return empty.with_delta(delta)


@pytest.fixture
def state(make_gaussians, head) -> FrameState:
    """The same Gaussians a little off."""
    gaussians = make_gaussians(12)
    gaussians.means += 0.01 * torch.randn(12, 3, generator=torch.Generator().manual_seed(7))
    gaussians.features *= 0.5
    tracks = Tracks.begun(np.array([[2.0, 1.7]]), time_s=0.0)
    return FrameState(gaussians, torch.full((12,), 1e-3), head, tracks, np.arange(12))


@pytest.fixture(scope="session")
def quick_config() -> TrainConfig:
    """Few Gaussians and steps, and nobody is asked whether they sit, which takes ten seconds."""
    return TrainConfig(
        posture="standing",
        num_gaussians=40,
        solver_steps=3,
        iterations=4,
        batch_entries=256,
        batch_points=64,
        grid_side=6,
        seed=5,
    )


OneStep = Callable[[pytest.MonkeyPatch], None]


@pytest.fixture(scope="session")
def one_step() -> OneStep:
    """Has places settled by one step, in a third of the time, as long as a patch lasts."""

    def settle(patch: pytest.MonkeyPatch) -> None:
        patch.setattr(likeliest_place, "_LAST_STEP_M", likeliest_place._FIRST_STEP_M)

    return settle


@pytest.fixture(scope="session")
def train(one_step: OneStep) -> Train:
    """Trains both frames of a dataset into a folder.

    Places are settled by one step unless they shall be `settled` as programs do.
    """

    def call(
        dataset: Path,
        out: Path,
        config: TrainConfig,
        frames: list[int] | None = None,
        *,
        settled: bool = False,
    ) -> Run:
        data = open_dataset(dataset)
        with pytest.MonkeyPatch.context() as patch:
            if not settled:
                one_step(patch)
            return train_sequence(data, data.sequence(), "wifi", frames or [1, 2], config, out)

    return call


@pytest.fixture(scope="session")
def trained_run(
    tiny_dataset: Path,
    tmp_path_factory: pytest.TempPathFactory,
    train: Train,
    quick_config: TrainConfig,
) -> Run:
    """An undisturbed run on the tiny dataset; copy it before changing anything."""
    return train(tiny_dataset, tmp_path_factory.mktemp("trained") / "run", quick_config)


@pytest.fixture
def own_dataset(tiny_dataset: Path, tmp_path: Path) -> Path:
    """A copy of the tiny dataset that a test may damage."""
    return Path(shutil.copytree(tiny_dataset, tmp_path / "dataset"))
