# SPDX-License-Identifier: Apache-2.0
"""Datasets with several samples per frame: packets, chirps, pulses."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rfgs_core.dataset import Sequence, open_dataset
from rfgs_core.dataset.csi_store import chunk_file, create_csi, write_csi
from rfgs_core.dataset.torch_dataset import FrameDataset
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.files import write_json
from rfgs_core.measure.observations import observe
from rfgs_core.radio import FrameSamples, frame_samples, preset

COUNT = 3


@pytest.fixture
def sampled(tiny_dataset: Path, tmp_path: Path) -> Callable[[FrameSamples], Sequence]:
    """The tiny dataset with three samples per frame, each the first one times its number."""

    def make(samples: FrameSamples) -> Sequence:
        root = Path(shutil.copytree(tiny_dataset, tmp_path / "dataset"))
        sequence = open_dataset(root).sequence()
        radio, layout, files = sequence.radio_spec("wifi"), sequence.layout("wifi"), sequence.files
        values = {frame: sequence.csi("wifi", frame) for frame in sequence.frames}
        static = sequence.csi_static("wifi")
        info = json.loads(files.info.read_text())
        info["radios"]["wifi"]["samples_per_frame"] = COUNT
        write_json(files.info, info)
        store = files.csi("wifi")
        shutil.rmtree(store)
        times_s = [sequence.time_s(frame) for frame in sequence.frames]
        create_csi(store, radio, layout, sequence.frames, times_s, samples)
        factor = np.arange(1, COUNT + 1, dtype=np.float32)[:, None, None, None]
        for index, frame in enumerate(sequence.frames):
            write_csi(store, index, factor * values[frame], files.csi_done("wifi", frame))
        still = factor * static if samples.antennas_move else static
        write_csi(store, None, still, files.csi_done("wifi", None))
        return open_dataset(root).sequence()

    return make


@pytest.fixture
def spread() -> FrameSamples:
    """Three samples spread over a tenth of a second."""
    return FrameSamples(np.arange(COUNT) / (10.0 * COUNT))


def test_packets_of_a_frame_are_one_chunk_on_one_time_axis(
    sampled: Callable, spread: FrameSamples
) -> None:
    sequence = sampled(spread)
    data = sequence.radio("wifi")
    assert data["csi"].dims == ("time", "tx", "rx", "subcarrier")
    assert data["frame"].values.tolist() == [1, 1, 1, 2, 2, 2]
    assert np.allclose(data["time_s"].values, np.arange(6) / 30.0)
    assert data["sample_index"].values.tolist() == [0, 1, 2, 0, 1, 2]
    for index, frame in enumerate(sequence.frames):
        packets = sequence.csi_samples("wifi", frame)
        assert np.array_equal(packets, data["csi"].values[COUNT * index : COUNT * (index + 1)])
        assert np.array_equal(packets[0], sequence.csi("wifi", frame))
        assert np.array_equal(packets[2], 3 * packets[0])
        assert np.allclose(sequence.sample_times_s("wifi", frame)[0], sequence.time_s(frame))
    chunks = [
        file for file in (sequence.files.csi("wifi") / "csi" / "c").rglob("0") if file.is_file()
    ]
    assert len(chunks) == len(sequence.frames)
    # Damage to any packet is damage to its frame.
    shutil.copy(
        chunk_file(sequence.files.csi("wifi"), 0), chunk_file(sequence.files.csi("wifi"), 1)
    )
    with pytest.raises(RfgsFormatError, match=r"csi/c/1/0/0/0.*digest"):
        sequence.csi("wifi", 2)


def test_training_and_torch_take_the_sample_at_the_frame_time(
    sampled: Callable, spread: FrameSamples, tiny_dataset: Path
) -> None:
    sequence, single = sampled(spread), open_dataset(tiny_dataset).sequence()
    assert np.array_equal(observe(sequence, "wifi", 2).delta, observe(single, "wifi", 2).delta)
    assert (
        FrameDataset(sequence, "wifi")[0]["csi"].shape
        == FrameDataset(single, "wifi")[0]["csi"].shape
    )
    whole = FrameDataset(sequence, "wifi", samples=True)[1]
    assert whole["csi"].shape[0] == len(whole["time_s"]) == COUNT
    assert float(whole["time_s"][0]) == pytest.approx(0.1)


def test_moving_antennas_have_places_per_sample(
    sampled: Callable, spread: FrameSamples, tiny_dataset: Path
) -> None:
    layout = open_dataset(tiny_dataset).sequence().layout("wifi")
    shift = np.arange(COUNT)[:, None, None] * np.array([0.01, 0.0, 0.0])
    sequence = sampled(replace(spread, tx_xyz=layout.tx_xyz + shift))
    data = sequence.radio("wifi")
    assert data["tx_xyz"].dims == ("time", "tx", "xyz") and data["rx_xyz"].dims == ("rx", "xyz")
    assert np.allclose(data["tx_xyz"].values[4], layout.tx_xyz + shift[1])
    assert data["csi_static"].dims == ("sample", "tx", "rx", "subcarrier")
    at_samples = data["csi_static"].isel(sample=data["sample_index"])
    assert at_samples.dims == data["csi"].dims and at_samples.shape == data["csi"].shape
    assert np.array_equal(data["csi_static"].values, sequence.csi_static_samples("wifi"))
    assert np.array_equal(sequence.csi_static("wifi"), data["csi_static"].values[0])
    with pytest.raises(RfgsError, match="antennas move"):
        observe(sequence, "wifi", 1)


def test_samples_start_at_the_frame_and_fit_into_it() -> None:
    wifi, radar = preset("wifi"), replace(preset("mmwave"), samples_per_frame=64)
    assert frame_samples(wifi, 10.0).offset_s.tolist() == [0.0]
    # A single chirp fits any frame, however short against the interval it would have.
    assert frame_samples(preset("mmwave"), 5000.0).offset_s.tolist() == [0.0]
    packets = frame_samples(replace(wifi, samples_per_frame=5), 10.0).offset_s
    assert np.allclose(packets, [0.0, 0.02, 0.04, 0.06, 0.08])
    assert np.allclose(np.diff(frame_samples(radar, 10.0).offset_s), 0.25e-3)
    with pytest.raises(RfgsError, match="at most 33"):
        frame_samples(radar, 120.0)
    with pytest.raises(RfgsError, match="at least 1"):
        frame_samples(replace(wifi, samples_per_frame=0), 10.0)


def test_a_frame_too_large_for_a_chunk_is_refused(tiny_dataset: Path, tmp_path: Path) -> None:
    sequence = open_dataset(tiny_dataset).sequence()
    radio, layout = sequence.radio_spec("wifi"), sequence.layout("wifi")
    many = FrameSamples(np.arange(600_000) * 1e-7)
    with pytest.raises(RfgsError, match="fewer samples per frame"):
        create_csi(tmp_path / "csi.zarr", radio, layout, [1], [0.0], many)
    assert not (tmp_path / "csi.zarr").exists()
