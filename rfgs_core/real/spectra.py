# SPDX-License-Identifier: Apache-2.0
"""Spectra in NeRF2's layout: pictures at places of the transmitter that were never seen.

The split that comes with such a folder is random, and its nearest neighbour is a few centimetres
away. Here whole blocks of the room are held out. Ours is kriging: each pixel of the amplitude is
the training pictures' mean and a Gaussian process over the transmitter's place, whose length is
that of the largest likelihood, one for all pixels.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Float

from rfgs_core.capture.nerf2 import AZIMUTHS, ELEVATIONS, read
from rfgs_core.errors import RfgsFormatError
from rfgs_core.real.bedroom import CELLS, folds

#: Lengths that are tried, as shares of the room's extent, and noise over signal.
_LENGTHS, _NOISE = (0.02, 0.05, 0.1, 0.2, 0.4), 0.05
_FEWEST = 20


def judge_spectra(path: Path) -> dict[str, float | str]:
    """SSIM of held-out pictures, mean over five folds of blocks.

    Returns:
        `mean_picture_ssim`, `nearest_ssim` and `ours_ssim`; the folder's own random split by
        nearest neighbour stands beside them, as `nearest_random_ssim`.
    """
    capture = read(path).largest
    if capture.tx_xyz is None or len(capture) < _FEWEST:
        raise RfgsFormatError(f"{path}: expected at least {_FEWEST} pictures with places")
    pictures = np.abs(capture.values[:, 0, 0, 0]).astype(np.float32)
    places = capture.tx_xyz
    fold = folds(places)
    answers = {name: np.zeros_like(pictures) for name in ("mean_picture", "nearest", "ours")}
    for number in range(CELLS):
        train, test = np.flatnonzero(fold != number), np.flatnonzero(fold == number)
        if not len(test) or not len(train):
            raise RfgsFormatError(f"{path}: places fill too little of the room for blocks")
        answers["mean_picture"][test] = pictures[train].mean(axis=0)
        answers["nearest"][test] = pictures[_nearest(places, test, train)]
        answers["ours"][test] = _kriged(pictures[train], places[train], places[test])
    result: dict[str, float | str] = {
        f"{name}_ssim": _ssim(pictures, answer) for name, answer in answers.items()
    }
    test_pictures = capture.packets["test"]
    if test_pictures.any() and not test_pictures.all():
        test, train = np.flatnonzero(test_pictures), np.flatnonzero(~test_pictures)
        nearest = pictures[_nearest(places, test, train)]
        result["nearest_random_ssim"] = _ssim(pictures[test], nearest)
    return result


def _nearest(places: np.ndarray, wanted: np.ndarray, among: np.ndarray) -> np.ndarray:
    """Index of the nearest of some places for each of others."""
    distance = np.linalg.norm(places[wanted][:, None] - places[among], axis=2)
    return among[distance.argmin(axis=1)]


def _kriged(
    pictures: Float[np.ndarray, "train pixel"],
    known: Float[np.ndarray, "train 3"],
    wanted: Float[np.ndarray, "test 3"],
) -> Float[np.ndarray, "test pixel"]:
    """Pictures at other places."""
    mean = pictures.mean(axis=0)
    change = (pictures - mean).astype(np.float64)
    variance = float((change**2).mean()) or 1.0
    extent = float(np.linalg.norm(np.ptp(known, axis=0))) or 1.0
    best, found = -np.inf, np.zeros((len(wanted), pictures.shape[1]))
    for share in _LENGTHS:
        covariance = _covariance(known, known, share * extent) + _NOISE * np.eye(len(known))
        factor = np.linalg.cholesky(covariance)
        white = np.linalg.solve(factor, change)
        likelihood = -0.5 * float((white**2).sum()) / variance
        likelihood -= pictures.shape[1] * float(np.log(np.diag(factor)).sum())
        if likelihood > best:
            weights = np.linalg.solve(factor.T, white)
            best, found = likelihood, _covariance(wanted, known, share * extent) @ weights
    return mean + found


def _covariance(one: np.ndarray, two: np.ndarray, length_m: float) -> np.ndarray:
    distance = np.linalg.norm(one[:, None] - two, axis=2)
    return np.exp(-distance / length_m)


def _ssim(true: np.ndarray, predicted: np.ndarray) -> float:
    """Mean structural similarity of pictures of levels (powers) in [0, 1]."""
    from skimage.metrics import structural_similarity

    shape = (ELEVATIONS, AZIMUTHS)
    rows = [
        structural_similarity(
            (a**2).reshape(shape), np.clip(b, 0.0, 1.0).reshape(shape) ** 2, data_range=1.0
        )
        for a, b in zip(true, predicted, strict=True)
    ]
    return float(np.mean(rows))
