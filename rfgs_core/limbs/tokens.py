# SPDX-License-Identifier: Apache-2.0
"""Maps and places of device pairs as a network reads them: one token per pair."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import torch
from jaxtyping import Bool, Float, Float32, UInt8
from torch import Tensor

from rfgs_core.encode.body_maps import AZIMUTHS, ELEVATIONS, View, distinct_places
from rfgs_core.skeleton import JOINTS

#: Step of a stored map [dB]: 255 is the peak of its pair.
_STEP_DB = 0.2
#: Power of a stored map that is told from nothing, over its pair's peak.
_LEAST = 1e-9
#: A map's values below its peak that are told from nothing, as log10 of power.
_FLOOR = 3.0
#: Numbers of a token beside its map: six vectors, four counts, cosine of the way on, level.
GEOMETRY = 6 * 3 + 4 + 1 + 1
#: Each joint's partner on the other side of the body.
MIRRORED = [
    JOINTS.index(name.replace("left", "?").replace("right", "left").replace("?", "right"))
    for name in JOINTS
]


class Packed(NamedTuple):
    """Frames as arrays, padded to the same number of pairs."""

    maps: UInt8[Tensor, "frame pair elevation azimuth range"]
    """Power below each pair's peak, in steps of 0.2 dB from 255 down."""
    level: Float32[Tensor, "frame pair"]
    """log10 of that peak."""
    vectors: Float32[Tensor, "frame pair 6 3"]
    """Transmitter, receiver, and y and z axes of either, seen from the maps' centre [m]."""
    counts: Float32[Tensor, "frame pair 4"]
    """log2 of the distinct places of elements along these axes."""
    there: Bool[Tensor, "frame pair"]
    """Which pairs are not padding."""


def pack(
    frames: Sequence[tuple[list[View], Float[np.ndarray, "pair e a r"], np.ndarray]], pairs: int
) -> Packed:
    """Packs (views, maps, centre) of some frames; `pairs` or more of each frame are left out."""
    count, shape = len(frames), frames[0][1].shape[1:]
    power = np.zeros((count, pairs, *shape), dtype=np.float32)
    vectors = np.zeros((count, pairs, 6, 3), dtype=np.float32)
    counts = np.zeros((count, pairs, 4), dtype=np.float32)
    there = np.zeros((count, pairs), dtype=bool)
    for i, (views, heard, centre) in enumerate(frames):
        for j, view in enumerate(views[:pairs]):
            power[i, j] = heard[j]
            vectors[i, j, :2] = view.tx.centre - centre, view.rx.centre - centre
            vectors[i, j, 2:4], vectors[i, j, 4:6] = view.tx.axes, view.rx.axes
            counts[i, j] = _places(view)
            there[i, j] = True
    return packed_power(*(torch.from_numpy(value) for value in (power, vectors, counts, there)))


def packed_power(
    power: Float32[Tensor, "frame pair elevation azimuth range"],
    vectors: Float32[Tensor, "frame pair 6 3"],
    counts: Float32[Tensor, "frame pair 4"],
    there: Bool[Tensor, "frame pair"],
) -> Packed:
    """Packs power [m⁴]; a pair that hears nothing is none. See `Packed`."""
    peak = power.amax((2, 3, 4))
    there = there & (peak > 0.0)
    peak = torch.where(there, peak, 1.0)
    below_db = 10.0 * torch.log10((power / peak[:, :, None, None, None]).clamp_min(_LEAST))
    maps = (255.5 + below_db / _STEP_DB).clamp(0.0, 255.0).to(torch.uint8)
    used = there[:, :, None]
    return Packed(
        maps * used[..., None, None], torch.log10(peak), vectors * used[..., None], counts * used,
        there,
    )  # fmt: skip


def _places(view: View) -> list[float]:
    """log2 of how many places the elements of either end have along y and z."""
    ends = (view.tx.offsets, view.rx.offsets)
    return [
        float(np.log2(distinct_places(offsets[:, axis]))) for offsets in ends for axis in (0, 1)
    ]


class Tokens(NamedTuple):
    """A batch as the network reads it."""

    maps: Float[Tensor, "frame pair beam range"]
    geometry: Float[Tensor, "frame pair number"]
    there: Bool[Tensor, "frame pair"]
    yaw: Float[Tensor, "frame"]
    """Direction that the frames' x axis was turned from [rad]."""


def relative_power(packed: Packed) -> Float[Tensor, "frame pair elevation azimuth range"]:
    """Power over each pair's peak."""
    below = (packed.maps.float() - 255.0) * (_STEP_DB / 10.0)
    return torch.pow(10.0, below)


def tokens(
    packed: Packed,
    power: Float[Tensor, "frame pair elevation azimuth range"],
    there: Bool[Tensor, "frame pair"],
    reference: Tensor,
    mirror: Bool[Tensor, "frame"],
) -> Tokens:
    """Frames seen along the line from the body to a reference pair's receiver.

    Args:
        packed: The frames.
        power: Power of their maps over each pair's peak.
        there: Pairs to use.
        reference: Pair whose receiver gives the x axis, of each frame.
        mirror: Frames to be seen in a mirror that swaps left and right.
    """
    vectors = packed.vectors
    rows = torch.arange(len(vectors), device=vectors.device)
    towards = vectors[rows, reference, 1]
    yaw = torch.atan2(towards[:, 1], towards[:, 0])
    turned = rotate(vectors, -yaw)
    side = torch.where(mirror, -1.0, 1.0)[:, None, None]
    x, y, z = turned.unbind(-1)
    turned = torch.stack([x, y * side, z], -1)
    # A mirrored array's own y points the other way: it is turned back, and its beams with it.
    turned = torch.cat(
        [turned[:, :, :2], turned[:, :, 2:3] * side[..., None], turned[:, :, 3:4],
         turned[:, :, 4:5] * side[..., None], turned[:, :, 5:]], 2,
    )  # fmt: skip
    power = torch.where(mirror[:, None, None, None, None], power.flip(3), power)
    peak = power.amax((2, 3, 4), keepdim=True).clamp_min(1e-9)
    maps = torch.log10(power / peak + 10.0**-_FLOOR) + 2.0
    level = packed.level + torch.log10(peak[..., 0, 0, 0])
    best = torch.where(there, level, torch.full_like(level, -torch.inf)).amax(1, keepdim=True)
    ends = torch.nn.functional.normalize(turned[:, :, :2], dim=-1)
    onward = -(ends[:, :, 0] * ends[:, :, 1]).sum(-1)
    scale = turned.new_tensor([0.4, 0.4, 1.0, 1.0, 1.0, 1.0])[:, None]
    geometry = torch.cat(
        [
            (turned * scale).flatten(2),
            packed.counts / 3.0,
            onward[..., None],
            (level - best).clamp(-4.0, 0.0)[..., None],
        ],
        -1,
    )
    used = there[..., None]
    beams = len(ELEVATIONS) * len(AZIMUTHS)
    flat = maps.reshape(*maps.shape[:2], beams, maps.shape[-1])
    return Tokens(flat * used[..., None], geometry * used, there, yaw)


def rotate(vectors: Float[Tensor, "frame *more 3"], angle: Float[Tensor, "frame"]) -> Tensor:
    """Vectors of each frame turned around the vertical."""
    shape = (len(angle), *(1,) * (vectors.dim() - 2))
    c, s = torch.cos(angle).reshape(shape), torch.sin(angle).reshape(shape)
    x, y, z = vectors.unbind(-1)
    return torch.stack([c * x - s * y, s * x + c * y, z], -1)


def mirrored_joints(joints: Float[Tensor, "frame 17 3"], mirror: Tensor) -> Tensor:
    """Joints of the mirrored frames: sides and the sign of y swapped."""
    swapped = joints[:, MIRRORED] * joints.new_tensor([1.0, -1.0, 1.0])
    return torch.where(mirror[:, None, None], swapped, joints)
