# SPDX-License-Identifier: Apache-2.0
"""Pose networks asked about the frames of a dataset, as rows of the table of limbs."""

from __future__ import annotations

import numpy as np
import torch
from jaxtyping import Float64
from torch import nn

from rfgs_core.dataset import Sequence
from rfgs_core.encode.body_maps import CENTRE_HEIGHT_M, Ranges, body_maps, views_of
from rfgs_core.evaluate.limbs import Person
from rfgs_core.limbs.stream import pairs_of
from rfgs_core.limbs.tokens import pack
from rfgs_core.pose_networks.cloud import cloud_of
from rfgs_core.pose_networks.learn import asked
from rfgs_core.pose_networks.picture import pictures
from rfgs_core.pose_networks.trial import ROWS, Trial
from rfgs_core.worlds.world import Place


def place_of(sequence: Sequence, radio: str) -> Place:
    """Extent and devices of a sequence, for rooms of the same layout."""
    bounds_m = np.array(sequence.bounds_m, dtype=np.float64)
    # Random rooms have their floor at zero.
    bounds_m[0, 2] = 0.0
    return Place(bounds_m.round(3), sequence.devices(radio))


def joints_of(trial: Trial, network: nn.Module, person: Person) -> dict[str, np.ndarray]:
    """Row of a trained network: joints of every frame, float64, shape (frame, 17, 3) [m].

    Args:
        trial: What was trained.
        network: The network.
        person: The one person, and what is seen of them; frames in the order of time.
    """
    ask = _by_points if trial.manner == "points" else _by_amplitudes
    return {ROWS[trial.manner]: ask(trial, network, person)}


def _by_points(
    trial: Trial, network: nn.Module, person: Person
) -> Float64[np.ndarray, "frame 17 3"]:
    """Joints around the place that radio found."""
    centres, packed = [], []
    for seen, (x, y) in zip(person.seen, person.axes_xy, strict=True):
        centre = np.array([x, y, float(seen.bounds_m[0, 2]) + CENTRE_HEIGHT_M])
        maps = body_maps(
            seen.delta, seen.layout, seen.links, seen.freq_hz, seen.subcarriers, centre
        )
        packed.append((views_of(seen.layout, seen.links), maps, centre))
        centres.append(centre)
    ranges = Ranges.of_band(person.seen[0].freq_hz)
    cloud = cloud_of(pack(packed, pairs_of(trial.radio)), ranges)
    said = asked(network, (cloud.points[None], cloud.there[None]))[0]
    return said.double().numpy() + np.array(centres)[:, None]


def _by_amplitudes(
    trial: Trial, network: nn.Module, person: Person
) -> Float64[np.ndarray, "frame 17 3"]:
    """Joints in the room; the place, too, is the network's own."""
    first = person.seen[0]
    csi = np.stack([seen.static + seen.delta for seen in person.seen])
    read = pictures(csi, first.static, first.layout)
    return asked(network, (torch.from_numpy(read),)).double().numpy()
