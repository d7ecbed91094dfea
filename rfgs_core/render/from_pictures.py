# SPDX-License-Identifier: Apache-2.0
"""Gaussians fitted to pictures of what moves, without any radio: what cameras would tell.

As Kerbl et al. 2023, "3D Gaussian Splatting for Real-Time Radiance Field Rendering", but started
inside the visual hull (Laurentini 1994), the space that projects into every silhouette, instead of
at points matched between pictures: of one instant there are only a few pictures, and the person
is a tenth of each.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float, Float32, Float64
from torch import Tensor

from rfgs_core.adam import Adam
from rfgs_core.errors import RfgsError
from rfgs_core.gaussians.model import FEATURE_DIM, Gaussians
from rfgs_core.render.cameras import Camera
from rfgs_core.render.rasterizer import splat
from rfgs_core.render.shader import MID_GREY
from rfgs_core.threads import one_torch_thread

#: Edge of the cells of the visual hull [m].
_CELL_M = 0.025
#: Silhouettes that a cell must be seen in: a single one bounds no depth.
_FEWEST_SILHOUETTES = 2
#: Opacity of every Gaussian at the start.
_OPACITY = 0.5
#: Steps of Adam: metres, quaternions, log-scales, logits of opacities and of colours.
_RATES = {
    "means": 2e-3,
    "quats": 1e-2,
    "log_scales": 1e-2,
    "logit_opacities": 5e-2,
    "colours": 5e-2,
}


@dataclass(frozen=True)
class PersonView:
    """A picture of what moves, cut out."""

    camera: Camera
    """The camera."""
    picture: Float32[np.ndarray, "H W 3"]
    """What moves in front of mid-grey, sRGB in [0, 1]."""
    mask: Bool[np.ndarray, "H W"]
    """Where it is."""


@dataclass(frozen=True)
class ColouredGaussians:
    """Gaussians whose colours are their own, without radio features."""

    gaussians: Gaussians
    """M Gaussians; features are zero."""
    rgb: Float[Tensor, "M 3"]
    """Colours, sRGB in (0, 1)."""


def visual_hull(
    views: Sequence[PersonView], bounds_m: Float[np.ndarray, "2 3"]
) -> Float64[np.ndarray, "N 3"]:
    """Centres of the cells that every camera which has them in its picture sees in its silhouette.

    Args:
        views: Pictures of one instant.
        bounds_m: Lower and upper corner of the space that is looked through [m].

    Returns:
        Centres [m], none where fewer than two silhouettes hold them.
    """
    low, high = np.asarray(bounds_m, dtype=np.float64)
    axes = [np.arange(low[i] + 0.5 * _CELL_M, high[i], _CELL_M) for i in range(3)]
    cells = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    held = np.zeros(len(cells), dtype=np.int64)
    for view in views:
        pixels, depth = view.camera.project(cells)
        height, width = view.mask.shape
        in_front = depth > 0.0
        column, row = np.floor(np.where(in_front[:, None], pixels, -1.0)).T.astype(np.int64)
        seen = in_front & (column >= 0) & (column < width) & (row >= 0) & (row < height)
        inside = np.zeros(len(cells), dtype=bool)
        inside[seen] = view.mask[row[seen], column[seen]]
        kept = inside | ~seen
        cells, held = cells[kept], (held + inside)[kept]
    return cells[held >= _FEWEST_SILHOUETTES]


def fit_pictures(
    views: Sequence[PersonView],
    bounds_m: Float[np.ndarray, "2 3"],
    *,
    count: int = 6000,
    steps: int = 200,
    seed: int = 0,
    on_step: Callable[[float], None] | None = None,
) -> ColouredGaussians:
    """Fits place, shape, opacity and colour of Gaussians to pictures of one instant.

    Args:
        views: Pictures of one instant; one of them in each step, in turn.
        bounds_m: Lower and upper corner of the space where somebody may be [m].
        count: Gaussians.
        steps: Steps of Adam.
        seed: Seed of the places at the start.
        on_step: Called with the loss of every step.

    Returns:
        The Gaussians, detached.

    Raises:
        RfgsError: No place projects into the silhouettes.
    """
    hull = visual_hull(views, bounds_m)
    if not len(hull):
        raise RfgsError(
            f"{len(views)} pictures: no place lies in the silhouettes of two cameras or more, "
            "so that Gaussians have nowhere to start"
        )
    with one_torch_thread():
        return _fit(views, hull, count, steps, seed, on_step)


def _fit(
    views: Sequence[PersonView],
    hull: Float64[np.ndarray, "N 3"],
    count: int,
    steps: int,
    seed: int,
    on_step: Callable[[float], None] | None,
) -> ColouredGaussians:
    leaves = _start(hull, count, seed)
    features = torch.zeros(count, FEATURE_DIM)
    optimizer = Adam({leaf: _RATES[name] for name, leaf in leaves.items()})
    for step in range(steps):
        view = views[step % len(views)]
        optimizer.zero_grad()
        found = _coloured(leaves, features)
        drawn = splat(found.gaussians, found.rgb, view.camera)
        mask = torch.from_numpy(view.mask.astype(np.float32))
        colours = (drawn.over(MID_GREY) - torch.from_numpy(view.picture)).square().mean()
        # Grey Gaussians in front of grey cost nothing, but are nowhere.
        loss = colours + (drawn.alpha - mask).square().mean()
        loss.backward()
        optimizer.step()
        if on_step is not None:
            on_step(float(loss.detach()))
    found = _coloured({name: leaf.detach() for name, leaf in leaves.items()}, features)
    return ColouredGaussians(found.gaussians, found.rgb)


def _start(hull: Float64[np.ndarray, "N 3"], count: int, seed: int) -> dict[str, Tensor]:
    """Grey Gaussians, half opaque, at places within the hull, as wide as they lie apart."""
    rng = np.random.default_rng(seed)
    places = hull[rng.integers(len(hull), size=count)]
    places = places + _CELL_M * (rng.random(places.shape) - 0.5)
    apart_m = (len(hull) * _CELL_M**3 / count) ** (1.0 / 3.0)
    quats = torch.zeros(count, 4)
    quats[:, 0] = 1.0
    start = {
        "means": torch.from_numpy(places).float(),
        "quats": quats,
        "log_scales": torch.full((count, 3), float(np.log(0.5 * apart_m))),
        "logit_opacities": torch.full((count,), float(np.log(_OPACITY / (1.0 - _OPACITY)))),
        "colours": torch.zeros(count, 3),
    }
    return {name: part.requires_grad_() for name, part in start.items()}


def _coloured(leaves: dict[str, Tensor], features: Float[Tensor, "M 32"]) -> ColouredGaussians:
    shape = {name: leaf for name, leaf in leaves.items() if name != "colours"}
    return ColouredGaussians(
        Gaussians(**shape, features=features), torch.sigmoid(leaves["colours"])
    )
