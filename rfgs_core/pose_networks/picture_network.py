# SPDX-License-Identifier: Apache-2.0
"""Joints from amplitudes and phases, in the manner of Person-in-WiFi 3D (Yan et al., CVPR 2024).

As published: parts of the channel are tokens with embeddings of their own, a transformer mixes
them, and queries attend to what comes out and say joints in the room's coordinates. Each
embedding stands for one antenna row of one device pair, so the network is bound to the layout it
was trained with. What differs: one person, so that one query per joint takes the place of matched
pose queries; one packet per frame; the empty room's channel is taken off (see `picture`).
"""

from __future__ import annotations

import torch
from jaxtyping import Float
from torch import Tensor, nn

from rfgs_core.errors import RfgsError
from rfgs_core.pose_networks.lessons import Lessons
from rfgs_core.skeleton import JOINTS

#: Width of a token, heads, width between layers, and layers before and after the queries.
_TOKEN, _HEADS, _HIDDEN, _ENCODER, _DECODER = 128, 4, 256, 3, 2
_DROPOUT = 0.1
#: Scales of what the network says: of the place in the room, and of joints around it [m].
_PLACE_M, _SCALE_M = 1.0, 0.3


class PictureNetwork(nn.Module):
    """Tokens of one layout's channel to joints in the room."""

    def __init__(self, tokens: int, numbers: int) -> None:
        super().__init__()
        self.size: Tensor
        self.middle: Tensor
        self.register_buffer("size", torch.ones(tokens))
        self.register_buffer("middle", torch.zeros(len(JOINTS), 3))
        self.read = nn.Sequential(nn.Linear(numbers, _TOKEN), nn.ReLU(), nn.Linear(_TOKEN, _TOKEN))
        self.where = nn.Parameter(torch.randn(tokens, _TOKEN) * 0.1)
        shape = {"dropout": _DROPOUT, "batch_first": True, "norm_first": True}
        layer = nn.TransformerEncoderLayer(_TOKEN, _HEADS, _HIDDEN, **shape)
        self.mix = nn.TransformerEncoder(layer, _ENCODER, enable_nested_tensor=False)
        self.joints = nn.Parameter(torch.randn(1 + len(JOINTS), _TOKEN) * 0.1)
        layer = nn.TransformerDecoderLayer(_TOKEN, _HEADS, _HIDDEN, **shape)
        self.attend = nn.TransformerDecoder(layer, _DECODER)
        last = nn.Linear(_TOKEN, 3)
        # It begins with the mean pose.
        nn.init.zeros_(last.weight)
        nn.init.zeros_(last.bias)
        self.say = nn.Sequential(nn.LayerNorm(_TOKEN), last)

    @staticmethod
    def fitting(known: Lessons) -> PictureNetwork:
        """A network for the layout of some examples, which begins with their mean pose."""
        pictures = known.inputs[0]
        network = PictureNetwork(*pictures.shape[1:])
        network.size = pictures.float().square().mean(dim=(0, 2)).sqrt().clamp_min(1e-12)
        network.middle = known.joints.mean(dim=0)
        return network

    def forward(self, pictures: Float[Tensor, "frame token number"]) -> Float[Tensor, "frame 17 3"]:
        """Joints in the room's coordinates [m].

        Args:
            pictures: As `picture.pictures` makes them.

        Raises:
            RfgsError: They are of another layout.
        """
        expected = (len(self.where), self.read[0].in_features)
        if pictures.dim() != 3 or pictures.shape[1:] != expected:
            raise RfgsError(
                f"a channel as {tuple(pictures.shape[1:])} tokens and numbers: expected "
                f"{expected}; this network serves the one layout it was trained with"
            )
        heard = torch.asinh(pictures.float() / self.size[:, None])
        mixed = self.mix(self.read(heard) + self.where)
        said = self.say(self.attend(self.joints.expand(len(mixed), -1, -1), mixed))
        return self.middle + said[:, :1] * _PLACE_M + said[:, 1:] * _SCALE_M
