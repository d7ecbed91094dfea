# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dataset_factory.scene.bundle import Bundle
from dataset_factory.scene.movers import split_movers
from rfgs_core.radio import DevicePose, Radio, layout
from rfgs_core.radio.constants import SPEED_OF_LIGHT

Mesh = tuple[np.ndarray, np.ndarray]
MakeBundle = Callable[..., Bundle]

#: Prints a digest of frames, traced in the order given, of a bundle with a person and a vehicle.
DIGEST = """
import hashlib, sys
from pathlib import Path
from dataset_factory.trace.setup import prepare
prepare()
from dataclasses import replace
from dataset_factory.scene.bundle import read_bundle
from dataset_factory.trace import Tracer
from rfgs_core.radio import DevicePose, preset
bundle = read_bundle(Path(sys.argv[1]))
radio = replace(preset("wifi"), freq_min_hz=2.40e9, freq_max_hz=2.48e9, num_subcarriers=16,
                rx_rows=2, rx_cols=2, num_devices=2)
devices = [DevicePose("a", (0.4, 0.5, 1.2), (0.9238795, 0.0, 0.0, 0.3826834)),
           DevicePose("b", (3.5, 3.6, 2.1), (0.3826834, 0.0, 0.0, -0.9238795))]
tracer = Tracer(bundle, radio, devices, depth=2)
for frame in sys.argv[2:]:
    csi = tracer.frame(bundle.frame(int(frame))) if frame != "0" else tracer.static()
    print(frame, hashlib.sha256(csi.tobytes()).hexdigest())
"""


@pytest.fixture
def facing_devices() -> list[DevicePose]:
    """Two upright devices of the same height, both in front of the sheet."""
    upright = (1.0, 0.0, 0.0, 0.0)
    return [
        DevicePose("a", (1.0, 0.3, 1.4), upright),
        DevicePose("b", (3.0, 0.6, 1.4), upright),
    ]


@pytest.fixture
def steered_radio(small_radio: Radio) -> Radio:
    return replace(small_radio, own_device_links="excluded", tx_offset_m=(0.0, 0.0, 0.0))


def mirrored(radio: Radio, devices: list[DevicePose], plane_y: float) -> np.ndarray:
    """Reflection at a perfect mirror across y: −λ/(4πd) e^{−jkd} with the image's distance."""
    elements = layout(radio, devices)
    image = elements.tx_xyz * [1, -1, 1] + [0, 2 * plane_y, 0]
    distance_m = np.linalg.norm(image[:, None] - elements.rx_xyz[None], axis=2)[..., None]
    k = 2 * np.pi * radio.freq_hz / SPEED_OF_LIGHT
    field = -np.exp(-1j * k * distance_m) / (2 * k * distance_m)
    return np.where(elements.measured[..., None], field, 0.0)


def test_moving_plate_reflects_like_its_mirror_image(
    make_bundle: MakeBundle,
    steered_radio: Radio,
    facing_devices: list[DevicePose],
    steel_sheet: Mesh,
) -> None:
    from dataset_factory.trace import Tracer

    bundle = make_bundle(static=[], vehicle=steel_sheet)
    tracer = Tracer(bundle, steered_radio, facing_devices, depth=1)
    changes = []
    for number, plane_y in ((1, 2.1), (2, 1.8)):
        frame = bundle.frame(number)
        assert frame.vertices[:, 1] == pytest.approx(plane_y)
        found = tracer.frame(frame) - tracer.static()
        exact = mirrored(steered_radio, facing_devices, plane_y)
        # Steel of 10⁷ S/m is no perfect mirror: |1 + Γ| is 1e-3 here.
        assert np.abs(found - exact).max() < 5e-3 * np.abs(exact).max()
        changes.append(found)
    assert np.array_equal(tracer.frame(bundle.frame(1)) - tracer.static(), changes[0])


def test_vehicle_is_absent_from_the_static_channel(
    make_bundle: MakeBundle, steered_radio: Radio, facing_devices: list[DevicePose], steel_sheet
) -> None:
    from dataset_factory.trace import Tracer

    without = Tracer(make_bundle(), steered_radio, facing_devices, depth=1)
    bundle = make_bundle(vehicle=steel_sheet)
    driving = Tracer(bundle, steered_radio, facing_devices, depth=1)
    assert np.array_equal(driving.static(), without.static())
    assert not np.array_equal(driving.frame(bundle.frame(1)), without.static())


def test_person_behind_a_vehicle_is_hidden(
    make_bundle: MakeBundle,
    steered_radio: Radio,
    facing_devices: list[DevicePose],
    coarse_capsule: Mesh,
    steel_sheet: Mesh,
) -> None:
    from dataset_factory.trace import Tracer

    vertices, faces = steel_sheet
    for shift_m, hidden in ((-1.0, True), (1.0, False)):
        moved = (vertices + np.float32([0, shift_m, 0]), faces)
        both = make_bundle(static=[], mover=coarse_capsule, vehicle=moved)
        alone = make_bundle(static=[], vehicle=moved)
        # A hard shadow falls on the line of sight only, so what is left is what scatters.
        with_person, without = (
            Tracer(bundle, steered_radio, facing_devices, depth=1, shadow="hard").frame(
                bundle.frame(1)
            )
            for bundle in (both, alone)
        )
        assert np.array_equal(with_person, without) == hidden


def test_person_is_seen_by_way_of_a_vehicle(
    make_bundle: MakeBundle,
    steered_radio: Radio,
    facing_devices: list[DevicePose],
    coarse_capsule: Mesh,
    steel_sheet: Mesh,
) -> None:
    from dataset_factory.trace import Tracer

    # In free space the only wall that paths of depth 2 can touch is the vehicle.
    vertices, faces = steel_sheet
    moved = (vertices + np.float32([0, 1.0, 0]), faces)
    bundle = make_bundle(static=[], mover=coarse_capsule, vehicle=moved)
    single, double = (
        Tracer(bundle, steered_radio, facing_devices, depth=depth).frame(bundle.frame(2))
        for depth in (1, 2)
    )
    added = np.abs(double - single).max() / np.abs(single).max()
    assert 1e-4 < added < 0.3


def test_movers_are_told_apart(
    make_bundle: MakeBundle, coarse_capsule: Mesh, steel_sheet: Mesh
) -> None:
    bundle = make_bundle(mover=coarse_capsule, vehicle=steel_sheet)
    people, vehicles = split_movers(bundle)
    assert (len(people), len(vehicles)) == (len(coarse_capsule[1]), 2)
    frame = bundle.frame(1)
    assert np.array_equal(vehicles.posed(frame.vertices), frame.vertices[-4:])
    assert np.array_equal(people.posed(frame.vertices), frame.vertices[:-4])
    assert set(vehicles.material) == {2} and set(people.instance) == {1}


@pytest.mark.slow
def test_bytes_do_not_depend_on_the_process_or_the_order_of_frames(
    make_bundle: MakeBundle,
    python: Callable[..., subprocess.CompletedProcess[str]],
    coarse_capsule: Mesh,
    steel_sheet: Mesh,
    tmp_path: Path,
) -> None:
    vertices, faces = steel_sheet
    moved = (vertices + np.float32([0, 1.0, 0]), faces)
    bundle = make_bundle(mover=coarse_capsule, vehicle=moved)
    script = tmp_path / "digest.py"
    script.write_text(DIGEST)
    digests = [
        sorted(python(script, bundle.path, *order, must_work=True).stdout.splitlines())
        for order in (("0", "1", "2"), ("2", "1", "0"), ("2",))
    ]
    assert digests[0] == digests[1] and digests[2] == [digests[0][2]]
    assert len({line.split()[1] for line in digests[0]}) == 3
