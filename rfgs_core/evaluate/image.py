# SPDX-License-Identifier: Apache-2.0
"""Rendered beside true pictures. A display metric: colour is not in the radio.

Background pixels dominate a plain PSNR, so the empty room and a mean-colour silhouette are
baselines in every table, and `psnr_person` looks at the person alone.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from skimage.metrics import structural_similarity

from rfgs_core.radio.levels import decibels

#: Names of the image group in `metrics.json`.
IMAGE_KEYS = ("psnr", "psnr_person", "ssim", "lpips")
#: Colour around the person in `psnr_person`.
MID_GREY = 0.5
#: Largest PSNR that is reported [dB]; equal pictures have an infinite one.
PSNR_LIMIT_DB = 100.0
#: Backbone weights that the LPIPS package looks for in torch's hub cache.
LPIPS_WEIGHTS = "alexnet-owt-7be5be79.pth"


@dataclass(frozen=True)
class Picture:
    """A picture, and what moves in it on its own."""

    rgb: Float[np.ndarray, "h w 3"]
    """The whole picture, sRGB in [0, 1]."""
    person: Bool[np.ndarray, "h w"]
    """Pixels of what moves."""
    on_grey: Float[np.ndarray, "h w 3"]
    """What moves in front of mid-grey, sRGB in [0, 1]."""

    @staticmethod
    def cut(rgb: Float[np.ndarray, "h w 3"], person: Bool[np.ndarray, "h w"]) -> Picture:
        """A picture whose moving part is cut out with a mask."""
        return Picture(rgb, person, np.where(person[..., None], rgb, MID_GREY))


def psnr_db(true: Float[np.ndarray, "..."], predicted: Float[np.ndarray, "..."]) -> float:
    """Peak signal-to-noise ratio for values in [0, 1] [dB], at most 100.

    Example:
        >>> psnr_db(np.zeros(4), np.full(4, 0.1))
        20.0
    """
    error = float(np.mean((np.asarray(true, dtype=np.float64) - predicted) ** 2))
    return round(min(-float(decibels(error)), PSNR_LIMIT_DB), 6)


def psnr_person_db(true: Picture, predicted: Picture) -> float | None:
    """PSNR of what moves, on mid-grey, over the union of both masks.

    A missing or surplus limb counts as grey against colour. None if both masks are empty.
    """
    union = true.person | predicted.person
    if not union.any():
        return None
    return psnr_db(true.on_grey[union], predicted.on_grey[union])


def ssim(true: Float[np.ndarray, "h w 3"], predicted: Float[np.ndarray, "h w 3"]) -> float:
    """Structural similarity with the Gaussian window of Wang et al. 2004."""
    small = min(true.shape[:2])
    if small < 11:
        raise ValueError(f"expected pictures of at least 11 x 11 px, got {true.shape[:2]}")
    value: Any = structural_similarity(
        true, predicted, data_range=1.0, channel_axis=2, gaussian_weights=True, sigma=1.5
    )
    return float(value)


class Lpips:
    """The learned metric (Zhang et al. 2018), where its package and weights are present."""

    def __init__(self) -> None:
        self.reason = _why_no_lpips()
        self._network = None
        if not self.reason:
            import lpips  # pyright: ignore[reportMissingImports]

            self._network = lpips.LPIPS(net="alex", verbose=False).eval()

    def __call__(
        self, true: Float[np.ndarray, "h w 3"], predicted: Float[np.ndarray, "h w 3"]
    ) -> float | None:
        """Distance of two pictures, 0 for equal ones; None where it cannot be computed."""
        if self._network is None:
            return None
        import torch

        pair = [
            torch.from_numpy(np.asarray(rgb, dtype=np.float32)).permute(2, 0, 1)[None] * 2.0 - 1.0
            for rgb in (true, predicted)
        ]
        with torch.no_grad():
            return float(self._network(pair[0], pair[1]))


def _why_no_lpips() -> str:
    """Empty if LPIPS can run without a download, else why not."""
    if importlib.util.find_spec("lpips") is None:
        return "the package lpips is not installed"
    import torch

    cache = Path(torch.hub.get_dir()) / "checkpoints" / LPIPS_WEIGHTS
    if not cache.is_file():
        return f"{LPIPS_WEIGHTS} is not in torch's hub cache; nothing is downloaded here"
    return ""


def image_metrics(true: Picture, predicted: Picture, lpips: Lpips) -> dict[str, float | None]:
    """Image group of one picture."""
    return {
        "psnr": psnr_db(true.rgb, predicted.rgb),
        "psnr_person": psnr_person_db(true, predicted),
        "ssim": ssim(true.rgb, predicted.rgb),
        "lpips": lpips(true.rgb, predicted.rgb),
    }


def mean_person_colour(pictures: Sequence[Picture]) -> Float[np.ndarray, "3"]:
    """Mean colour of what moves over training pictures, mid-grey if it is never seen."""
    colours = [picture.rgb[picture.person] for picture in pictures if picture.person.any()]
    if not colours:
        return np.full(3, MID_GREY)
    return np.concatenate(colours).mean(axis=0)
