# SPDX-License-Identifier: Apache-2.0
"""A bundle as a scene of Sionna RT is the one that the factory traces."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from dataset_factory.scene.bundle import Bundle
from dataset_factory.scene.devices import choose_devices
from dataset_factory.trace import sionna_scene
from rfgs_core.errors import RfgsError
from rfgs_core.radio import preset
from rfgs_core.radio.images import SPECULAR
from rfgs_core.radio.path_table import PathTable

MakeBundle = Callable[..., Bundle]


def traced(bundle: Bundle) -> PathTable:
    """Paths of the factory's own tracer, people and their shadows left out."""
    from dataset_factory.trace import Tracer

    radio = preset("wifi_commodity")
    return Tracer(bundle, radio, choose_devices(bundle, radio)[0], depth=1).static_paths()


def amplitudes(bundle: Bundle, depth: int, frame: int | None = None) -> dict[float, complex]:
    """Amplitude at the carrier by delay [ns] of Sionna's own paths from `tx-0` to `rx-1`."""
    import sionna.rt as rt

    scene = sionna_scene(bundle.path, "wifi_commodity", frame)
    paths = rt.PathSolver()(scene, max_depth=depth, refraction=False)
    real, imaginary = (np.array(part) for part in paths.a)
    a = (real + 1j * imaginary)[1, 0, 0, 0]
    delay_ns = 1e9 * np.array(paths.tau)[1, 0]
    return {float(t): complex(x) for t, x in zip(delay_ns, a, strict=True) if t >= 0 and x != 0}


def test_sionna_finds_the_path_of_the_factory_s_tracer(make_bundle: MakeBundle) -> None:
    bundle = make_bundle()
    table = traced(bundle)
    freq_hz = preset("wifi_commodity").centre_hz
    own = (table.tx_site == 0) & (table.rx_site == 1)
    found = amplitudes(bundle, depth=1)
    for kind in (0, SPECULAR):
        met = own & (table.kind[:, 0] == kind)
        row = table.select(np.flatnonzero(met)[:1])
        delay_ns = 1e9 * row.delay_s[0]
        nearest = min(found, key=lambda delay: abs(delay - delay_ns))
        assert nearest == pytest.approx(delay_ns, abs=1e-3)
        expected = abs(row.amplitude_at(np.array([freq_hz]))[0, 0, 0])
        assert abs(found[nearest]) == pytest.approx(expected, rel=1e-3)


def test_people_stand_in_it_where_they_are_at_the_frame(person_bundle: Bundle) -> None:
    first, second = (sionna_scene(person_bundle.path, "wifi_commodity", n) for n in (1, 2))
    assert set(first.objects) - set(sionna_scene(person_bundle.path, "wifi").objects) == {
        "moving-1"
    }
    assert first.objects["moving-1"].radio_material.name == "material-1"
    moved = np.array(second.objects["moving-1"].position) - np.array(
        first.objects["moving-1"].position
    )
    assert moved.ravel() == pytest.approx([0.5, -0.3, 0.0], abs=1e-3)
    assert len(first.transmitters) == len(first.receivers) == 4


def test_what_is_not_there_is_named(person_bundle: Bundle) -> None:
    with pytest.raises(RfgsError, match="no frame 9; it has 2, 1 to 2"):
        sionna_scene(person_bundle.path, "wifi", 9)
    with pytest.raises(RfgsError, match="unknown radio 'wify'"):
        sionna_scene(person_bundle.path, "wify")
