# SPDX-License-Identifier: Apache-2.0
"""From what device pairs hear around a body to where its joints are, and how surely."""

from __future__ import annotations

from typing import Literal, NamedTuple

import torch
from jaxtyping import Float
from torch import Tensor, nn

from rfgs_core.encode.body_maps import AZIMUTHS, ELEVATIONS
from rfgs_core.limbs.tokens import GEOMETRY, Tokens
from rfgs_core.skeleton import JOINTS

#: small: what two cores train in hours; large: five times that, for millions of frames on a GPU.
Size = Literal["small", "large"]


class _Widths(NamedTuple):
    token: int
    heads: int
    layers: int
    hidden: int
    """Hidden width of the transformer."""
    last: int
    """Hidden width of the last layers."""
    channels: tuple[int, int]
    """Channels of the first and last convolution, and of the middle one."""


_SIZES: dict[Size, _Widths] = {
    "small": _Widths(128, 4, 3, 256, 256, (64, 80)),
    "large": _Widths(256, 8, 4, 512, 512, (96, 128)),
}
#: Maps of at least this many ranges are read by convolution along the range.
_MANY_RANGES = 16
#: Scale of what the network says [m].
_SCALE_M = 0.3
#: Bounds of log σ: 3 mm and 1 m.
_SURE, _UNSURE = -5.8, 0.0


class LimbNetwork(nn.Module):
    """An encoder shared by all device pairs, and a transformer over them.

    Pairs are a set: any number of them, in any order, from any place.
    """

    def __init__(self, ranges: int, size: Size = "small") -> None:
        super().__init__()
        self.ranges, self.size = ranges, size
        widths = _SIZES[size]
        token, last = widths.token, widths.last
        reader = _convolution if ranges >= _MANY_RANGES else _dense
        self.read = reader(len(ELEVATIONS) * len(AZIMUTHS), ranges, widths)
        self.place = nn.Sequential(nn.Linear(GEOMETRY, 96), nn.GELU(), nn.Linear(96, token))
        layer = nn.TransformerEncoderLayer(
            token, widths.heads, widths.hidden,
            dropout=0.0, activation="gelu", batch_first=True, norm_first=True,
        )  # fmt: skip
        self.mix = nn.TransformerEncoder(layer, widths.layers, enable_nested_tensor=False)
        self.query = nn.Parameter(torch.randn(1, 1, token) * 0.02)
        self.say = nn.Sequential(
            nn.LayerNorm(token), nn.Linear(token, last), nn.GELU(), nn.Linear(last, len(JOINTS) * 4)
        )

    def forward(
        self, seen: Tokens
    ) -> tuple[Float[Tensor, "frame 17 3"], Float[Tensor, "frame 17"]]:
        """Joints around the maps' centre, x towards the reference receiver [m], and log σ."""
        frames, pairs = seen.there.shape
        heard = self.read(seen.maps.flatten(0, 1)).unflatten(0, (frames, pairs))
        token = heard + self.place(seen.geometry)
        token = torch.cat([self.query.expand(frames, -1, -1), token], 1)
        silent = torch.cat([torch.zeros_like(seen.there[:, :1]), ~seen.there], 1)
        mixed = self.mix(token, src_key_padding_mask=silent)[:, 0]
        said = self.say(mixed).reshape(frames, len(JOINTS), 4)
        return said[..., :3] * _SCALE_M, said[..., 3].clamp(_SURE, _UNSURE)


def _convolution(beams: int, ranges: int, widths: _Widths) -> nn.Sequential:
    """Reader of maps with many ranges."""
    quarter = (ranges + 3) // 4
    outer, inner = widths.channels
    return nn.Sequential(
        nn.Conv1d(beams, outer, 5, stride=2, padding=2), nn.GELU(),
        nn.Conv1d(outer, inner, 3, stride=2, padding=1), nn.GELU(),
        nn.Conv1d(inner, outer, 3, padding=1), nn.GELU(),
        nn.Flatten(), nn.Linear(outer * quarter, widths.token),
    )  # fmt: skip


def _dense(beams: int, ranges: int, widths: _Widths) -> nn.Sequential:
    """Reader of maps with few ranges."""
    hidden, token = 3 * widths.channels[0], widths.token
    return nn.Sequential(
        nn.Flatten(), nn.Linear(beams * ranges, hidden), nn.GELU(),
        nn.Linear(hidden, token), nn.GELU(), nn.Linear(token, token),
    )  # fmt: skip
