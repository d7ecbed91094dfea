# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from dataset_factory.scene.bundle import Bundle
from rfgs_core.errors import RfgsError
from rfgs_core.radio import DevicePose, Radio, layout, preset
from rfgs_core.radio.constants import SPEED_OF_LIGHT

MakeBundle = Callable[..., Bundle]
WIDE = {"freq_min_hz": 3.1e9, "freq_max_hz": 10.6e9, "num_subcarriers": 512}


def distances(radio: Radio, devices: list[DevicePose]) -> np.ndarray:
    elements = layout(radio, devices)
    return np.linalg.norm(elements.tx_xyz[:, None] - elements.rx_xyz[None], axis=2)


@pytest.mark.parametrize("band", [{}, WIDE], ids=["narrow", "wide"])
def test_free_space_has_friis_amplitude_and_delay(
    make_bundle: MakeBundle, small_radio: Radio, two_devices: list[DevicePose], band: dict
) -> None:
    from dataset_factory.trace import Tracer

    radio = replace(small_radio, **band)
    csi = Tracer(make_bundle(static=[]), radio, two_devices, depth=1).static()
    d = distances(radio, two_devices)
    friis = SPEED_OF_LIGHT / radio.freq_hz / (4 * np.pi * d[..., None])
    error_db = 20 * np.log10(np.abs(csi) / friis)
    assert np.abs(error_db[..., [0, -1]]).max() < 0.1
    turn = np.unwrap(np.angle(csi), axis=2)
    delay_s = -(turn[..., -1] - turn[..., 0]) / (2 * np.pi * (radio.freq_hz[-1] - radio.freq_hz[0]))
    assert np.abs(delay_s * SPEED_OF_LIGHT - d).max() < 1e-3
    phase = np.exp(-2j * np.pi * radio.freq_hz * d[..., None] / SPEED_OF_LIGHT)
    across = ~np.eye(2, dtype=bool)[layout(radio, two_devices).tx_device][
        :, layout(radio, two_devices).rx_device
    ]
    # A receiver straight above its own transmitter has no defined sign of polarisation.
    assert np.abs(csi / friis / phase - 1)[across].max() < 2e-2


def test_elements_match_tracing_each_of_them(
    make_bundle: MakeBundle, two_devices: list[DevicePose]
) -> None:
    import sionna.rt as rt

    from dataset_factory.trace.environment import Environment
    from dataset_factory.trace.rays.scene import environment_scene
    from rfgs_core.radio.sites import centres
    from rfgs_core.simulate.shadow.environment import environment_channel

    radio = replace(preset("wifi"), rx_rows=4, rx_cols=4, own_device_links="excluded")
    upright = [replace(device, quat_wxyz=(1.0, 0.0, 0.0, 0.0)) for device in two_devices]
    bundle, elements = make_bundle(), layout(radio, upright)
    paths = Environment(bundle, radio, elements, upright, seed=1).paths()
    ours = environment_channel(paths, radio, elements)[0, 16:]
    scene = environment_scene(bundle, radio)
    scene.rx_array = rt.PlanarArray(
        num_rows=4,
        num_cols=4,
        vertical_spacing=0.5,
        horizontal_spacing=0.5,
        pattern="iso",
        polarization="V",
    )
    tx, rx = centres(elements)
    scene.add(rt.Transmitter("tx", position=tx[0].tolist()))
    scene.add(rt.Receiver("rx", position=rx[1].tolist()))
    traced = rt.PathSolver(deterministic=True)(
        scene, max_depth=3, samples_per_src=300_000, synthetic_array=False, seed=1
    )
    real, imag = (np.array(part)[0, :, 0, 0] for part in traced.a)
    delay_s = np.array(traced.tau)[0, :, 0, 0].astype(np.float64)
    phase = np.exp(-2j * np.pi * np.maximum(delay_s, 0.0)[..., None] * radio.freq_hz)
    exact = ((real + 1j * imag)[..., None] * phase).sum(axis=1)
    exact = exact * (radio.centre_hz / radio.freq_hz)
    error_db = 10 * np.log10(np.sum(np.abs(ours - exact) ** 2) / np.sum(np.abs(exact) ** 2))
    assert error_db < -25.0


def test_empty_room_is_reciprocal(
    make_bundle: MakeBundle, small_radio: Radio, two_devices: list[DevicePose]
) -> None:
    from dataset_factory.trace import Tracer

    radio = replace(
        small_radio, rx_rows=1, rx_cols=1, tx_offset_m=(0.0, 0.0, 0.0), own_device_links="excluded"
    )
    csi = Tracer(make_bundle(), radio, two_devices, depth=1).static()
    assert np.abs(csi[0, 1] - csi[1, 0]).max() < 1e-4 * np.abs(csi).max()
    assert np.all(csi[0, 0] == 0) and np.all(csi[1, 1] == 0)


def test_bounding_boxes_agree_with_sionna(person_bundle: Bundle, small_radio: Radio) -> None:
    from dataset_factory.trace.rays.scene import environment_scene

    scene = environment_scene(person_bundle, small_radio)
    meshes = person_bundle.static_meshes()
    assert len(scene.objects) == len(meshes)
    for index, mesh in enumerate(meshes):
        box = scene.objects[f"static-{index}"].mi_mesh.bbox()
        assert np.array(box.min).ravel() == pytest.approx(mesh.vertices.min(axis=0))
        assert np.array(box.max).ravel() == pytest.approx(mesh.vertices.max(axis=0))


def test_material_outside_its_band_is_refused(
    make_bundle: MakeBundle, two_devices: list[DevicePose]
) -> None:
    from dataset_factory.trace import Tracer

    with pytest.raises(RfgsError, match=r"'brick'.*40 GHz.*'mmwave'"):
        Tracer(make_bundle(material="brick"), preset("mmwave"), two_devices)


def test_unknown_depth_is_refused(
    person_bundle: Bundle, small_radio: Radio, two_devices: list[DevicePose]
) -> None:
    from dataset_factory.trace import Tracer

    with pytest.raises(RfgsError, match="depth 4"):
        Tracer(person_bundle, small_radio, two_devices, depth=4)
