# SPDX-License-Identifier: Apache-2.0
"""What changes when faces, points, seeds, searches and interactions are refined."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np

from dataset_factory.scene.bundle import Bundle
from dataset_factory.verify.card import Group, Row, number, within
from dataset_factory.verify.closed_forms import error_db
from dataset_factory.verify.reciprocity import FURNISHED
from dataset_factory.verify.targets import ball_sections
from dataset_factory.verify.tracing import monostatic, single
from dataset_factory.verify.workshop import Workshop, devices_of
from rfgs_core.radio import layout, preset
from rfgs_core.radio.levels import decibels

#: Largest change of csi_static [dB of its power], and of a target's level [dB].
STATIC_DB, LEVEL_DB = -50.0, 0.3


def verify(workshop: Workshop) -> Group:
    """Traces the same scenes more finely."""
    bundle = workshop.bundle(FURNISHED)
    return Group(
        "convergence",
        "Convergence",
        "The furnished room and a ball of metal, traced again with something refined. Where "
        "spacing is halved, a band twice as high asks for it: the subcarriers compared are the "
        "same.",
        [*_static(workshop, bundle), *_targets(workshop), _depth(workshop, bundle)],
    )


def _static(workshop: Workshop, bundle: Bundle) -> list[Row]:
    """csi_static with other rays, and with the faces looked at three times as densely."""
    radio = single(preset("wifi"))
    devices = devices_of(bundle, radio)
    found, other = (workshop.traced(bundle, radio, devices, seed=seed).static() for seed in (0, 1))
    why = "docs/dataset.md, section 7"
    seed = within("csi_static, another seed", error_db(other, found), STATIC_DB, "dB", why)
    if workshop.tracer != "sionna":
        return [seed]
    from dataset_factory.trace.environment import Environment
    from rfgs_core.simulate.geometry import faces_of
    from rfgs_core.simulate.shadow.environment import environment_channel

    elements = layout(radio, devices)
    finer = partial(faces_of, max_faces=20_000, sample_m=0.1)
    environment = Environment(bundle, radio, elements, devices, seed=0, faces=finer)
    denser = environment_channel(environment.paths(), radio, elements)
    denser[~elements.measured] = 0.0
    return [
        seed,
        within(
            "csi_static, faces looked at 3 × as densely",
            error_db(denser, found),
            STATIC_DB,
            "dB",
            why,
        ),
    ]


def _targets(workshop: Workshop) -> list[Row]:
    """A ball's mean level with four times the faces, and with points at half the distance."""
    usual = monostatic(preset("wifi"), 8, own_device_links="only")
    # The same subcarriers and as many again above them, up to twice the frequency.
    count = math.ceil((2.0 * usual.freq_max_hz - usual.freq_min_hz) / usual.subcarrier_spacing_hz)
    top_hz = usual.freq_min_hz + count * usual.subcarrier_spacing_hz
    fine = replace(usual, num_subcarriers=count, freq_max_hz=top_hz)
    levels = [
        decibels(float(ball_sections(workshop, radio, cells).mean()))
        for radio, cells in ((usual, 5), (usual, 6), (fine, 5))
    ]
    faces, points = (abs(float(level - levels[0])) for level in levels[1:])
    return [
        within("ball, 4 × the faces, change of mean level", faces, LEVEL_DB, "dB", "itself"),
        within("ball, points at half the distance", points, LEVEL_DB, "dB", "itself"),
    ]


def _depth(workshop: Workshop, bundle: Bundle) -> Row:
    """What a third interaction changes of a person's part, beside what the second did."""
    radio = single(preset("wifi24"), num_subcarriers=16)
    devices, frame = devices_of(bundle, radio)[:2], bundle.frame(1)
    parts = []
    for depth in (1, 2, 3):
        tracer = workshop.traced(bundle, radio, devices, depth=depth, shadow="hard")
        parts.append(tracer.frame(frame).astype(np.complex128) - tracer.static())
    second, third = (error_db(a, b) for a, b in pairwise(parts))
    return Row(
        "a person's part, depth 2 to 3",
        f"< {number(second)} dB (1 to 2)",
        f"{number(third)} dB",
        third,
        second,
        "dB",
        "each further wall changes less (docs/dataset.md, section 8)",
    )
