# SPDX-License-Identifier: Apache-2.0
"""Sionna's paths between sites of antennas, in an order that does not depend on threads."""

from __future__ import annotations

import numpy as np
import sionna.rt as rt

from rfgs_core.simulate.paths.path_set import PathSet, empty


def path_set(paths: rt.Paths, tx_centres: np.ndarray, rx_centres: np.ndarray) -> PathSet:
    """Reads Sionna's paths between one-element sites, all of them in the scene.

    Args:
        paths: Result of a solver, traced with `synthetic_array=True`.
        tx_centres: Transmitter of every site [m], shape (site, 3).
        rx_centres: Receiver of every site [m], shape (site, 3).

    Returns:
        The valid paths, sorted, with one amplitude node.
    """
    valid = np.array(paths.valid).astype(bool)
    if valid.size == 0 or not valid.any():
        return empty(0)
    rx, tx, _ = np.nonzero(valid)
    # Sionna's axes: (rx, rx port, tx, tx port, path); ours count transmitting ports first.
    real, imag = (np.array(part).transpose(0, 2, 4, 3, 1)[valid] for part in paths.a)
    kinds = np.array(paths.interactions)[:, valid].T.astype(np.int64)
    primitives = np.array(paths.primitives)[:, valid].T.astype(np.int64)
    objects = np.array(paths.objects)[:, valid].T.astype(np.int64)
    corners = np.moveaxis(np.array(paths.vertices)[:, valid], 0, 1).astype(np.float64)
    corners = np.where((kinds == 0)[:, :, None], rx_centres[rx][:, None, :], corners)
    vertices = np.concatenate(
        [tx_centres[tx][:, None, :], corners, rx_centres[rx][:, None, :]], axis=1
    )
    amplitude = (real.astype(np.float64) + 1j * imag.astype(np.float64)).reshape(len(tx), -1, 1)
    primitives, objects = (np.where(kinds == 0, 0, column) for column in (primitives, objects))
    return PathSet(tx, rx, amplitude, vertices, kinds, primitives, objects).sorted()
