# SPDX-License-Identifier: Apache-2.0
"""Sparse points of a plain beam map, as radars with a point cloud report them.

Static clutter is gone (maps are those of the change), each beam's peaks along the range are kept,
and of these the strongest of every device pair. A cell of direction u from the receiver r and path
length L lies where the ray meets the ellipsoid of the path,

    p = r + s u,   s = (L² − |t − r|²) / (2 (L − (t − r)·u)),

which for a radar whose ends stand together is L/2 along the beam. Velocity is no part of a point:
frames of our radios are one packet each.
"""

from __future__ import annotations

from typing import NamedTuple

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from rfgs_core.encode.body_maps import AZIMUTHS, ELEVATIONS, Ranges
from rfgs_core.errors import RfgsError
from rfgs_core.limbs.tokens import Packed, relative_power

#: Points of every device pair.
PER_PAIR = 32
#: Numbers of a point: place, half the path, power.
FEATURES = 5
#: Scales of half a path [m], and of a point's power below the strongest [dB].
_RANGE_M, _POWER_DB = 5.0, 20.0
#: Weaker than this below the strongest is nothing [dB].
_FAINTEST_DB = 30.0


class Cloud(NamedTuple):
    """Points of some frames, padded to the same number."""

    points: Float[Tensor, "*frame point 5"]
    """Place around the maps' centre [m]; half the path [5 m]; power below the frame's strongest
    [20 dB], none of it positive."""
    there: Bool[Tensor, "*frame point"]
    """Which are not padding."""


def cloud_of(packed: Packed, ranges: Ranges, per_pair: int = PER_PAIR) -> Cloud:
    """The points of packed maps.

    Args:
        packed: Frames, as the network of limbs reads them.
        ranges: Path lengths of the maps.
        per_pair: Points of each device pair.

    Raises:
        RfgsError: The maps have another number of ranges.
    """
    frames = len(packed.there)
    if packed.maps.shape[-1] != ranges.count:
        raise RfgsError(
            f"maps of {packed.maps.shape[-1]} ranges: expected {ranges.count}, those of the band"
        )
    below_db = 10.0 * torch.log10(relative_power(packed))
    peaks = torch.nn.functional.max_pool1d(below_db.flatten(0, 3)[:, None], 3, 1, 1)[:, 0]
    is_peak = below_db >= peaks.reshape(below_db.shape)
    places, half_m, seen = _places(packed, ranges)
    level = 10.0 * packed.level
    best = torch.where(packed.there, level, torch.full_like(level, -torch.inf)).amax(1)
    power = below_db + (level - best[:, None])[..., None, None, None]
    usable = is_peak & seen & packed.there[..., None, None, None] & (power > -_FAINTEST_DB)
    ranked = torch.where(usable, power, torch.full_like(power, -torch.inf)).flatten(2)
    found, cell = ranked.topk(min(per_pair, ranked.shape[-1]), dim=-1)
    there = torch.isfinite(found)
    chosen = torch.cat(
        [
            places.flatten(2, 4).gather(2, cell[..., None].expand(-1, -1, -1, 3)),
            half_m.flatten(2).gather(2, cell)[..., None] / _RANGE_M,
            torch.where(there, found, torch.zeros_like(found))[..., None] / _POWER_DB,
        ],
        -1,
    )
    points = chosen * there[..., None]
    return Cloud(points.reshape(frames, -1, FEATURES), there.reshape(frames, -1))


def _places(
    packed: Packed, ranges: Ranges
) -> tuple[
    Float[Tensor, "frame pair elevation azimuth range 3"],
    Float[Tensor, "frame pair elevation azimuth range"],
    Bool[Tensor, "frame pair elevation azimuth range"],
]:
    """Where each cell lies around the centre, half its path [m], and whether it lies anywhere."""
    tx, rx = packed.vectors[:, :, 0], packed.vectors[:, :, 1]
    across, up = packed.vectors[:, :, 4], packed.vectors[:, :, 5]
    ahead = torch.linalg.cross(across, up)
    towards = torch.nn.functional.normalize(-rx, dim=-1)
    y = (across * towards).sum(-1)[..., None, None] + tx.new_tensor(AZIMUTHS)[None, None, None]
    z = (up * towards).sum(-1)[..., None, None] + tx.new_tensor(ELEVATIONS)[None, None, :, None]
    square = 1.0 - y**2 - z**2
    # Arrays hear the half space in which the body is.
    x = torch.sign((ahead * towards).sum(-1))[..., None, None] * square.clamp_min(0.0).sqrt()
    beam = (
        x[..., None] * ahead[:, :, None, None]
        + y[..., None] * across[:, :, None, None]
        + z[..., None] * up[:, :, None, None]
    )
    path_m = (tx.norm(dim=-1) + rx.norm(dim=-1))[..., None] + tx.new_tensor(ranges.offsets_m)
    apart = (tx - rx)[:, :, None, None]
    aside_m = (apart * beam).sum(-1)[..., None]
    long = path_m[:, :, None, None]
    width_m = apart.norm(dim=-1)[..., None]
    reach_m = (long**2 - width_m**2) / (2.0 * (long - aside_m)).clamp_min(1e-6)
    places = rx[:, :, None, None, None] + reach_m[..., None] * beam[..., None, :]
    half_m = (0.5 * long).expand(reach_m.shape)
    return places, half_m, (square[..., None] > 0.0) & (long > width_m)
