# SPDX-License-Identifier: Apache-2.0
"""The channel of an ultra-wide band runs on smoothly where one frequency of its paths ends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from dataset_factory.scene.bundle import Bundle
from rfgs_core.radio import DevicePose, preset

MakeBundle = Callable[..., Bundle]


def test_channel_is_continuous_across_sub_bands(
    make_bundle: MakeBundle,
    two_devices: list[DevicePose],
    coarse_capsule: tuple[np.ndarray, np.ndarray],
) -> None:
    """Between fine subcarriers a smooth channel bends by (2π δf τ)²; a jump adds itself."""
    from dataset_factory.trace import Tracer
    from rfgs_core.simulate.shadow.environment import node_frequencies

    radio = replace(preset("uwb"), num_subcarriers=60_000, rx_cols=1, own_device_links="excluded")
    bundle = make_bundle(mover=coarse_capsule)
    csi = Tracer(bundle, radio, two_devices, depth=1).frame(bundle.frame(1))[0, 1]
    bend = np.abs(np.diff(csi.astype(np.complex128), n=2)) / np.abs(csi).max()
    borders = np.searchsorted(radio.freq_hz, node_frequencies(radio)[1:-1])
    assert len(borders) == 59
    at_border = np.zeros(len(bend), dtype=bool)
    for shift in (-3, -2, -1, 0):
        at_border[borders + shift] = True
    assert bend[at_border].max() < 1.2 * bend[~at_border].max() < 0.02


def test_subcarriers_are_those_of_narrow_bands_around_them(
    make_bundle: MakeBundle, two_devices: list[DevicePose]
) -> None:
    """Paths found at the band's edges and evaluated within are those found there anew.

    But for the weakest: rays choose by the material, at each frequency anew, what to go through.
    """
    from dataset_factory.trace import Tracer

    wide = replace(preset("uwb"), rx_cols=1, own_device_links="excluded")
    bundle = make_bundle()
    csi = Tracer(bundle, wide, two_devices, depth=1).static()[0, 1]
    for subcarrier in (3, 304, 604):
        spacing_hz = wide.subcarrier_spacing_hz
        narrow = replace(
            wide,
            freq_min_hz=float(wide.freq_hz[subcarrier]) - 1.5 * spacing_hz,
            freq_max_hz=float(wide.freq_hz[subcarrier]) + 1.5 * spacing_hz,
            num_subcarriers=3,
        )
        near = Tracer(bundle, narrow, two_devices, depth=1).static()[0, 1]
        error = csi[subcarrier - 1 : subcarrier + 2] - near
        error_db = 10 * np.log10((np.abs(error) ** 2).sum() / (np.abs(near) ** 2).sum())
        assert error_db < -30.0, (subcarrier, error_db)
