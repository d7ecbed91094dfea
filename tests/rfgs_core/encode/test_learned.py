# SPDX-License-Identifier: Apache-2.0
"""Learned encoders: untrained they are a closed form, and their two readings agree."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from rfgs_core.arrays import load_arrays, save_arrays
from rfgs_core.encode.learned import LearnedEncoder, load_encoder, network_for, save_encoder
from rfgs_core.encode.learned.blocks import Blocks
from rfgs_core.encode.learned.networks import (
    _doppler_cube,
    csi_picture,
    doppler_picture,
    feature_windows,
)
from rfgs_core.encode.protocol import FEATURES
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.gaussians import FEATURE_DIM
from rfgs_core.measure.observations import Observations
from rfgs_core.radio import Radio, layout, place_devices
from rfgs_core.radio.constants import SPEED_OF_LIGHT

BOUNDS_M = np.array([[0.0, 0.0, 0.0], [4.0, 3.5, 2.5]])
SCATTERER_M = np.array([1.7, 2.1, 1.2])
RADIOS = {
    "csi": Radio("wifi", 5.72e9, 5.88e9, 16, 1, 1, 2, 4, (0.0, 0.0, -0.3)),
    "cube": Radio("radar", 60e9, 61e9, 24, 4, 1, 1, 4, (0.0, 0.05, 0.0), own_device_links="only"),
    "doppler": Radio(
        "radar", 60e9, 61e9, 24, 4, 1, 1, 4, (0.0, 0.05, 0.0), own_device_links="only"
    ),
    "range": Radio("uwb", 3.1e9, 6.1e9, 48, 1, 1, 1, 4, (0.0, 0.0, -0.3), rx_spacing_m=0.2),
}
KINDS = list(RADIOS)
PACKETS, INTERVAL_S = 20, 0.25e-3


def scattered(kind: str, hide: bool = True, point: np.ndarray = SCATTERER_M) -> Observations:
    """One scatterer; some links and subcarriers are hidden."""
    radio = RADIOS[kind]
    elements = layout(radio, place_devices(radio, BOUNDS_M))
    out = np.linalg.norm(elements.tx_xyz - point, axis=1)
    back = np.linalg.norm(elements.rx_xyz - point, axis=1)
    path_m = out[:, None, None] + back[:, None]
    wave = np.exp(-2j * np.pi * radio.freq_hz * path_m / SPEED_OF_LIGHT) * 3e-4 / path_m**2
    links, subcarriers = elements.measured.copy(), np.ones(radio.num_subcarriers, bool)
    if hide:
        links[:, -1] = False
        subcarriers[5:8] = False
    delta = np.where(links[..., None] & subcarriers, wave, 0).astype(np.complex64)
    seen = Observations(delta, 0 * delta, links, subcarriers, elements, radio.freq_hz, BOUNDS_M)
    return seen if kind != "doppler" else turning(seen, 2.3)


def turning(seen: Observations, bins: float, still: float = 0.0) -> Observations:
    """Packets whose change turns by some Doppler bins, and `still` times it that does not."""
    turn = np.exp(2j * np.pi * bins * np.arange(PACKETS) / PACKETS)[:, None, None, None] + still
    packets = (turn * seen.delta).astype(np.complex64)
    return replace(seen, delta=packets[0], packets=packets, packet_interval_s=INTERVAL_S)


def shaken(kind: str, seen: Observations) -> LearnedEncoder:
    """An encoder with weights that are no longer those of the start."""
    encoder = LearnedEncoder.untrained(kind, seen, 0)
    generator = torch.Generator().manual_seed(1)
    with torch.no_grad():
        for weight in encoder.model.parameters():
            weight += 0.05 * torch.randn(weight.shape, generator=generator)
    return encoder


def near(count: int) -> np.ndarray:
    return SCATTERER_M + np.random.default_rng(0).uniform(-0.6, 0.6, (count, 3))


def test_features_have_one_dimension_everywhere() -> None:
    assert FEATURES == FEATURE_DIM


@pytest.mark.parametrize("kind", KINDS)
def test_the_radio_chooses_its_network(kind: str) -> None:
    assert network_for(scattered(kind)) == kind


@pytest.mark.parametrize("kind", KINDS)
def test_with_all_weights_alike_it_is_a_windowed_matched_filter(kind: str) -> None:
    """φ_c = RMS over pairs of |mean over entries of w_c H e^{+jkd}|, H of power one."""
    seen = scattered(kind)
    points = near(12)
    encoder = LearnedEncoder.untrained(kind, seen, 0)
    with torch.no_grad():
        encoder.model.attention.last.weight.zero_()
    got = encoder(seen, points)
    window = feature_windows(torch.from_numpy(seen.freq_hz)).numpy()
    level = np.sqrt(np.mean(np.abs(seen.delta[seen.links].astype(complex)) ** 2, axis=0))
    csi = seen.delta / np.where(seen.subcarriers, level, 1.0)
    pair, names = seen.pairs
    power = np.zeros((len(points), 32))
    for number in range(len(names)):
        mine = csi[pair == number][:, seen.subcarriers]
        rms = np.sqrt(np.mean(np.abs(mine) ** 2))
        for row, point in enumerate(points):
            out = np.linalg.norm(seen.layout.tx_xyz - point, axis=1)
            back = np.linalg.norm(seen.layout.rx_xyz - point, axis=1)
            path_m = (out[:, None] + back)[pair == number]
            turn = np.exp(
                2j * np.pi * seen.freq_hz[seen.subcarriers] * path_m[:, None] / SPEED_OF_LIGHT
            )
            image = (
                (mine / rms * turn).mean(axis=0)
                @ window[:, seen.subcarriers].T
                / len(seen.subcarriers)
            )
            power[row] += np.abs(image) ** 2 / len(names)
    np.testing.assert_allclose(got, np.sqrt(power), atol=0.01 * np.sqrt(power).max())


@pytest.mark.parametrize("kind", KINDS)
def test_compiled_and_differentiable_reading_agree(kind: str) -> None:
    seen, points = scattered(kind), near(20)
    encoder = shaken(kind, seen)
    got = encoder(seen, points)
    with torch.no_grad():
        twin, *_ = encoder.model.at_points(Blocks.of(seen), torch.from_numpy(points))
    assert np.std(got) > 0
    np.testing.assert_allclose(got, twin.numpy(), atol=0.01 * float(twin.max()))
    # The weights count, and a point's value does not depend on the others.
    plain = LearnedEncoder.untrained(kind, seen, 0)(seen, points)
    assert np.abs(got - plain).max() > 0.02 * plain.max()
    np.testing.assert_allclose(encoder(seen, points[3:5]), got[3:5], rtol=1e-5)


@pytest.mark.parametrize("kind", KINDS)
def test_a_scatterer_stands_out(kind: str) -> None:
    seen = scattered(kind)
    away = np.random.default_rng(3).uniform(BOUNDS_M[0], BOUNDS_M[1], (300, 3))
    away = away[np.linalg.norm(away - SCATTERER_M, axis=1) > 0.5]
    encoder = LearnedEncoder.untrained(kind, seen, 0)
    features = encoder(seen, np.concatenate([SCATTERER_M[None], away]))
    strength = np.linalg.norm(features, axis=1)
    assert strength[0] > strength[1:].max()


def test_level_and_empty_pairs_change_nothing() -> None:
    seen, points = scattered("csi"), near(5)
    encoder = shaken("csi", seen)
    louder = seen.with_delta(1e3 * seen.delta)
    np.testing.assert_allclose(encoder(louder, points), encoder(seen, points), rtol=1e-4)
    silent = encoder(seen.with_delta(0 * seen.delta), points)
    assert (silent < 1e-5).all()


def test_the_picture_shows_amplitude_phase_and_what_is_visible() -> None:
    """One path: amplitude constant, phase a line whose slope is taken out."""
    seen = scattered("csi")
    blocks = Blocks.of(seen)
    picture = csi_picture(blocks.csi, blocks.visible, blocks.freq_hz)
    shown = blocks.visible
    torch.testing.assert_close(picture[:, :, 0], blocks.csi.abs())
    phase = picture[:, :, 1]
    assert (phase[~shown] == 0).all()
    by_link = phase[shown].reshape(-1, int(seen.subcarriers.sum()))
    assert (by_link - by_link[:, :1]).abs().max() < 1e-3
    assert torch.equal(picture[:, :, 2] == 1, shown)


def test_windows_follow_frequency() -> None:
    windows = feature_windows(torch.from_numpy(RADIOS["range"].freq_hz)).numpy()
    centre = (windows * np.arange(48)).sum(axis=1) / windows.sum(axis=1)
    assert (np.diff(centre) > 0).all()
    np.testing.assert_allclose((windows**2).mean(axis=1), 1.0, rtol=1e-5)


@pytest.mark.parametrize("kind", KINDS)
def test_files_bring_the_encoder_back(kind: str, tmp_path: Path) -> None:
    seen, points = scattered(kind), near(4)
    encoder = shaken(kind, seen)
    save_encoder(tmp_path / "a.npz", encoder)
    loaded = load_encoder(tmp_path / "a.npz")
    np.testing.assert_array_equal(loaded(seen, points), encoder(seen, points))
    save_encoder(tmp_path / "b.npz", loaded)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_other_radios_are_refused_and_other_places_are_not(tmp_path: Path) -> None:
    seen = scattered("csi")
    save_encoder(tmp_path / "wifi.npz", LearnedEncoder.untrained("csi", seen, 0))
    encoder = load_encoder(tmp_path / "wifi.npz")
    for kind in ("cube", "range"):
        with pytest.raises(
            RfgsError, match=r"wifi\.npz was made for a radio of 16 subcarriers .* this"
        ):
            encoder(scattered(kind), near(1))
    shifted = replace(seen, freq_hz=seen.freq_hz + 1e6)
    with pytest.raises(RfgsError, match=r"5\.726"):
        encoder(shifted, near(1))
    wide = replace(seen.layout, rx_xyz=2.0 * seen.layout.rx_xyz)
    with pytest.raises(RfgsError, match="spaced otherwise"):
        encoder(replace(seen, layout=wide), near(1))
    moved = replace(seen.layout, tx_xyz=seen.layout.tx_xyz + 1.0, rx_xyz=seen.layout.rx_xyz + 1.0)
    there = encoder(replace(seen, layout=moved), near(3) + 1.0)
    np.testing.assert_allclose(there, encoder(seen, near(3)), rtol=1e-3, atol=1e-5)


def test_planar_arrays_have_no_cube() -> None:
    with pytest.raises(RfgsError, match=r"evenly spaced antennas in a line.*use --network csi"):
        LearnedEncoder.untrained("cube", scattered("csi"), 0)


def test_a_speed_lights_its_band_of_the_doppler_picture() -> None:
    """A path that gets shorter by v in 2 v T f/c turns; who stands still is in the middle."""
    for bins in (0.0, 4.0, -6.0):
        seen = turning(scattered("cube", hide=False), bins)
        blocks = Blocks.of(seen)
        assert blocks.packets is not None
        cube = _doppler_cube(blocks.packets)
        picture = doppler_picture(cube)
        assert picture.shape == (len(blocks), 3, 16, 4, 24)
        frequency = picture[0, 2, :, 0, 0]
        assert frequency[0] == -1 and frequency[-1] == 1 and (frequency.diff() > 0).all()
        for pair in range(len(blocks)):
            band = int(picture[pair, 0].sum(dim=(1, 2)).argmax())
            assert band == int((PACKETS // 2 + bins) * 16 // PACKETS)
        # Largest amplitude and RMS of a band are those of the cube.
        torch.testing.assert_close(picture[:, 1].amax(), cube.abs().amax())


def test_weights_part_who_moves_from_what_stands_still(monkeypatch) -> None:
    """Weights of zero at Doppler zero take the residual of the room out, and nothing else."""
    seen = turning(scattered("cube"), 5.0, still=3.0)
    blocks = Blocks.of(seen)
    network = LearnedEncoder.untrained("doppler", seen, 0).model.network
    window = feature_windows(blocks.freq_hz)[:, None, None, :]
    assert blocks.packets is not None
    level = float(blocks.packets[:, 0].abs().square().sum().sqrt())
    with torch.no_grad():
        whole = network(blocks)
    torch.testing.assert_close(whole, blocks.packets[:, None, 0] * window, atol=1e-5, rtol=1e-4)

    def moving_only(picture: torch.Tensor) -> torch.Tensor:
        gates = torch.ones(len(picture), FEATURES, *picture.shape[2:])
        gates[:, :, 8] = 0.0
        return gates

    monkeypatch.setattr(network, "gates", moving_only)
    with torch.no_grad():
        moving = network(blocks)
    # One part turns and three stand still.
    torch.testing.assert_close(moving, whole / 4.0, atol=1e-4 * level, rtol=1e-3)


def test_packets_belong_to_the_radio_of_a_doppler_encoder(tmp_path: Path) -> None:
    seen = scattered("doppler")
    save_encoder(tmp_path / "d.npz", LearnedEncoder.untrained("doppler", seen, 0))
    encoder = load_encoder(tmp_path / "d.npz")
    assert encoder.radio.packets == PACKETS and encoder.radio.packet_interval_s == INTERVAL_S
    single = scattered("cube")
    faster = replace(seen, packet_interval_s=0.5 * INTERVAL_S)
    for other, told in ((single, "1 per frame are read"), (faster, "20 per .*0.125 ms apart")):
        with pytest.raises(RfgsError, match=f"20 packets 0.25 ms apart; of this one {told}.*`rfgs"):
            encoder(other, near(1))
    # The other networks look at the first packet, however many there are.
    cube = LearnedEncoder.untrained("cube", single, 0)
    np.testing.assert_array_equal(cube(seen, near(3)), cube(single, near(3)))
    words = "the doppler network expects several packets per frame, .* leave out --packets first"
    with pytest.raises(RfgsError, match=words):
        LearnedEncoder.untrained("doppler", single, 0)


def test_damaged_files_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "e.npz"
    with pytest.raises(RfgsError, match="no such file; make it again with `rfgs encode`"):
        load_encoder(file)
    save_encoder(file, LearnedEncoder.untrained("csi", scattered("csi"), 0))
    arrays = load_arrays(file, "")
    first = next(name for name in arrays if name.startswith("weights."))
    for change, message in (
        ({"schema": np.array("rfgs-encoder/1")}, "expected schema rfgs-encoder/2, found rfgs-enc"),
        ({"network": np.array("transformer")}, "network 'transformer' is unknown"),
        ({first: arrays[first][:1]}, "is missing, not finite or not of shape"),
        ({first: arrays[first] * np.nan}, "is missing, not finite or not of shape"),
    ):
        save_arrays(file, {**arrays, **change})
        with pytest.raises(RfgsFormatError, match=message):
            load_encoder(file)
    save_arrays(file, {name: value for name, value in arrays.items() if name != "freq_hz"})
    with pytest.raises(RfgsFormatError, match="missing freq_hz"):
        load_encoder(file)
    file.write_bytes(b"PK\x03\x04 and nothing more")
    with pytest.raises(RfgsFormatError, match="damaged"):
        load_encoder(file)
    (tmp_path / "notes.txt").write_text("x")
    with pytest.raises(RfgsError, match=r"ends in \.npz"):
        load_encoder(tmp_path / "notes.txt")
