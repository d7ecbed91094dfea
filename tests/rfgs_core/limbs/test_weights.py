# SPDX-License-Identifier: Apache-2.0
"""Files of networks: what was written is read, and what is not ours is refused in one line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors.torch import save_file

from rfgs_core.adam import Adam
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.limbs import weights
from rfgs_core.limbs.network import LimbNetwork
from rfgs_core.limbs.progress import Progress, keep, resume
from rfgs_core.limbs.weights import load_network, own_network, save_network
from rfgs_core.radio.presets import preset


@pytest.fixture
def network() -> LimbNetwork:
    torch.manual_seed(1)
    return LimbNetwork(4)


def test_a_network_comes_back_in_half_precision(network: LimbNetwork, tmp_path: Path) -> None:
    path = tmp_path / "wifi.safetensors"
    save_network(path, network, preset("wifi"), {"frames": 64, "seed": 3})
    trained = load_network(path)
    assert trained.card["frames"] == 64 and trained.card["radio"] == "wifi"
    for name, value in trained.network.state_dict().items():
        torch.testing.assert_close(value, network.state_dict()[name].half().float())
    again = tmp_path / "again.safetensors"
    save_network(again, network, preset("wifi"), {"seed": 3, "frames": 64})
    assert again.read_bytes() == path.read_bytes()


def test_the_network_of_a_band_is_found(network, tmp_path, monkeypatch) -> None:
    save_network(tmp_path / "wifi.safetensors", network, preset("wifi"), {})
    monkeypatch.setattr(weights, "OWN", tmp_path)
    assert own_network(preset("wifi").freq_hz) is not None
    assert own_network(preset("mmwave").freq_hz) is None
    # A quarter of the bandwidth resolves other things.
    assert own_network(preset("wifi").freq_hz[:16]) is None


@pytest.mark.parametrize("damage", ["empty", "cut", "text", "schema", "shape", "nan"])
def test_damaged_files_are_refused(network, tmp_path: Path, damage: str) -> None:
    path = tmp_path / "wifi.safetensors"
    save_network(path, network, preset("wifi"), {})
    whole = path.read_bytes()
    if damage == "schema":
        save_file({"a": torch.zeros(1)}, path, {"schema": "rfgs-limbs/9"})
    elif damage == "shape":
        save_network(path, LimbNetwork(48), preset("wifi"), {"ranges": 4})
    elif damage == "nan":
        broken = LimbNetwork(4)
        with torch.no_grad():
            broken.query[:] = torch.nan
        save_network(path, broken, preset("wifi"), {})
    else:
        path.write_bytes({"empty": b"", "cut": whole[: len(whole) // 2], "text": b"x" * 99}[damage])
    with pytest.raises(RfgsFormatError, match=rf"{path.name}.*make it"):
        load_network(path)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(RfgsError, match=r"none\.safetensors: no such file.*rfgs limbs"):
        load_network(tmp_path / "none.safetensors")


def test_a_training_goes_on_where_it_was(network: LimbNetwork, tmp_path: Path) -> None:
    optimiser = Adam.of(network.parameters(), 1e-3, decay=0.01)

    def step(own: LimbNetwork, optimiser: Adam) -> None:
        optimiser.zero_grad()
        sum((value**2).sum() for value in own.parameters()).backward()
        optimiser.step()

    step(network, optimiser)
    keep(tmp_path / "state", network, optimiser, Progress(640, 12.5))
    other = LimbNetwork(4)
    second = Adam.of(other.parameters(), 1e-3, decay=0.01)
    assert resume(tmp_path / "state", other, second) == Progress(640, 12.5)
    for _ in range(2):
        step(network, optimiser)
        step(other, second)
    for name, value in network.state_dict().items():
        np.testing.assert_array_equal(value.numpy(), other.state_dict()[name].numpy())


def test_a_training_goes_on_with_what_it_was_asked_for_alone(
    network: LimbNetwork, tmp_path: Path
) -> None:
    optimiser = Adam.of(network.parameters(), 1e-3, decay=0.01)
    sum((value**2).sum() for value in network.parameters()).backward()
    optimiser.step()
    keep(tmp_path / "state", network, optimiser, Progress(1, 0.0), "seed 3, 800 frames")
    assert resume(tmp_path / "state", network, optimiser, "seed 3, 800 frames").frames == 1
    with pytest.raises(RfgsFormatError, match="other options; give the same ones again, or delete"):
        resume(tmp_path / "state", network, optimiser, "seed 3, 8000 frames")


def test_a_state_of_another_network_is_refused(network: LimbNetwork, tmp_path: Path) -> None:
    optimiser = Adam.of(network.parameters(), 1e-3, decay=0.01)
    sum((value**2).sum() for value in network.parameters()).backward()
    optimiser.step()
    keep(tmp_path / "state", network, optimiser, Progress(1, 0.0))
    other = LimbNetwork(48)
    with pytest.raises(RfgsFormatError, match=r"of another network: .*; delete it"):
        resume(tmp_path / "state", other, Adam.of(other.parameters(), 1e-3, decay=0.01))
