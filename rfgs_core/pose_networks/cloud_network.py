# SPDX-License-Identifier: Apache-2.0
"""Joints from sparse points over frames, in the manner of mmMesh (Xue et al., MobiSys 2021).

As published: a perceptron that all points share, pooled by attention, and a recurrent network over
frames tell where the body is; anchors on a grid around that place gather the points near each, are
pooled the same way, read together as voxels and followed by a second recurrent network. What
differs: all radars' points are one cloud, velocity is no part of a point, half of what is pooled
is a maximum, as in PointNet, which learns in fewer steps, and joints are told
directly where the paper goes by SMPL, which may not be passed on.
"""

from __future__ import annotations

import torch
from jaxtyping import Bool, Float
from torch import Tensor, nn

from rfgs_core.errors import RfgsError
from rfgs_core.pose_networks.cloud import FEATURES
from rfgs_core.skeleton import JOINTS

#: Anchors along x and y, and along z, from the place told [m].
_ACROSS_M, _UP_M = (-0.3, 0.0, 0.3), tuple(-0.8 + 0.2 * k for k in range(9))
#: Points that an anchor gathers.
_NEAREST = 8
#: Widths of the shared perceptrons, of what frames are told by, and of the recurrent networks.
_POINT, _ANCHOR, _MEMORY = (32, 48, 64), (32, 48, 64), 96
#: Points are read larger by this, so that a decimetre counts.
_SHARPER = 4.0
#: Scale of what the network says [m].
_SCALE_M = 0.3


class CloudNetwork(nn.Module):
    """Points of consecutive frames to joints; what comes later changes nothing before."""

    def __init__(self) -> None:
        super().__init__()
        grid = torch.cartesian_prod(*(torch.tensor(part) for part in (_UP_M, _ACROSS_M, _ACROSS_M)))
        self.anchors: Tensor
        # z runs slowest, so that anchors are voxels of shape (9, 3, 3).
        self.register_buffer("anchors", grid[:, [1, 2, 0]].float(), persistent=False)
        self.whole = _Pooled(FEATURES, _POINT)
        self.follow = nn.LSTM(_POINT[-1], _MEMORY, batch_first=True)
        self.place = nn.Linear(_MEMORY, 3)
        self.near = _Pooled(FEATURES + 3, _ANCHOR)
        self.voxels = nn.Sequential(
            nn.Conv3d(_ANCHOR[-1], 64, (3, 3, 3), padding=(0, 1, 1)), nn.ReLU(),
            nn.Conv3d(64, 96, (3, 3, 3)), nn.ReLU(),
            nn.Flatten(), nn.Linear(96 * 5, _MEMORY),
        )  # fmt: skip
        self.follow_near = nn.LSTM(_MEMORY, _MEMORY, batch_first=True)
        self.say = nn.Sequential(
            nn.Linear(2 * _MEMORY, 256), nn.ReLU(), nn.Linear(256, len(JOINTS) * 3)
        )

    def forward(
        self,
        points: Float[Tensor, "clip frame point 5"],
        there: Bool[Tensor, "clip frame point"],
    ) -> Float[Tensor, "clip frame 17 3"]:
        """Joints around the maps' centre of each frame [m].

        Args:
            points: Of consecutive frames, as `cloud_of` makes them.
            there: Which are not padding.

        Raises:
            RfgsError: Points are not what `cloud_of` makes.
        """
        if points.dim() != 4 or points.shape[-1] != FEATURES or there.shape != points.shape[:3]:
            raise RfgsError(
                f"points of shape {tuple(points.shape)}, known of {tuple(there.shape)}: expected "
                f"(clip, frame, point, {FEATURES}) and (clip, frame, point)"
            )
        clips, frames = points.shape[:2]
        flat, known = points.flatten(0, 1), there.flatten(0, 1)
        whole = self.follow(self.whole(flat, known).unflatten(0, (clips, frames)))[0]
        place = self.place(whole) * _SCALE_M
        gathered = self._gathered(flat, known, place.flatten(0, 1))
        near = self.follow_near(gathered.unflatten(0, (clips, frames)))[0]
        said = self.say(torch.cat([whole, near], -1)) * _SCALE_M
        return said.unflatten(-1, (len(JOINTS), 3)) + place[..., None, :]

    def _gathered(
        self,
        points: Float[Tensor, "frame point 5"],
        there: Bool[Tensor, "frame point"],
        place: Float[Tensor, "frame 3"],
    ) -> Float[Tensor, "frame number"]:
        """What the anchors around a place gather of each frame."""
        anchors = self.anchors + place.detach()[:, None]
        with torch.no_grad():
            away = torch.cdist(anchors, points[..., :3])
            away = away.masked_fill(~there[:, None], torch.inf)
            nearest = away.topk(min(_NEAREST, points.shape[1]), largest=False)
        rows = torch.arange(len(points), device=points.device)[:, None, None]
        mine, known = points[rows, nearest.indices], torch.isfinite(nearest.values)
        beside = mine[..., :3] - anchors[:, :, None]
        pooled = self.near(torch.cat([mine, beside], -1).flatten(0, 1), known.flatten(0, 1))
        shape = (len(points), len(_UP_M), len(_ACROSS_M), len(_ACROSS_M), _ANCHOR[-1])
        return self.voxels(pooled.reshape(shape).movedim(-1, 1))


class _Pooled(nn.Module):
    """A perceptron that points share, pooled; zero without points."""

    def __init__(self, numbers: int, widths: tuple[int, ...]) -> None:
        super().__init__()
        layers: list[nn.Module] = []
        for before, after in zip((numbers, *widths), widths, strict=False):
            layers += [nn.Linear(before, after), nn.LayerNorm(after), nn.ReLU()]
        self.layers = nn.Sequential(*layers)
        self.weigh = nn.Linear(widths[-1], 1)

    def forward(
        self, points: Float[Tensor, "set point number"], there: Bool[Tensor, "set point"]
    ) -> Float[Tensor, "set width"]:
        """One vector of each set, whatever the order of its points.

        Half of it is the sum weighed by attention, half the largest of each number.
        """
        read = self.layers(points * _SHARPER)
        weight = self.weigh(read)[..., 0].masked_fill(~there, -1e9).softmax(-1)
        summed, largest = read.chunk(2, dim=-1)
        summed = ((weight * there)[..., None] * summed).sum(-2)
        # What the perceptron says is never negative.
        return torch.cat([summed, (largest * there[..., None]).amax(-2)], -1)
