# SPDX-License-Identifier: Apache-2.0
"""From what device pairs hear around a body to where its joints are, and how surely."""

from __future__ import annotations

import torch
from jaxtyping import Float
from torch import Tensor, nn

from rfgs_core.encode.body_maps import AZIMUTHS, ELEVATIONS
from rfgs_core.limbs.tokens import GEOMETRY, Tokens
from rfgs_core.skeleton import JOINTS

#: Width of a token, heads, layers and hidden width of the transformer, and hidden width of the
#: last layers.
WIDTH, HEADS, LAYERS, HIDDEN, LAST = 128, 4, 3, 256, 256
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

    def __init__(self, ranges: int) -> None:
        super().__init__()
        self.ranges = ranges
        beams = len(ELEVATIONS) * len(AZIMUTHS)
        self.read = _convolution(beams, ranges) if ranges >= _MANY_RANGES else _dense(beams, ranges)
        self.place = nn.Sequential(nn.Linear(GEOMETRY, 96), nn.GELU(), nn.Linear(96, WIDTH))
        layer = nn.TransformerEncoderLayer(
            WIDTH, HEADS, HIDDEN, dropout=0.0, activation="gelu", batch_first=True, norm_first=True
        )
        self.mix = nn.TransformerEncoder(layer, LAYERS, enable_nested_tensor=False)
        self.query = nn.Parameter(torch.randn(1, 1, WIDTH) * 0.02)
        self.say = nn.Sequential(
            nn.LayerNorm(WIDTH), nn.Linear(WIDTH, LAST), nn.GELU(), nn.Linear(LAST, len(JOINTS) * 4)
        )

    def forward(
        self, seen: Tokens
    ) -> tuple[Float[Tensor, "frame 17 3"], Float[Tensor, "frame 17"]]:
        """Joints around the maps' centre, x towards the reference receiver [m], and log σ."""
        frames, pairs = seen.there.shape
        heard = self.read(seen.maps.flatten(0, 1)).reshape(frames, pairs, WIDTH)
        token = heard + self.place(seen.geometry)
        token = torch.cat([self.query.expand(frames, -1, -1), token], 1)
        silent = torch.cat([torch.zeros(frames, 1, dtype=torch.bool), ~seen.there], 1)
        mixed = self.mix(token, src_key_padding_mask=silent)[:, 0]
        said = self.say(mixed).reshape(frames, len(JOINTS), 4)
        return said[..., :3] * _SCALE_M, said[..., 3].clamp(_SURE, _UNSURE)


def _convolution(beams: int, ranges: int) -> nn.Sequential:
    """Reader of maps with many ranges."""
    quarter = (ranges + 3) // 4
    return nn.Sequential(
        nn.Conv1d(beams, 64, 5, stride=2, padding=2), nn.GELU(),
        nn.Conv1d(64, 80, 3, stride=2, padding=1), nn.GELU(),
        nn.Conv1d(80, 64, 3, padding=1), nn.GELU(),
        nn.Flatten(), nn.Linear(64 * quarter, WIDTH),
    )  # fmt: skip


def _dense(beams: int, ranges: int) -> nn.Sequential:
    """Reader of maps with few ranges."""
    return nn.Sequential(
        nn.Flatten(), nn.Linear(beams * ranges, 192), nn.GELU(),
        nn.Linear(192, WIDTH), nn.GELU(), nn.Linear(WIDTH, WIDTH),
    )  # fmt: skip
