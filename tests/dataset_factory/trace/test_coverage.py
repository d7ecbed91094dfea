# SPDX-License-Identifier: Apache-2.0
"""Radio maps of a bundle beside Friis, and what is refused."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from dataset_factory.scene.bundle import Bundle
from dataset_factory.trace.coverage import trace_coverage
from rfgs_core.errors import RfgsError

MakeBundle = Callable[..., Bundle]
C_M_PER_S = 299_792_458.0


def test_the_line_of_sight_falls_as_friis_says(make_bundle: MakeBundle, tmp_path: Path) -> None:
    bundle = make_bundle()
    found = trace_coverage(bundle.path, "wifi", height_m=1.0, cell_m=0.25, depth=0)
    places = _centres(found.gain_db.shape[1:], found.corner_m, found.cell_m)
    assert len(found.devices) == len(found.gain_db) == 4
    from dataset_factory.trace import sionna_scene

    senders = sionna_scene(bundle.path, "wifi").transmitters.values()
    for gain_db, sender in zip(found.gain_db, senders, strict=True):
        range_m = np.linalg.norm(places - np.array(sender.position).ravel(), axis=-1)
        friis_db = 20.0 * np.log10(C_M_PER_S / found.carrier_hz / (4.0 * np.pi * range_m))
        # A cell takes the mean over itself: near the antenna that is no longer its middle; at the
        # walls it is cut, and rays are random.
        far = (range_m > 1.0) & (gain_db > -200.0)
        assert far.sum() > 50
        error_db = np.abs((gain_db - friis_db)[far])
        assert np.median(error_db) < 0.3 and np.quantile(error_db, 0.9) < 1.5
    found.write(tmp_path / "map.json")
    stored = json.loads((tmp_path / "map.json").read_text())
    np.testing.assert_allclose(stored["gain_db"], found.gain_db, atol=0.006)
    assert stored["devices"] == found.devices


def _centres(
    shape: tuple[int, ...], corner_m: tuple[float, float, float], cell_m: float
) -> np.ndarray:
    y, x = (corner_m[1 - axis] + (np.arange(n) + 0.5) * cell_m for axis, n in enumerate(shape))
    flat = np.stack(np.meshgrid(x, y), axis=-1)
    return np.concatenate([flat, np.full((*flat.shape[:2], 1), corner_m[2])], axis=-1)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"height_m": 40.0}, "height: expected within"),
        ({"cell_m": 1e-5}, "cell: expected at most"),
        ({"cell_m": 0.0}, "cell: expected at most"),
        ({"frame": 99}, "no frame 99"),
    ],
)
def test_what_cannot_be_drawn_is_refused(make_bundle: MakeBundle, settings, said) -> None:
    with pytest.raises(RfgsError, match=said):
        trace_coverage(make_bundle().path, "wifi", **settings)
