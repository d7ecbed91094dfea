# SPDX-License-Identifier: Apache-2.0
"""A whole dataset of a radio whose antenna moves: what it holds, and what is made of it."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import zarr

from dataset_factory.check.stats import stats
from dataset_factory.check.validate import validate
from dataset_factory.convert.nerf2 import write as write_nerf2
from dataset_factory.make.generate import generate
from dataset_factory.make.impair import impair_dataset
from dataset_factory.plan.contents import make_plan
from dataset_factory.plan.job import Job
from dataset_factory.preview import preview
from dataset_factory.scene.blender import Blender
from dataset_factory.scene.catalogue import find_scene
from dataset_factory.scene.devices import choose_devices
from rfgs_core.dataset import open_dataset
from rfgs_core.dataset.csi_store import digest
from rfgs_core.dataset.torch_dataset import FrameDataset
from rfgs_core.errors import RfgsError
from rfgs_core.files import write_json
from rfgs_core.radio import preset
from rfgs_core.radio.impairments import IMPAIRMENT_PRESETS
from rfgs_core.run.training import train_sequence
from rfgs_core.settings import TrainConfig

#: They share a dataset that takes half a minute to trace.
pytestmark = pytest.mark.slow

MakeAperture = Callable[..., Job]
Factory = Callable[..., subprocess.CompletedProcess[str]]
COUNT = 8
RADIO = f"""\
like: sar
freq_min_hz: 9.0e9
freq_max_hz: 9.4e9
num_subcarriers: 64
samples_per_frame: {COUNT}
"""


@pytest.fixture(scope="module")
def make_aperture(box_room: Path, tmp_path_factory: pytest.TempPathFactory) -> MakeAperture:
    """A job of two frames of a small aperture in the box room, without pictures."""
    file = tmp_path_factory.mktemp("radio") / "ring.yaml"
    file.write_text(RADIO, "utf-8")

    def make(out: Path, workers: int = 1, packets: int = 1) -> Job:
        plan = make_plan(
            find_scene(str(box_room)),
            (str(file),),
            "1:2",
            cameras=1,
            resolution=32,
            samples=2,
            depth=2,
            seed=0,
            shadow="kirchhoff",
            images=False,
            packets_per_frame=packets,
        )
        return Job(out, plan, Blender(box_room), workers)

    return make


@pytest.fixture(scope="module")
def ring(make_aperture: MakeAperture, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished dataset; copy it before changing anything."""
    out = tmp_path_factory.mktemp("aperture") / "dataset"
    assert generate(make_aperture(out))
    return out


def test_time_runs_over_the_places_of_every_frame(ring: Path) -> None:
    sequence = open_dataset(ring).sequence()
    data = sequence.radio("ring")
    assert data["csi"].shape == (2 * COUNT, 1, 1, 64)
    assert data["csi_static"].shape == (COUNT, 1, 1, 64)
    assert data["tx_xyz"].dims == ("time", "tx", "xyz") and data["rx_xyz"].ndim == 3
    assert data["frame"].values.tolist() == [1] * COUNT + [2] * COUNT
    assert data["sample_index"].values.tolist() == [*range(COUNT)] * 2
    # The scene stands still meanwhile.
    assert np.allclose(data["time_s"].values, np.repeat([0.0, 0.1], COUNT))
    rx_xyz = data["rx_xyz"].values[:, 0]
    assert np.array_equal(rx_xyz[:COUNT], rx_xyz[COUNT:])
    assert np.allclose(np.linalg.norm(rx_xyz[:, :2] - 1.5, axis=1), 1.3)
    assert np.allclose(rx_xyz[:, 2], 2.2)
    for sample in (0, 7):
        assert np.allclose(sequence.layout("ring", sample).rx_xyz[0], rx_xyz[sample])
    # The scene asks for depth 2; antennas that move have 1.
    assert sequence.trace_depth("ring") == 1
    item = FrameDataset(sequence, "ring", samples=True)[1]
    assert item["csi"].shape == item["csi_static"].shape == (COUNT, 1, 1, 64)
    change = item["csi"] - item["csi_static"]
    assert (abs(change).amax(dim=(1, 2, 3)) > 0).all()


def test_it_is_sound_described_and_shown(ring: Path, tmp_path: Path) -> None:
    assert validate(ring) == []
    found = stats(ring)["sequences"]["box_room"]["radios"]["ring"]
    assert found["devices"] == found["links"] == 1 and found["samples_per_frame"] == COUNT
    page = preview(ring, tmp_path / "page", None)
    names = {file.name for file in page.parent.iterdir()}
    assert {"ring_strip.png", "ring_ranges.png", "ring_images.png"} <= names


def test_wrong_places_and_delays_are_found(ring: Path, tmp_path: Path) -> None:
    copy = Path(shutil.copytree(ring, tmp_path / "dataset"))
    store = copy / "box_room" / "radio" / "ring" / "csi.zarr"
    places = zarr.open_array(str(store / "tx_xyz"), mode="r+")
    places[COUNT + 3, 0, 2] += 0.01
    static = zarr.open_array(str(store / "csi_static"), mode="r+")
    freq_hz = open_dataset(ring).sequence().radio("ring")["freq_hz"].values
    # Half a metre late at every place.
    static[...] = static[...] * np.exp(-2j * np.pi * freq_hz * 0.5 / 299792458.0)
    marker = copy / "box_room" / "radio" / "ring" / "done" / "static"
    write_json(marker, {"sha256": digest(static[...])})
    faults = validate(copy)
    assert any("tx_xyz: differs from the devices" in fault for fault in faults)
    assert any("m from where the geometry puts them" in fault for fault in faults)


def test_training_takes_all_places_and_nerf2_refuses_them(ring: Path, tmp_path: Path) -> None:
    dataset = open_dataset(ring)
    sequence = dataset.sequence()
    config = TrainConfig(num_gaussians=40, solver_steps=2, iterations=1, posture="standing")
    run = train_sequence(dataset, sequence, "ring", [1], config, tmp_path / "run")
    assert run.observations(1).links.sum() == COUNT
    with pytest.raises(RfgsError, match="antennas move"):
        write_nerf2(sequence, tmp_path / "nerf2")


def test_empties_are_places_in_the_order_of_their_names() -> None:
    def bundle(count: int, role: str = "ACCESS_POINT") -> Any:
        rows = [
            {
                "name": f"place_{k:03d}",
                "radio": "sar",
                "role": role,
                "position_m": [0.01 * k, 0.0, 2.0],
                "quat_wxyz": [1.0, 0.0, 0.0, 0.0],
            }
            for k in reversed(range(count))
        ]
        return SimpleNamespace(devices=rows, info={"blend_name": "room.blend"})

    devices, guess = choose_devices(bundle(180), preset("sar"))
    assert guess is None and [d.name for d in devices] == [f"place_{k:03d}" for k in range(180)]
    with pytest.raises(RfgsError, match=r"room\.blend: 3 Empties for radio 'sar'.*180 places"):
        choose_devices(bundle(3), preset("sar"))


@pytest.mark.slow
def test_two_workers_write_the_same_bytes(
    ring: Path, make_aperture: MakeAperture, tmp_path: Path, data_of: Callable
) -> None:
    assert generate(make_aperture(tmp_path / "dataset", workers=2))
    assert data_of(tmp_path / "dataset") == data_of(ring)


def test_imperfect_radios_stand_beside_the_clean_one(ring: Path, tmp_path: Path) -> None:
    copy = Path(shutil.copytree(ring, tmp_path / "dataset"))
    impair_dataset(copy, next(iter(IMPAIRMENT_PRESETS.values())))
    assert validate(copy) == []
    data = open_dataset(copy).sequence().radio("ring")
    assert data["csi_impaired"].shape == data["csi"].shape


def test_paths_between_antennas_that_move_are_refused(
    box_room: Path, factory_here: Factory
) -> None:
    command = ("plan", str(box_room), "--radio", "sar", "--frames", "1:2", "--paths", "--out", "x")
    done = factory_here(*command)
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert "--paths: radio 'sar' has antennas that move" in done.stderr


def test_packets_leave_the_places_as_they_are(make_aperture: MakeAperture, tmp_path: Path) -> None:
    radio = make_aperture(tmp_path / "dataset", packets=3).plan.radio("ring")
    assert radio.samples_per_frame == COUNT
