# SPDX-License-Identifier: Apache-2.0
"""Several packets per frame: the filter meets its own theory, and training reads what it gives."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dataset_factory.make.impair import impair_dataset
from rfgs_core.background.learned import learned_background
from rfgs_core.cli import main
from rfgs_core.dataset import Sequence, open_dataset
from rfgs_core.dataset.csi_store import create_csi, write_csi
from rfgs_core.dataset.writer import finish_dataset
from rfgs_core.encode.learned import LearnedEncoder, save_encoder
from rfgs_core.encode.learned.encoder import EncoderModel
from rfgs_core.encode.learned.signature import RadioSignature
from rfgs_core.errors import RfgsError
from rfgs_core.evaluate.scene import Scene
from rfgs_core.files import write_json
from rfgs_core.measure.observations import observe, packets_to_read
from rfgs_core.measure.packets import (
    DOPPLER_GRID,
    change_of_packets,
    doppler_spectrum,
    noise_power,
    wiener_estimate,
)
from rfgs_core.radio import FrameSamples, Radio, layout, place_devices
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.impairments import Impairments
from rfgs_core.run.encoders import refuse_other_radios
from rfgs_core.settings import TrainConfig

COUNT, INTERVAL_S = 16, 0.25e-3
RADAR = Radio("radar", 60e9, 62e9, 48, 4, 1, 1, 6, (0.0, 0.05, 0.0), own_device_links="only")
BOUNDS_M = np.array([[0.0, 0.0, 0.0], [4.0, 3.5, 2.5]])


def noise(shape: tuple[int, ...], power: float, seed: int) -> np.ndarray:
    parts = np.random.default_rng(seed).standard_normal((2, *shape)) * np.sqrt(power / 2)
    return parts[0] + 1j * parts[1]


def passing(speed_m_s: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Change, links and subcarriers of a point that approaches the first radar, as it sees it."""
    elements = layout(RADAR, place_devices(RADAR, BOUNDS_M))
    own = elements.measured & (elements.tx_device == 0)[:, None]
    radar = elements.rx_xyz[elements.rx_device == 0].mean(axis=0)
    towards = np.array([1.4, 1.6, 1.1]) - radar
    distance_m = np.linalg.norm(towards) - speed_m_s * INTERVAL_S * np.arange(COUNT)
    places = radar + distance_m[:, None] * towards / np.linalg.norm(towards)
    out = np.linalg.norm(places[:, None] - elements.tx_xyz, axis=2)
    back = np.linalg.norm(places[:, None] - elements.rx_xyz, axis=2)
    path_m = out[:, :, None] + back[:, None]
    wave = np.exp(-2j * np.pi * path_m[..., None] * RADAR.freq_hz / SPEED_OF_LIGHT)
    subcarriers = np.ones(RADAR.num_subcarriers, bool)
    subcarriers[30:36] = False
    return (wave * (own[..., None] & subcarriers)).astype(np.complex64), own, subcarriers


def test_noise_is_told_from_an_echo_a_thousand_times_stronger() -> None:
    subcarriers = np.ones(160, bool)
    subcarriers[20:30] = False
    echo = np.exp(2j * np.pi * (0.13 * np.arange(COUNT)[:, None, None] + 0.21 * np.arange(160)))
    change = 30.0 * echo + noise((COUNT, 12, 160), 1.0, 0)
    assert noise_power(change, subcarriers) == pytest.approx(1.0, rel=0.05)
    assert noise_power(change - noise((COUNT, 12, 160), 1.0, 0), subcarriers) < 1e-6 * 900


@pytest.mark.parametrize("speed_m_s", [0.0, 1.5, -3.2])
def test_a_speed_stands_at_its_doppler_frequency(speed_m_s: float) -> None:
    """ν = 2vf/c per second: approaching is positive."""
    change, own, _ = passing(speed_m_s)
    tx, rx = np.nonzero(own)
    cells = np.fft.ifft(change[:, tx, rx], axis=2)
    spectrum = doppler_spectrum(cells, 1e-9, COUNT).sum(axis=(1, 2))
    frequency_hz = np.fft.fftfreq(DOPPLER_GRID * COUNT, INTERVAL_S)
    expected_hz = 2 * speed_m_s * RADAR.centre_hz / SPEED_OF_LIGHT
    assert frequency_hz[spectrum.argmax()] == pytest.approx(expected_hz, abs=0.5 / INTERVAL_S / 16)


def test_the_filter_errs_as_little_as_theory_allows() -> None:
    """E|x̂ − x₀|² = r(0) − r₀ᴴ (R + σ²I)⁻¹ r₀ of a process with a known spectrum."""
    cells, power, level = 20_000, np.zeros(DOPPLER_GRID * COUNT), 3.0
    power[[2, 3, 4, 20]] = 8.0, 16.0, 8.0, 4.0
    subcarrier = np.exp(2j * np.pi * np.outer(np.arange(COUNT), np.arange(len(power))) / len(power))
    amplitude = noise((len(power), cells), 1.0, 1) * np.sqrt(power / len(power))[:, None]
    true = subcarrier @ amplitude
    heard = np.arange(COUNT) != 5
    seen = np.where(heard[:, None], true + noise(true.shape, level, 2), 0)
    spectrum = np.broadcast_to(power[:, None], (len(power), cells))
    found = wiener_estimate(seen.astype(np.complex64), spectrum, level, heard)[0]
    basis = subcarrier[heard] * np.sqrt(power / len(power))
    covariance = basis @ basis.conj().T
    towards = basis @ (np.sqrt(power / len(power)) * subcarrier[0]).conj()
    total = covariance + level * np.eye(heard.sum())
    least = power.mean() - np.real(towards.conj() @ np.linalg.solve(total, towards))
    assert least < 0.5 * power.mean()
    assert np.mean(np.abs(found - true[0]) ** 2) == pytest.approx(least, rel=0.03)


def test_who_stands_still_gains_the_number_of_packets() -> None:
    """A line at ν = 0 of power P: the error is σ²P/(NP + σ²), a mean over the packets."""
    cells, level = 20_000, 0.5
    true = noise((cells,), 1.0, 3)
    seen = true + noise((COUNT, cells), level, 4)
    spectrum = np.zeros((DOPPLER_GRID * COUNT, cells))
    spectrum[0] = DOPPLER_GRID * COUNT
    found = wiener_estimate(seen.astype(np.complex64), spectrum, level, np.ones(COUNT, bool))[7]
    error = np.mean(np.abs(found - true) ** 2)
    assert error == pytest.approx(level / (COUNT + level), rel=0.03)


def test_an_echo_comes_out_of_noise_and_noise_alone_stays_out() -> None:
    """Of noise ten times the echo in every entry less than a thirtieth is left."""
    change, own, subcarriers = passing(1.0)
    elements = layout(RADAR, place_devices(RADAR, BOUNDS_M))
    dirt = noise(change.shape, 10.0, 5).astype(np.complex64)
    found = change_of_packets(change + dirt, own, subcarriers, elements)
    visible = own[..., None] & subcarriers
    error = np.mean(np.abs(found - change)[:, visible] ** 2, axis=1)
    # Packets in the middle know those before and after them.
    assert error[COUNT // 2] < 0.7 * error[0] and error[0] < 10.0 / 30
    assert (found[:, ~visible] == 0).all()
    alone = change_of_packets(dirt, own, subcarriers, elements)[:, visible]
    assert np.mean(np.abs(alone) ** 2) < 1e-3 * 10.0
    # Without its first packet the echo at that time is still known.
    lost = change + dirt
    lost[0] = np.nan
    late = change_of_packets(lost, own, subcarriers, elements)
    assert np.mean(np.abs(late[0] - change[0])[visible] ** 2) < 10.0 / 20


def test_links_that_may_not_be_read_are_not() -> None:
    """Also one among the visible links of its device pair, and whatever it holds."""
    change, own, subcarriers = passing(1.0)
    elements = layout(RADAR, place_devices(RADAR, BOUNDS_M))
    dirty = change + noise(change.shape, 10.0, 7).astype(np.complex64)
    links = own.copy()
    tx, rx = np.argwhere(own)[3]
    links[tx, rx] = False
    found = []
    for value in (0.0, 1e3, np.nan):
        dirty[:, tx, rx] = value
        found.append(change_of_packets(dirty, links, subcarriers, elements))
        np.testing.assert_array_equal(found[-1], found[0])
    assert found[0].any() and not found[0][:, tx, rx].any()


def test_without_noise_packets_stay_as_they_are() -> None:
    change, own, subcarriers = passing(1.0)
    elements = layout(RADAR, place_devices(RADAR, BOUNDS_M))
    np.testing.assert_array_equal(change_of_packets(change, own, subcarriers, elements), change)
    # A little noise: the filter runs, and errs less than the noise it meets.
    dirt = noise(change.shape, 1e-4, 6).astype(np.complex64)
    found = change_of_packets(change + dirt, own, subcarriers, elements)
    error = np.mean(np.abs(found - change)[:, own[..., None] & subcarriers] ** 2)
    assert 0 < error < 1e-4


@pytest.fixture
def walking(own_dataset: Path) -> Callable[[], Sequence]:
    """The tiny dataset with packets whose change turns by one Doppler bin."""
    sequence = open_dataset(own_dataset).sequence()
    radio, elements, files = sequence.radio_spec("wifi"), sequence.layout("wifi"), sequence.files
    static = sequence.csi_static("wifi")
    change = {frame: sequence.csi("wifi", frame) - static for frame in sequence.frames}
    turn = np.exp(2j * np.pi * np.arange(COUNT) / COUNT)[:, None, None, None]
    info = json.loads(files.info.read_text())
    info["radios"]["wifi"] |= {"samples_per_frame": COUNT, "sample_interval_s": 1e-3}
    write_json(files.info, info)
    store = files.csi("wifi")
    shutil.rmtree(store)
    times_s = [sequence.time_s(frame) for frame in sequence.frames]
    samples = FrameSamples(1e-3 * np.arange(COUNT))
    create_csi(store, radio, elements, sequence.frames, times_s, samples)
    for index, frame in enumerate(sequence.frames):
        packets = (static + turn * change[frame]).astype(np.complex64)
        write_csi(store, index, packets, files.csi_done("wifi", frame))
    write_csi(store, None, static, files.csi_done("wifi", None))
    finish_dataset(own_dataset, open_dataset(own_dataset).info)
    return lambda: open_dataset(own_dataset).sequence()


def test_one_packet_and_no_noise_give_the_bytes_of_the_first(
    walking: Callable[[], Sequence], tiny_dataset: Path
) -> None:
    single, several = open_dataset(tiny_dataset).sequence(), walking()
    for frame in single.frames:
        first = observe(several, "wifi", frame)
        everything = observe(several, "wifi", frame, packets="all")
        assert everything.delta.tobytes() == first.delta.tobytes()
        one = observe(single, "wifi", frame, packets="all")
        assert one.delta.tobytes() == observe(single, "wifi", frame).delta.tobytes()


def test_the_fit_and_its_controls_see_the_same_estimate(
    walking: Callable[[], Sequence], own_dataset: Path, tmp_path: Path, train, quick_config
) -> None:
    settings = Impairments(thermal_noise=True, power_dbm=-10.0, loss_rate=0.3)
    impair_dataset(own_dataset, settings, seed=2)
    config = replace(quick_config, channel="impaired", packets="all")
    run = train(own_dataset, tmp_path / "run", config)
    frame = run.frames[0]
    assert run.config.settings.packets == "all"
    seen, clean = run.observations(frame), observe(walking(), "wifi", frame)
    raw = observe(walking(), "wifi", frame, "impaired")
    # Links that lost their first packet are known from the others.
    assert seen.links.sum() == clean.links.sum() > raw.links.sum()
    both = raw.links[..., None] & raw.subcarriers
    error = [np.mean(np.abs(one.delta - clean.delta)[both] ** 2) for one in (seen, raw)]
    assert error[0] < 0.5 * error[1]
    scene = Scene.of(run)
    evidence = scene.evidence(frame, np.ones(scene.grid.shape, np.float32))
    heard = seen.links[..., None] & seen.subcarriers
    np.testing.assert_allclose(evidence.delta[heard], seen.delta[heard], rtol=1e-6)
    assert np.isnan(evidence.delta[~heard]).all()
    # The truth is still the clean channel at the frame's own time.
    np.testing.assert_array_equal(scene.csi(frame), walking().csi("wifi", frame))


def test_the_room_is_learned_from_all_packets(walking: Callable[[], Sequence], monkeypatch) -> None:
    """A change that turns once fades from the mean, so that the room is left."""
    monkeypatch.setattr("rfgs_core.background.learned.LEAST_FRAMES", 2)
    sequence = walking()
    seen = observe(sequence, "wifi", 1)
    room = learned_background(sequence, "wifi", "clean", "complex", "all")
    visible = seen.links[..., None] & seen.subcarriers
    np.testing.assert_allclose(room[visible], seen.static[visible], rtol=1e-4, atol=1e-9)
    first = learned_background(sequence, "wifi", "clean", "complex")
    assert np.abs(first - room)[visible].max() > 1e2 * np.abs(room - seen.static)[visible].max()


def test_packets_are_chosen_where_that_makes_sense(
    walking: Callable[[], Sequence], tiny_dataset: Path
) -> None:
    several, single = walking(), open_dataset(tiny_dataset).sequence()
    plain = TrainConfig()
    assert packets_to_read(None, several, "wifi", plain) == "all"
    assert packets_to_read("first", several, "wifi", plain) == "first"
    assert packets_to_read(None, single, "wifi", plain) == "first"
    for sequence, config, why in (
        (single, plain, "holds one packet of wifi per frame.*--packets-per-frame"),
        (several, replace(plain, observe="power"), "--observe power has no phases"),
        (several, replace(plain, calibrate="phase"), "--calibrate phase finds offsets of a frame"),
    ):
        assert packets_to_read(None, sequence, "wifi", config) == "first"
        with pytest.raises(RfgsError, match=f"--packets all: .*{why}"):
            packets_to_read("all", sequence, "wifi", config)


def test_an_encoder_of_other_packets_is_refused_before_training(
    walking: Callable[[], Sequence], tmp_path: Path
) -> None:
    sequence, file = walking(), tmp_path / "doppler.npz"
    elements, freq_hz = sequence.layout("wifi"), sequence.radio_spec("wifi").freq_hz
    signature = RadioSignature.of(elements, freq_hz, COUNT, 1e-3)
    save_encoder(file, LearnedEncoder("doppler", EncoderModel("doppler", 0), signature))
    refuse_other_radios(file, sequence, "wifi", "all")
    with pytest.raises(RfgsError, match="16 packets 1 ms apart; of this one 1 per frame are read"):
        refuse_other_radios(file, sequence, "wifi", "first")


def test_the_command_refuses_in_one_line(
    tiny_dataset: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run"
    arguments = ["--radio", "wifi", "--packets", "all", "--out", str(out)]
    assert main(["train", str(tiny_dataset), *arguments]) == 2
    told = capsys.readouterr().err
    assert not out.exists() and "--packets all" in told and len(told.strip().splitlines()) == 1
