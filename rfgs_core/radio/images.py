# SPDX-License-Identifier: Apache-2.0
"""What the ends of a path see: mirror images of the other end, or of scattering points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, Integer

#: Codes of what happens to a path at a corner, those of Sionna RT; 0 is nothing.
SPECULAR, DIFFUSE, REFRACTION, DIFFRACTION, SCATTERING = 1, 2, 4, 8, 16

_Kinds = Integer[np.ndarray, "path bounce"]
_Corners = Float64[np.ndarray, "path corner 3"]


@dataclass(frozen=True)
class Images:
    """What the ends of each path see."""

    one_sided: np.ndarray
    """Whether the path has one mirror image from end to end, bool, shape (path,)."""
    seen_from_tx: np.ndarray
    """Image of the first scattering point seen from the transmitter [m], shape (path, 3)."""
    seen_from_rx: np.ndarray
    """Image of the last scattering point, or of the transmitter, seen from the receiver [m]."""
    mirror: np.ndarray
    """Turns offsets at the transmitter into offsets of its image, shape (path, 3, 3)."""
    middle_m: np.ndarray
    """Length between first and last scattering point [m], shape (path,)."""


def breaks(kinds: _Kinds) -> Bool[np.ndarray, "path bounce"]:
    """Corners after which a path no longer has one mirror image."""
    return (kinds != 0) & (kinds != SPECULAR) & (kinds != REFRACTION)


def directions(vertices: _Corners) -> Float64[np.ndarray, "path step 3"]:
    """Unit vectors from corner to corner, zero where two coincide."""
    steps = np.diff(vertices, axis=1)
    return steps / np.maximum(np.linalg.norm(steps, axis=2), 1e-12)[:, :, None]


def images(vertices: _Corners, kinds: _Kinds) -> Images:
    """Unfolds paths into the straight lines that both ends see.

    Args:
        vertices: Corners from transmitter to receiver [m], padded with the receiver.
        kinds: What happens at each inner corner, 0 beyond the last.
    """
    length = np.linalg.norm(np.diff(vertices, axis=1), axis=2)
    # Padding repeats the receiver, so directions are taken where a step exists.
    k = directions(vertices)
    depth = kinds.shape[1]
    count = (kinds != 0).sum(axis=1)
    broken = breaks(kinds)
    one_sided = ~broken.any(axis=1)
    last = k[np.arange(len(k)), count]
    first_break = np.argmax(broken, axis=1) if depth else np.zeros(len(k), dtype=np.int64)
    last_break = depth - 1 - np.argmax(broken[:, ::-1], axis=1) if depth else first_break
    before = np.where(np.arange(depth + 1) <= first_break[:, None], length, 0.0).sum(axis=1)
    after = np.where(np.arange(depth + 1) > last_break[:, None], length, 0.0).sum(axis=1)
    total = length.sum(axis=1)
    after = np.where(one_sided, total, after)
    before = np.where(one_sided, 0.0, before)
    return Images(
        one_sided=one_sided,
        seen_from_tx=vertices[:, 0] + before[:, None] * k[:, 0],
        seen_from_rx=vertices[:, -1] - after[:, None] * last,
        mirror=_mirror(kinds, k),
        middle_m=np.where(one_sided, 0.0, total - before - after),
    )


def _mirror(kinds: _Kinds, k: np.ndarray) -> np.ndarray:
    """Product of the reflections along each path, shape (path, 3, 3)."""
    product = np.broadcast_to(np.eye(3), (len(k), 3, 3)).copy()
    for i in range(kinds.shape[1]):
        normal = k[:, i + 1] - k[:, i]
        size = np.linalg.norm(normal, axis=1)
        bends = (kinds[:, i] == SPECULAR) & (size > 1e-9)
        normal = np.where(bends[:, None], normal / np.maximum(size, 1e-12)[:, None], 0.0)
        reflect = np.eye(3) - 2.0 * normal[:, :, None] * normal[:, None, :]
        product = reflect @ product
    return product
